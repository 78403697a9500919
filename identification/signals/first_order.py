"""A filter of first order, as controllers and transmitters have."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.record import Floats


@njit(cache=True)
def _smoothed(x: Floats, pole: float) -> Floats:
    out = np.empty(x.size)
    y = x[0]
    for k in range(x.size):
        y = x[k] + (y - x[k]) * pole
        out[k] = y
    return out


def first_order(x: Floats, samples: float) -> Floats:
    """A signal behind a first-order filter at rest at its first value, shape (n,).

    Parameters
    ----------
    x : ndarray of shape (n,)
    samples : float
        The filter's time constant [samples]; 0 is none.
    """
    return x if samples <= 0 else _smoothed(x, math.exp(-1.0 / samples))  # type: ignore[no-any-return]
