"""Benchmarks, each a command: python -m benchmarks.NAME. Linear algebra uses one thread, as in a night."""

import ctypes
import os
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


_OWN: set[int] = set()
"""Children of this process before it began to adopt; they may run longer than this process."""


def adopt() -> None:
    """Become the parent of processes whose own parent ends before them, such as a run's server of workers. Their
    resources count once they are waited for. Linux only; elsewhere a run's workers are its children."""
    if sys.platform == "linux":
        become_subreaper = 36
        ctypes.CDLL(None).prctl(become_subreaper, 1)
        _OWN.update(_children())


def _children() -> set[int]:
    """Processes whose parent is this one."""
    lists = Path("/proc/self/task").glob("*/children")
    return {int(pid) for one in lists for pid in one.read_text().split()}


def spent() -> resource.struct_rusage:
    """Resources of all descendants that have ended, with the adopted ones; waits for these."""
    while left := _children() - _OWN if sys.platform == "linux" else set():
        for pid in left:
            with suppress(ChildProcessError):
                os.waitpid(pid, 0)
    return resource.getrusage(resource.RUSAGE_CHILDREN)


@dataclass(frozen=True)
class Own:
    """Resources of one process without its children: processor and wall time [s], largest memory [MB]."""

    processor_s: float
    wall_s: float
    memory_mb: float


def own_of(command: Sequence[str]) -> Own:
    """Run a command to its end and return the resources of its own process. Linux only; SystemExit where it fails."""
    begun, memory = time.perf_counter(), 0
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    while True:
        with suppress(
            OSError, StopIteration
        ):  # its own figure: the count of the system begins with its parent's
            held = Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8").splitlines()
            memory = max(memory, int(next(x for x in held if x.startswith("VmHWM")).split()[1]))
        pid, status, used = os.wait4(process.pid, os.WNOHANG)
        if pid:
            break
        time.sleep(0.02)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    return Own(used.ru_utime + used.ru_stime, time.perf_counter() - begun, memory / 1024)
