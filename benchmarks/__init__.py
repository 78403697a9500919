"""Benchmarks, each a command: python -m benchmarks.NAME. Linear algebra takes one thread, as in a night."""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
