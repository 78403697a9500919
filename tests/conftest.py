"""Settings that all tests share."""

import os

from hypothesis import HealthCheck, settings

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
"""Each process uses one thread for linear algebra, as on the command line: the suite runs several processes."""

settings.register_profile(
    "suite", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile(
    "long", deadline=None, max_examples=20_000, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile(os.environ.get("TRIAGE_SEARCH", "suite"))
"""The suite's random searches have a fixed seed and no deadline. The results do not depend on chance or on the load
of the machine. A failure that the long search (TRIAGE_SEARCH=long) finds becomes an explicit example of the test.
The first call of a kernel may compile the kernel, which takes longer than any deadline."""
