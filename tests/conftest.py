"""Settings that all tests share."""

import os

from hypothesis import HealthCheck, settings

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
"""As on the command line: the suite's processes stand side by side, threads of linear algebra would crowd them."""

settings.register_profile(
    "suite", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile(
    "long", deadline=None, max_examples=20_000, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile(os.environ.get("TRIAGE_SEARCH", "suite"))
"""The suite's random searches have a fixed seed and no clock, so that no test hangs on luck or on a busy machine;
what the long search finds (TRIAGE_SEARCH=long) becomes an example beside the test. The first call of a kernel may
compile it, which takes longer than any deadline."""
