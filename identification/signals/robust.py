"""Robust statistics of noise with outliers: spread, and weights of innovations, so that no single event decides."""

from __future__ import annotations

import numpy as np

from identification.record import Floats, Mask

OUTLIER = 4.0
"""Standard deviations beyond which one innovation, or move of OP, is an outlier and counts less: it leaves
0.006 % of Gaussian innovations cut."""

NORMAL_QUARTILE = 0.6745
"""Median size of a Gaussian variable relative to its standard deviation [-]."""


def robust_deviation(e: Floats) -> float:
    """Standard deviation of a variable about zero from its median size, e of shape (n,); insensitive to outliers."""
    return float(np.median(np.abs(e))) / NORMAL_QUARTILE


def clipped_gain(mine: Floats, other: Floats) -> Floats:
    """Gain in log likelihood [nat] at every innovation of one model over another's, with outliers limited.

    mine, other : shape (n,), innovations of the two, in one unit; the first give the scale. Returns shape (n,), zero
    where the first have no scale.
    """
    scale = robust_deviation(mine)
    if not scale > 0:
        return np.zeros(mine.size)
    top = (OUTLIER * scale) ** 2
    return (np.minimum(other**2, top) - np.minimum(mine**2, top)) / (2 * scale**2)


def robust_weights(e: Floats, inside: Mask) -> Floats:
    """Weight of each innovation in a fit, shape (n,): 1, decreasing for outliers (Huber 1964), 0 outside."""
    size = np.abs(e) / max(robust_deviation(e[inside]), 1e-12)
    return np.where(inside, np.minimum(1.0, OUTLIER / np.maximum(size, OUTLIER)), 0.0)
