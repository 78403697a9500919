"""Benchmarks, each a command: python -m benchmarks.NAME. Linear algebra takes one thread, as in a night."""

import ctypes
import os
import resource
import sys

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")


def adopt() -> None:
    """Become the parent of processes whose own ends before them, such as a run's server of workers: what they spend
    counts once they are waited for. Linux alone; elsewhere a run's workers are its children."""
    if sys.platform == "linux":
        become_subreaper = 36
        ctypes.CDLL(None).prctl(become_subreaper, 1)


def spent() -> resource.struct_rusage:
    """What all descendants that have ended have spent, those among them that were adopted; waits for these."""
    while True:
        try:
            os.waitpid(-1, 0)
        except ChildProcessError:
            return resource.getrusage(resource.RUSAGE_CHILDREN)
