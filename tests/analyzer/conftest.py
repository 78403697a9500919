"""One small plant of coupled loops, run through the nightly batch once for all tests of what comes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from analyzer.cli import main
from proofs.coupled.__main__ import written
from proofs.coupled.draw import draw


@dataclass(frozen=True)
class RunPlant:
    """A store of one night, where its export lies, and the truth by loop."""

    store: Path
    export: Path
    truth: Mapping[str, Mapping[str, Any]]


@pytest.fixture(scope="session")
def run_plant(tmp_path_factory: pytest.TempPathFactory) -> RunPlant:
    """Thirty loops over eight hours, a sticking valve among them that moves six others."""
    folder = tmp_path_factory.mktemp("coupled")
    drawn = draw(46, loops=30, sources=1, hours=8.0, step_s=10.0)
    written(folder, drawn, 46)
    export, store = folder / "export.parquet", folder / "store"
    loops = ["--loops", str(folder / "loops.csv")]
    arguments = ["run", str(export), *loops, "--store", str(store), "--jobs", "1"]
    done = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return RunPlant(store, export, drawn.truth)
