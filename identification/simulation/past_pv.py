"""What a gain or a load does that goes with PV as it was recorded: where it has been, which side of a switch."""

from __future__ import annotations

import numpy as np
from numba import njit

from identification.record import Floats
from identification.simulation.valve_chain import lagged

RAMP = 0.5
"""Change of PV [% PV] over which a switched load comes on; ours: about the noise of a transmitter, so that the place
of the switch has a slope to search along."""
LEAST_GAIN = 0.05
"""What is left of a gain at least; ours, as of one that goes with the level."""


@njit(cache=True)
def switched(pv: Floats, at: float, band: float) -> Floats:
    """How far a load is on, from 0 to 1, shape (n,), that PV switches on above a place and off below it.

    pv, at : [% PV]; band : from off to on [% PV]. It is off before the first sample that is above.
    """
    out = np.empty_like(pv)
    on, half = 0.0, 0.5 * band
    for k in range(pv.size):
        up = (pv[k] - at - half) / RAMP + 0.5
        down = (pv[k] - at + half) / RAMP + 0.5
        on = min(max(on, min(max(up, 0.0), 1.0)), min(max(down, 0.0), 1.0))
        out[k] = on
    return out


def recalled(pv: Floats, change: float, memory_s: float, dt_s: float) -> Floats:
    """Relative change of gain with where PV has been before each sample, shape (n,).

    pv : deviation from where the gain is itself, shape (n,) [% PV]; change : per 10 % of PV [-]; memory_s : time
    constant of the mean that is remembered [s].
    """
    past = lagged(np.concatenate((np.zeros(1), pv[:-1])), memory_s, dt_s)
    return np.maximum(change * past / 10.0, LEAST_GAIN - 1.0)  # type: ignore[no-any-return]


def returned(pv: Floats, way_s: float, dt_s: float) -> Floats:
    """PV as it was a while before the middle of each sample, shape (n,); before the first sample as at the first, and
    never later than at the sample itself, for what comes after is not known yet.

    pv : shape (n,) [% PV]; way_s : how long before [s].
    """
    k = np.arange(pv.size)
    return np.interp(np.minimum(k + 0.5 - way_s / dt_s, k), k, pv)
