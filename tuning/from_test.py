"""Settings of a PI controller from a process identified in a test: SIMC's, and the fastest that are robust within the
test's intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

from identification.models import Estimate, Fopdt, Integrator, Loop, Pid, Process
from tuning.frequency_response import maximum_sensitivity
from tuning.rules import effective_delay, simc

TEST_TI = (0.6, 0.8, 1.0, 1.3)
"""Integral times that are tried for settings from a test [of SIMC's Ti]: the error of a load step is Ti/Kp,
which is flat about its least."""
TEST_MS = 1.7
"""Largest maximum sensitivity of settings from a test, wherever the process lies in its intervals. Source:
Grimholt, Skogestad 2012: SIMC with tau_c = L has 1.6 to 1.7."""

HALVINGS = 14
"""Halvings of the search for a gain; the last step is .01 %."""


@dataclass(frozen=True, slots=True)
class FromTest:
    """SIMC's settings with tau_c = L, the settings of highest gain whose maximum sensitivity stays within a limit for
    all processes in the intervals, and the sensitivity of each on the process itself [-]."""

    simc: Pid
    robust: Pid
    simc_ms: float
    robust_ms: float


def corners(process: Process, e: dict[str, Estimate]) -> tuple[Process, ...]:
    """The processes at the ends of the intervals of gain (or slope), lag and dead time by name, and the process."""
    dead = e["dead_time_s"]
    late = [max(process.dead_time_s + end - dead.value, 0.0) for end in (dead.low, dead.high)]
    if isinstance(process, Integrator):
        slope = e["slope_pct_per_s"]
        return process, *(Integrator(s, d) for s, d in product((slope.low, slope.high), late))
    gain, lags = e["gain"], e["lags_s"]
    times = [process.time_constant_s * end / lags.value for end in (lags.low, lags.high)]
    return process, *(Fopdt(k, t, d) for k, t, d in product((gain.low, gain.high), times, late))


def settings_from(process: Process, among: Sequence[Process], scan_s: float) -> FromTest:
    """Settings for a process that may be any of `among`, the process itself the first; scan_s [s], 0: continuous.

    Raises ValueError where the process has no gain, or negligible delay.
    """
    fastest = max(effective_delay(p, scan_s) for p in among)
    plain = simc(process, max(effective_delay(process, scan_s), 1e-9), scan_s)
    slow = simc(process, max(fastest, 1e-9), scan_s)
    found = []
    for share in TEST_TI:
        ti_s = slow.ti_s * share
        pid = _strongest(replace(slow, ti_s=ti_s), among)
        if pid is not None:
            found.append(pid)
    robust = min(found, key=lambda pid: pid.ti_s / abs(pid.kp), default=slow)
    each = (float(maximum_sensitivity(Loop(process, pid))) for pid in (plain, robust))
    return FromTest(plain, robust, *each)


def _strongest(pid: Pid, among: Sequence[Process]) -> Pid | None:
    """The controller with the largest gain whose sensitivity stays within the limit on all given processes."""

    def holds(kp: float) -> bool:
        trial = replace(pid, kp=kp)
        return all(float(maximum_sensitivity(Loop(p, trial))) <= TEST_MS for p in among)

    low, high = 0.02 * pid.kp, 4.0 * pid.kp
    if not holds(low):
        return None
    for _ in range(HALVINGS):
        middle = math.copysign(math.sqrt(low * high), pid.kp)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return replace(pid, kp=low)
