"""The spread of noise where outliers stand beside it."""

from __future__ import annotations

import numpy as np

from identification.record import Floats

NORMAL_QUARTILE = 0.6745
"""Median size of a Gaussian variable in terms of its standard deviation [-]."""


def robust_deviation(e: Floats) -> float:
    """Standard deviation of a variable about zero by its median size, e of shape (n,); outliers leave it alone."""
    return float(np.median(np.abs(e))) / NORMAL_QUARTILE
