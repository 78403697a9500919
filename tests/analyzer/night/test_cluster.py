"""The batch on a Dask cluster, with a scheduler and workers as processes over TCP, gives exactly the same store."""

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
    """24 loops of an hour that do not oscillate."""
    loops = {f"L{k:02d}": quiet(k, 3600) for k in range(LOOPS)}
    return write_export(tmp_path_factory.mktemp("cluster") / "night.parquet", loops)


@pytest.fixture(scope="module")
def whole(export: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, object]]]:
    """The tables of a run on this machine only."""
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
    """Two workers over TCP store the same tables as one process, cell by cell."""
    address, _ = cluster
    result = ran(export, tmp_path / "store", "--scheduler", address)
    assert result.exit_code == 0, result.output
    assert tables(tmp_path / "store") == whole


def test_a_worker_killed_during_the_run_loses_no_loop(export, whole, cluster, tmp_path):
    """If one of two workers is killed with kill -9 during the run, the other assesses its loops: the store is the
    same.
    """
    address, workers = cluster
    store = tmp_path / "store"
    command = [sys.executable, "-m", "analyzer.cli", "run", str(export), "--store", str(store)]
    with subprocess.Popen([*command, "--scheduler", address], stderr=subprocess.PIPE, text=True) as run:
        while run.poll() is None and not list(store.glob("parts/*/nights-*.parquet")):
            time.sleep(0.005)
        os.kill(workers[0].pid, signal.SIGKILL)
        _, output = run.communicate(timeout=120)
    assert run.returncode == 0, output
    assert tables(store) == whole


@pytest.mark.slow
def test_a_scheduler_that_dies_is_one_line(export, whole, tmp_path):
    """If the scheduler is killed with kill -9 during the run, the run ends with exit 2 and one last line.

    The line names the scheduler and --resume. The resumed run on this machine gives the store of an undisturbed run.
    """
    store = tmp_path / "store"
    command = [sys.executable, "-m", "analyzer.cli", "run", str(export), "--store", str(store)]
    with contextlib.ExitStack() as held:
        address, parts = held.enter_context(whole_cluster(tmp_path))
        arguments = [*command, "--scheduler", address]
        run = held.enter_context(subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True))
        while run.poll() is None and not list(store.glob("parts/*/nights-*.parquet")):
            time.sleep(0.005)
        os.kill(parts[0].pid, signal.SIGKILL)
        _, output = run.communicate(timeout=120)
    assert run.returncode == 2, output
    assert "Traceback" not in output
    assert address in output.splitlines()[-1]
    assert "--resume" in output.splitlines()[-1]
    assert ran(export, store, "--resume").exit_code == 0
    assert tables(store) == whole


def test_no_scheduler_is_one_line(export, tmp_path):
    """An address without a scheduler is reported before anything is computed."""
    result = ran(export, tmp_path / "store", "--scheduler", "tcp://127.0.0.1:9")
    assert result.exit_code == 2
    assert "no scheduler responds" in result.stderr
    assert "Traceback" not in result.output
