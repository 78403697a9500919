"""The batch on a Dask cluster, a scheduler and workers as processes over TCP: the same store to the cell."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from plant import write_export
from test_batch import quiet, tables

from analyzer.cli import main

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


def process(*arguments: str) -> subprocess.Popen[bytes]:
    """A part of the cluster as a process."""
    quiet_output = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]], **quiet_output
    )


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers of one thread on loopback; their address and the workers."""
    written = tmp_path / "scheduler.json"
    local = ("--host", "127.0.0.1")
    parts = [
        process("dask_scheduler", *local, "--port", "0", "--no-dashboard", "--scheduler-file", str(written))
    ]
    for _ in range(400):
        if written.exists() and written.stat().st_size:
            break
        time.sleep(0.05)
    import json

    address = json.loads(written.read_text())["address"]
    one = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(tmp_path))
    parts += [process("dask_worker", address, *local, *one) for _ in range(2)]
    yield address, parts[1:]
    for part in parts:
        part.kill()
        part.wait()


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


def test_no_scheduler_is_one_line(export, tmp_path):
    """An address at which nothing answers is told before anything is computed."""
    result = ran(export, tmp_path / "store", "--scheduler", "tcp://127.0.0.1:9")
    assert result.exit_code == 2
    assert "no scheduler answers" in result.stderr
    assert "Traceback" not in result.output
