"""Detection of an OP that switches between two values, by an on/off or pulsed controller; no PID law applies then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.limits import LAW
from identification.record import Floats, Mask


@dataclass(frozen=True, slots=True)
class Switching:
    """The two values between which OP switches [% OP], and the number of switches."""

    low: float
    high: float
    switches: int


def switching(op: Floats, use: Mask) -> Switching | None:
    """The two values of OP, if it has no other significant values; None if it has, or if it hardly ever switches.

    op : shape (n,) [% OP]; use : bool, shape (n,), False where a sample must not be used. Samples between the two
    values count for neither.
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
