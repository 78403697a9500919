"""The batch on a Dask cluster, a scheduler and workers as processes over TCP: the same store to the cell."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from proofs.plant import write_export
from tests.analyzer.night.dask_cluster import Process, dask_cluster, whole_cluster
from tests.analyzer.night.test_batch import quiet, tables

pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
LOOPS = 24


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """24 quiet loops of an hour."""
    loops = {f"L{k:02d}": quiet(k, 3600) for k in range(LOOPS)}
    return write_export(tmp_path_factory.mktemp("cluster") / "night.parquet", loops)


@pytest.fixture(scope="module")
def whole(export: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, object]]]:
    """What a run of this machine alone keeps."""
    store = tmp_path_factory.mktemp("whole") / "store"
    assert ran(export, store).exit_code == 0
    return tables(store)


def ran(export: Path, store: Path, *more: str) -> Result:
    """The batch."""
    return CliRunner().invoke(main, ["run", str(export), "--store", str(store), *more])


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[Process]]]:
    """A scheduler and two workers of one thread on loopback; their address and the workers."""
    with dask_cluster(tmp_path) as parts:
        yield parts


def test_a_cluster_makes_the_same_store(export, whole, cluster, tmp_path):
    """Two workers over TCP keep what one process keeps, cell by cell."""
    address, _ = cluster
    result = ran(export, tmp_path / "store", "--scheduler", address)
    assert result.exit_code == 0, result.output
    assert tables(tmp_path / "store") == whole


def test_a_worker_killed_in_mid_run_costs_no_loop(export, whole, cluster, tmp_path):
    """With kill -9 of one of two workers once a piece is written, the other does its loops: the store is the same."""
    address, workers = cluster
    store = tmp_path / "store"
    command = [sys.executable, "-m", "analyzer.cli", "run", str(export), "--store", str(store)]
    with subprocess.Popen([*command, "--scheduler", address], stderr=subprocess.PIPE, text=True) as run:
        while run.poll() is None and not list(store.glob("parts/*/nights-*.parquet")):
            time.sleep(0.005)
        os.kill(workers[0].pid, signal.SIGKILL)
        _, said = run.communicate(timeout=120)
    assert run.returncode == 0, said
    assert tables(store) == whole


@pytest.mark.slow
def test_a_scheduler_that_dies_is_one_line(export, whole, tmp_path):
    """With kill -9 of the scheduler in mid-run the run ends with exit 2 and a last line that names it and --resume,
    and so gone on with on this machine it makes the store of an undisturbed run."""
    store = tmp_path / "store"
    command = [sys.executable, "-m", "analyzer.cli", "run", str(export), "--store", str(store)]
    with contextlib.ExitStack() as held:
        address, parts = held.enter_context(whole_cluster(tmp_path))
        asked = [*command, "--scheduler", address]
        run = held.enter_context(subprocess.Popen(asked, stderr=subprocess.PIPE, text=True))
        while run.poll() is None and not list(store.glob("parts/*/nights-*.parquet")):
            time.sleep(0.005)
        os.kill(parts[0].pid, signal.SIGKILL)
        _, said = run.communicate(timeout=120)
    assert run.returncode == 2, said
    assert "Traceback" not in said
    assert address in said.splitlines()[-1]
    assert "--resume" in said.splitlines()[-1]
    assert ran(export, store, "--resume").exit_code == 0
    assert tables(store) == whole


def test_no_scheduler_is_one_line(export, tmp_path):
    """An address at which nothing answers is told before anything is computed."""
    result = ran(export, tmp_path / "store", "--scheduler", "tcp://127.0.0.1:9")
    assert result.exit_code == 2
    assert "no scheduler responds" in result.stderr
    assert "Traceback" not in result.output
