"""What a historian keeps of a trend: resolution, exception deadband, swinging-door compression."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True)
def _exceptions(x: Floats, deadband: float) -> Floats:
    """The last value reported; a new one is reported once it differs by `deadband`."""
    kept, last = np.empty_like(x), x[0]
    for k in range(x.size):
        if abs(x[k] - last) >= deadband:
            last = x[k]
        kept[k] = last
    return kept


def grid(x: Floats, step: float) -> Floats:
    """x on multiples of `step` as clean decimals (0.35, not 0.35000000000000003); unit of x."""
    per_unit = round(1.0 / step)
    return np.round(x * per_unit) / per_unit


def reported(x: Floats, step: float) -> Floats:
    """x as stored by exception: on the grid of `step`, changes smaller than that not reported; unit of x."""
    return grid(_exceptions(x, step), step)


@njit(cache=True)
def _door(x: Floats, deviation: float) -> NDArray[np.int64]:
    """Indices that a swinging door of half-width `deviation` archives (Bristol 1987), shape (m,)."""
    kept = [0]
    anchor, high, low = 0, np.inf, -np.inf
    for k in range(1, x.size):
        slope = (x[k] - x[anchor]) / (k - anchor)
        if not low <= slope <= high:
            anchor, high, low = k - 1, np.inf, -np.inf
            kept.append(anchor)
        high = min(high, (x[k] + deviation - x[anchor]) / (k - anchor))
        low = max(low, (x[k] - deviation - x[anchor]) / (k - anchor))
    kept.append(x.size - 1)
    return np.array(kept)


def compressed(x: Floats, deviation: float, step: float) -> Floats:
    """x after swinging-door compression, interpolated back onto its clock; all in the unit of x."""
    kept = _door(x, deviation)
    return grid(np.interp(np.arange(x.size), kept, x[kept]), step)
