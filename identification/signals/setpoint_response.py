"""The part of the error that the set point explains."""

from __future__ import annotations

import numpy as np

from identification.signals.spectrum import Complex

SMOOTHING = 0.1
"""Half width of the band over which a frequency response is taken as constant, as a share of its frequency."""
FEWEST = 4
"""Fewest lines on each side over which it is averaged."""
SMALLEST = 1e-200
"""Power of a set point that stands still but for rounding."""


def _running(x: Complex, first: np.ndarray, last: np.ndarray) -> Complex:
    total = np.concatenate(([0.0], np.cumsum(x)))
    return total[last + 1] - total[first]


def without_setpoint(error: Complex, sp: Complex) -> Complex:
    """Lines of the error less the response to the set point.

    The response is the ratio of cross to auto spectrum over a band that widens with frequency, so steps, square
    waves and the set point of a cascade's inner loop are taken out whole and little else is.

    Parameters
    ----------
    error, sp : ndarray of complex, shape (m,)
        Lines of both signals.
    """
    k = np.arange(error.size)
    half = np.maximum((SMOOTHING * k).astype(np.int64), FEWEST)
    first, last = np.maximum(k - half, 0), np.minimum(k + half, error.size - 1)
    auto = _running((sp.real**2 + sp.imag**2).astype(np.complex128), first, last).real
    cross = _running(error * sp.conj(), first, last)
    floor = 1e-9 * max(float(auto.max(initial=0.0)), SMALLEST)
    return error - np.divide(cross, auto, out=np.zeros_like(cross), where=auto > floor) * sp
