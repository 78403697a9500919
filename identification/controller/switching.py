"""Does OP switch between two values, as an on/off or a pulsed controller's does: then no PID law moves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.limits import LAW
from identification.record import Floats, Mask


@dataclass(frozen=True, slots=True)
class Switching:
    """The two values between which OP switches [% OP], and how often it does."""

    low: float
    high: float
    switches: int


def switching(op: Floats, use: Mask) -> Switching | None:
    """OP's two values, where it has no others of note; None where it has, or hardly ever switches.

    op : shape (n,) [% OP]; use : bool, shape (n,), False where a sample must not be used. Samples caught between the
    two count as of neither.
    """
    seen = op[use]
    if seen.size == 0 or float(np.ptp(seen)) < LAW.switched_pct:
        return None
    low, high = float(seen.min()), float(seen.max())
    at = np.where(seen > high - LAW.switch_level * (high - low), 1, 0)
    at[(at == 0) & (seen > low + LAW.switch_level * (high - low))] = -1
    known = at[at >= 0]
    switches = int(np.count_nonzero(np.diff(known)))
    if known.size < LAW.switched_share * seen.size or switches < LAW.switches:
        return None
    return Switching(low, high, switches)
