"""Noise of an experiment: white measurement noise plus a slowly wandering load.

The load is a first-order autoregression, d[k+1] = phi d[k] + w[k], the measurement adds white noise e[k]. The Kalman
filter of this scalar model (Harvey 1989, section 3.4) whitens any column; its gain does not depend on the data.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.record import Floats, Mask

WANDERS = 2.0
"""Gain in log likelihood from which noise includes drift: it has two more constants [nat]. Source: Akaike
1974: one nat a constant."""

RATIOS = tuple(float(x) for x in np.geomspace(1e-6, 30.0, 13))
"""Candidate variances of w relative to that of e [-]."""
MEMORIES = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 10000.0)
"""Candidate memories of the load [blocks]."""


class Wander(NamedTuple):
    """phi [-], and the variance of w over that of e [-]; no wandering load where that is 0."""

    phi: float = 0.0
    ratio: float = 0.0


@njit(cache=True)
def whitened(x: Floats, usable: Mask, phi: float, ratio: float) -> tuple[Floats, float]:
    """Whitened columns, shape (n, m), 0 where a sample is not usable; and the sum of innovations' log variances.

    The variances are relative to that of the white noise. The load begins at its stationary variance.
    """
    n, m = x.shape
    out = np.zeros((n, m))
    state = np.zeros(m)
    spread = ratio / (1.0 - phi * phi) if ratio > 0.0 else 0.0
    logs = 0.0
    for k in range(n):
        if usable[k]:
            total = spread + 1.0
            gain, root = spread / total, math.sqrt(total)
            for j in range(m):
                e = x[k, j] - state[j]
                out[k, j] = e / root
                state[j] += gain * e
            spread *= 1.0 - gain
            logs += math.log(total)
        for j in range(m):
            state[j] *= phi
        spread = phi * phi * spread + ratio
    return out, logs


def log_likelihood(squares: float, logs: float, count: int) -> float:
    """Log likelihood [nat] with the white noise's variance at its optimum, without constants."""
    return -0.5 * count * math.log(max(squares, 1e-300) / count) - 0.5 * logs


def wander_of(residual: Floats, usable: Mask) -> Wander:
    """The most likely wander of residuals, shape (n,): a grid, then a finer one about the best point."""
    column, count = residual[:, None], int(usable.sum())

    def value(phi: float, ratio: float) -> float:
        e, logs = whitened(column, usable, phi, ratio)
        return log_likelihood(float((e**2).sum()), logs, count)

    best, top = Wander(), value(0.0, 0.0) + WANDERS
    memories = [m for m in MEMORIES if m <= 10.0 * residual.size]
    ratios = RATIOS
    for _ in range(2):
        for memory in memories:
            for ratio in ratios:
                phi = math.exp(-1.0 / memory)
                found = value(phi, ratio)
                if found > top:
                    best, top = Wander(phi, ratio), found
        if best.ratio == 0.0:
            break
        memory = -1.0 / math.log(best.phi)
        memories = [memory * f for f in (0.6, 0.8, 1.0, 1.3, 1.7)]
        ratios = tuple(best.ratio * f for f in (0.4, 0.6, 1.0, 1.6, 2.5))
    return best
