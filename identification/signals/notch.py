"""A signal without a narrow band about one period."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.record import Floats


def notch(x: Floats, period: float, width: float) -> Floats:
    """The signal without a narrow band about one period.

    Parameters
    ----------
    x : ndarray of shape (n,)
    period : float
        Centre of the band in samples.
    width : float
        Full width of the band as a share of its frequency.

    Returns
    -------
    ndarray of shape (n,)
        Second-order notch, zeros on the unit circle; gain one far from the band.
    """
    w = 2 * math.pi / period
    radius = math.exp(-0.5 * w * width)
    level = (1 - 2 * radius * math.cos(w) + radius**2) / (2 - 2 * math.cos(w))
    return _second_order(np.ascontiguousarray(x), math.cos(w), radius, level)


@njit(cache=True)
def _second_order(x: Floats, cosine: float, radius: float, level: float) -> Floats:
    out = np.empty_like(x)
    base = x[0]
    x1, x2, y1, y2 = base, base, base, base
    for k in range(x.size):
        y = level * (x[k] - 2 * cosine * x1 + x2) + 2 * radius * cosine * y1 - radius * radius * y2
        x2, x1, y2, y1 = x1, x[k], y1, y
        out[k] = y
    return out
