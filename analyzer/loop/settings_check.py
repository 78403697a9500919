"""Whether the controller works with the settings that loops.csv states, as far as the trends tell.

Settings are changed and lists are not; advice that rests on settings of last month can double an error. The law that
OP follows is recovered from the night's own SP, PV and OP, and where it explains OP far better than the stated one
and is another, the two are told and nothing is advised.
"""

from __future__ import annotations

import math

from analyzer.config import SettingsLimits
from identification.controller.pid_regression import LawsCompared, compare_laws
from identification.models import Pid
from identification.record import LoopRecord

FEWEST = 2.0
"""Samples of a stated integral time from which it can be judged; ours: within fewer the integral is not seen."""
FILTERED = 2.0
"""Factor by which the derivative's filter, which no list states, can hide its gain [-]; ours."""


def _factor(a: float, b: float) -> float:
    """How many times one setting is the other, at least 1; inf where one is nothing or the signs differ."""
    if a == b:
        return 1.0
    if not a * b > 0 or math.isinf(a) or math.isinf(b):
        return math.inf
    return max(a / b, b / a)


def differing(record: LoopRecord, stated: Pid, scale_s: float, limits: SettingsLimits) -> Pid | None:
    """The recorded settings, in percent and seconds, where they are plainly not the stated ones, in the whole record
    or in its later half.

    Settings that were changed within the record show in its later half, and those are the ones in force. scale_s is
    the period, or another time scale on which the loop moves [s]. None where they agree or the record cannot tell.
    """
    if record.mask("compressed").mean() > limits.straight_share:
        return None
    if stated.ti_s < FEWEST * record.dt_s:
        return None
    for part in (record.span(len(record) // 2, len(record)), record):
        seen = compare_laws(part, scale_s, stated)
        if seen is not None and seen.found == stated:
            return None
        if seen is not None and _plainly(seen, stated, record.dt_s, limits):
            return seen.found
    return None


def _plainly(seen: LawsCompared, stated: Pid, dt_s: float, limits: SettingsLimits) -> bool:
    """Whether the stated law is another than the one found, and explains plainly less: noise that the recorder adds
    to PV leaves the true law 1/explained times what it leaves the best."""
    if seen.explained < limits.explained or seen.explained - seen.explained_stated < limits.gain:
        return False
    return seen.left * seen.explained >= limits.left and _apart(seen.found, stated, dt_s) >= limits.factor


def _apart(found: Pid, stated: Pid, dt_s: float) -> float:
    """The largest factor between settings, less what a derivative's filter may make of it; of a slope that is taken
    between the samples nothing is known."""
    apart = max(_factor(found.kp, stated.kp), _factor(found.ti_s, stated.ti_s))
    if max(found.td_s, stated.td_s) == 0.0:
        return apart
    slopes = (pid.kp * max(pid.td_s, dt_s) for pid in (found, stated))
    slope = 1.0 if stated.scan_s < dt_s else _factor(*slopes)
    return max(apart / math.sqrt(FILTERED), slope / FILTERED)
