"""A Dask scheduler and workers of one thread each, as processes over TCP on loopback."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

Process = subprocess.Popen[bytes]
TRIES, PAUSE_S = 400, 0.05
"""Number of attempts to find the scheduler, and the pause after each one [s]."""


def _process(*arguments: str) -> Process:
    """A part of the cluster as a process."""
    command = [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@contextmanager
def dask_cluster(folder: Path, workers: int = 2) -> Iterator[tuple[str, list[Process]]]:
    """The address of a scheduler and its workers, which end with the block; `folder` contains the files that they
    write.
    """
    with whole_cluster(folder, workers) as (address, parts):
        yield address, parts[1:]


@contextmanager
def whole_cluster(folder: Path, workers: int = 2) -> Iterator[tuple[str, list[Process]]]:
    """The same, with the scheduler before its workers in the list."""
    written, local = folder / "scheduler.json", ("--host", "127.0.0.1")
    quiet = ("--no-dashboard", "--scheduler-file", str(written))
    parts = [_process("dask_scheduler", *local, "--port", "0", *quiet)]
    try:
        for _ in range(TRIES):
            if written.exists() and written.stat().st_size:
                break
            time.sleep(PAUSE_S)
        address = json.loads(written.read_text())["address"]
        one = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(folder))
        parts += [_process("dask_worker", address, *local, *one) for _ in range(workers)]
        yield address, parts
    finally:
        for part in parts:
            part.kill()
            part.wait()
