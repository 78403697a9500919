"""Innovations that are too large to be noise, and what they count: no single event decides an answer."""

from __future__ import annotations

import numpy as np

from identification.record import Floats, Mask
from identification.signals.robust import robust_deviation

OUTLIER = 4.0
"""Standard deviations [-] beyond which one innovation (a step of the load, a spike) counts less; ours: it leaves
0.006 % of Gaussian innovations cut."""


def clipped_gain(mine: Floats, other: Floats) -> Floats:
    """Gain in log likelihood [nat] at every innovation of one model over another's, none counting beyond OUTLIER.

    Parameters
    ----------
    mine, other : ndarray of shape (n,)
        Innovations of the two, in one unit; the first give the scale.

    Returns
    -------
    ndarray of shape (n,)
        Zero where the first have no scale.
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
