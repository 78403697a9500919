"""One small plant of coupled loops, run through the nightly batch once; several tests use its results."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from filelock import FileLock

from analyzer.cli import main
from proofs.coupled.__main__ import written
from proofs.coupled.draw import draw


@dataclass(frozen=True)
class RunPlant:
    """A store of one night, the path of its export, and the truth by loop."""

    store: Path
    export: Path
    truth: Mapping[str, Mapping[str, Any]]


@pytest.fixture(scope="session")
def run_plant(tmp_path_factory: pytest.TempPathFactory) -> RunPlant:
    """Thirty loops over eight hours, with one sticking valve that moves six other loops.

    The first test process that needs the plant makes it for all processes.
    """
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "coupled"
    export, store, made = folder / "export.parquet", folder / "store", folder / "made"
    with FileLock(f"{folder}.lock"):
        if not made.exists():
            written(folder, draw(46, loops=30, sources=1, hours=8.0, step_s=10.0), 46)
            stated = ["--loops", str(folder / "loops.csv")]
            arguments = ["run", str(export), *stated, "--store", str(store), "--jobs", "1"]
            done = CliRunner().invoke(main, arguments, catch_exceptions=False)
            assert done.exit_code == 0, done.output
            made.touch()
    truth = json.loads((folder / "truth.json").read_text())["loops"]
    return RunPlant(store, export, truth)
