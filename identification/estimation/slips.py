"""One slip of a stem: the chance of when it lets go, and what else a path of slips is scored by."""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from identification.record import Floats
from identification.simulation.lag import Lag

SCATTER = 0.05
"""Standard deviation of the distance at which a stem lets go, in that distance; ours, the one
value tried: on six simulated stems of dry friction OP, which comes in samples, goes 2 to 5 % beyond it (median)."""
FAR = 3.5
"""Standard deviations below the mean distance from which a slip is thought of at all; ours: about RARE."""


class Response(NamedTuple):
    """How PV follows the stem: its lag, the gain, and PV's slow terms, shape (blocks,)."""

    lag: Lag
    gain: float
    slow: Floats


class Noise(NamedTuple):
    """Noise model of single lags, of blocks, shape (order,), and the variance of its innovations [% PV squared]."""

    ar: Floats
    sigma2: float


class Friction(NamedTuple):
    """Mean distances |OP - stem| at which a stem lets go and comes to rest [% OP], and its longest rest [samples]."""

    breakaway: float
    sliding: float
    rest: int


@njit(cache=True)
def _normal(x: float) -> float:
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


@njit(cache=True)
def slip_chance(distance: float, farthest: float, breakaway: float) -> float:
    """Chance that a stem lets go between the farthest distance that it has borne and a farther one."""
    scatter = SCATTER * breakaway
    borne = _normal((farthest - breakaway) / scatter)
    return min((_normal((distance - breakaway) / scatter) - borne) / max(1.0 - borne, 1e-12), 1.0)


@njit(cache=True)
def log_chance(op: Floats, stem: Floats, breakaway: float) -> float:
    """Log probability of when a stem, shape of op, has slipped, given OP [nat]."""
    below, above, out = 0.0, 0.0, 0.0
    for k in range(1, op.size):
        gap = op[k] - stem[k - 1]
        far, farthest = abs(gap), above if gap > 0 else below
        if stem[k] != stem[k - 1]:
            out += math.log(max(slip_chance(far, farthest, breakaway), 1e-12))
            below, above = 0.0, 0.0
        elif far > farthest and far > breakaway * (1.0 - FAR * SCATTER):
            out += math.log(max(1.0 - slip_chance(far, farthest, breakaway), 1e-12))
            below, above = (below, far) if gap > 0 else (far, above)
    return out
