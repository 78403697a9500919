"""Noise with outliers beside it: its spread, and what each innovation counts, so that no single event decides."""

from __future__ import annotations

import numpy as np

from identification.record import Floats, Mask

NORMAL_QUARTILE = 0.6745
"""Median size of a Gaussian variable in terms of its standard deviation [-]."""


def robust_deviation(e: Floats) -> float:
    """Standard deviation of a variable about zero by its median size, e of shape (n,); outliers leave it alone."""
    return float(np.median(np.abs(e))) / NORMAL_QUARTILE


OUTLIER = 4.0
"""Standard deviations [-] beyond which one innovation (a step of the load, a spike) counts less; ours: it leaves
0.006 % of Gaussian innovations cut."""


def clipped_gain(mine: Floats, other: Floats) -> Floats:
    """Gain in log likelihood [nat] at every innovation of one model over another's, none counting beyond OUTLIER.

    mine, other : shape (n,), innovations of the two, in one unit; the first give the scale. Returns shape (n,), zero
    where the first have no scale.
    """
    scale = robust_deviation(mine)
    if not scale > 0:
        return np.zeros(mine.size)
    top = (OUTLIER * scale) ** 2
    return (np.minimum(other**2, top) - np.minimum(mine**2, top)) / (2 * scale**2)


def robust_weights(e: Floats, inside: Mask) -> Floats:
    """What each innovation counts in a fit, shape (n,): 1 within OUTLIER, falling beyond (Huber 1964), 0 outside."""
    size = np.abs(e) / max(robust_deviation(e[inside]), 1e-12)
    return np.where(inside, np.minimum(1.0, OUTLIER / np.maximum(size, OUTLIER)), 0.0)
