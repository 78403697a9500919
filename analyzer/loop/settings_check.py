"""Whether the controller works with the settings that loops.csv states, as far as the trends tell.

Settings are changed and lists are not; advice that rests on settings of last month can double an error. The PI law
that OP follows is recovered from the night's own SP, PV and OP, and where it explains OP far better than the stated
one and is another, the two are told and nothing is advised.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from analyzer.config import SettingsLimits
from identification.controller.pi_regression import compare_laws
from identification.models import Pid
from identification.record import LoopRecord


@dataclass(frozen=True, slots=True)
class SettingsDiffer:
    """Stated settings that are not those of the controller.

    stated, recorded : in percent and seconds; explained_stated, explained_recorded : share of the variance of OP's
    increments that each explains [-].
    """

    stated: Pid
    recorded: Pid
    explained_stated: float
    explained_recorded: float


def _factor(a: float, b: float) -> float:
    """How many times one setting is the other, at least 1; inf where one is nothing or the signs differ."""
    if a == b:
        return 1.0
    if not a * b > 0 or math.isinf(a) or math.isinf(b):
        return math.inf
    return max(a / b, b / a)


def differing(
    record: LoopRecord, stated: Pid, scale_s: float, limits: SettingsLimits
) -> SettingsDiffer | None:
    """The recorded settings where they are plainly not the stated ones, in the whole record or in its later half.

    Settings that were changed within the record show in its later half, and those are the ones in force. scale_s is
    the period, or another time scale on which the loop moves [s]. None where they agree or the record cannot tell.
    """
    later = record.span(len(record) // 2, len(record))
    return _differing(later, stated, scale_s, limits) or _differing(record, stated, scale_s, limits)


def _differing(
    record: LoopRecord, stated: Pid, scale_s: float, limits: SettingsLimits
) -> SettingsDiffer | None:
    shortest = limits.ti_samples * record.dt_s
    if stated.td_s > 0 or stated.ti_s < shortest or record.mask("compressed").mean() > limits.straight_share:
        return None
    found = compare_laws(record, scale_s, stated.kp, stated.ti_s, limits.gain)
    if found is None or not shortest <= found.ti_s < math.inf or found.explained < limits.explained:
        return None
    share = found.explained_given
    apart = max(_factor(found.kp, stated.kp), _factor(found.ti_s, stated.ti_s))
    better = found.explained - share > limits.gain and 1 - share > limits.left * (1 - found.explained)
    if not better or apart < limits.factor:
        return None
    return SettingsDiffer(stated, replace(stated, kp=found.kp, ti_s=found.ti_s), share, found.explained)
