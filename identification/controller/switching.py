"""Detection of an OP that switches between two values, by an on/off or pulsed controller; no PID law applies then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.record import Floats, Mask

SWITCHED_PCT = 5.0
"""Least distance of two values between which OP switches [% of OP]: steps of a converter are far less."""
SWITCH_LEVEL = 0.01  # Share of that distance within which OP is at one of them
SWITCHED_SHARE = 0.97  # Share of the samples at one of them: the others are averages over a switch
SWITCHES = 6
"""Switches from which a controller is one that switches: a PID that winds up from end to end passes the
values between."""


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
    if seen.size == 0 or float(np.ptp(seen)) < SWITCHED_PCT:
        return None
    low, high = float(seen.min()), float(seen.max())
    at = np.where(seen > high - SWITCH_LEVEL * (high - low), 1, 0)
    at[(at == 0) & (seen > low + SWITCH_LEVEL * (high - low))] = -1
    known = at[at >= 0]
    switches = int(np.count_nonzero(np.diff(known)))
    if known.size < SWITCHED_SHARE * seen.size or switches < SWITCHES:
        return None
    return Switching(low, high, switches)
