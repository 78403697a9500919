"""The part of the error explained by the set point."""

from __future__ import annotations

import numpy as np

from identification.record import Floats, Mask
from identification.signals.spectrum import Complex

SIDE_LINES = 4  # Fewest lines on each side of a frequency at which two signals are compared [lines]
RESPONSE_BAND = 0.1
"""Half width of the band over which the response to the set point is taken as constant, as a share of its
frequency."""
DIES = 2.0  # Periods after a move of the set point in which its response decays

SMALLEST = 1e-200
"""Power of a set point that is constant except for rounding."""


def _running(x: Complex, first: np.ndarray, last: np.ndarray) -> Complex:
    total = np.concatenate(([0.0], np.cumsum(x)))
    return total[last + 1] - total[first]


def without_setpoint(error: Complex, sp: Complex) -> Complex:
    """Lines of the error less the response to the set point.

    The response is the ratio of cross to auto spectrum over a band that widens with frequency, so steps, square waves
    and the set point of a cascade's inner loop are removed completely and little else is.

    error, sp : complex, shape (m,), lines of both signals.
    """
    k = np.arange(error.size)
    half = np.maximum((RESPONSE_BAND * k).astype(np.int64), SIDE_LINES)
    first, last = np.maximum(k - half, 0), np.minimum(k + half, error.size - 1)
    auto = _running((sp.real**2 + sp.imag**2).astype(np.complex128), first, last).real
    cross = _running(error * sp.conj(), first, last)
    floor = 1e-9 * max(float(auto.max(initial=0.0)), SMALLEST)
    return error - np.divide(cross, auto, out=np.zeros_like(cross), where=auto > floor) * sp


def moves(sp: Floats) -> Mask:
    """True at each sample at which the set point differs from the one before, shape (n,)."""
    return np.abs(np.diff(sp, prepend=sp[0])) > 1e-9 * max(float(np.ptp(sp)), SMALLEST)


def at_rest(sp: Floats, period: float, after: bool = False) -> Mask:
    """True where the set point has not moved for two periods, shape (n,); after: and does not within the next two.

    period : [samples].
    """
    length, k = round(DIES * max(round(period), 4)), np.arange(sp.size)
    moved = np.concatenate(([0], np.cumsum(moves(sp))))
    last = np.minimum(k + 1 + length * after, sp.size)
    return np.asarray(moved[last] == moved[np.maximum(k + 1 - length, 0)])


def amplitude_at_rest(error: Floats, sp: Floats, usable: Mask, period: float) -> tuple[float, int]:
    """Amplitude of a period while the set point has long been constant, and the number of stretches used.

    A sine with a straight line is fitted to each stretch of one period, half of one apart, in which every sample is
    usable and whose set point has not moved for two periods before its end.

    error, sp : shape (n,); usable : bool, shape (n,); period : [samples]. Returns amplitude : root mean square of the
    stretches' amplitudes, in the unit of the error; 0 without a stretch.
    """
    n = max(round(period), 4)
    out = np.concatenate(([0], np.cumsum(~(at_rest(sp, period) & usable))))
    first = np.arange(0, sp.size - n + 1, max(n // 2, 1))
    first = first[out[first + n] == out[first]]
    if not first.size:
        return 0.0, 0
    t = np.arange(n)
    basis = np.column_stack((np.ones(n), t, np.cos(2 * np.pi * t / period), np.sin(2 * np.pi * t / period)))
    found = np.linalg.lstsq(basis, error[first + t[:, None]], rcond=None)[0][2:]
    return float(np.sqrt(np.mean(np.sum(found**2, axis=0)))), int(first.size)
