"""Filters over whole trends: a band of periods, removal of straight lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from identification.record import Floats


def in_band(x: Floats, shortest: float, longest: float) -> Floats:
    """The signal, shape (n,), within a band of periods [samples], by a second-order Butterworth filter in both
    directions, without delay; all periods shorter than `longest` if the shortest is about two samples."""
    fast = 2.0 / shortest if shortest > 2.0 else 1.0
    slow = min(2.0 / longest, 0.9 * fast)
    cut, kind = (slow, "highpass") if fast >= 0.95 else ([slow, fast], "bandpass")
    return np.asarray(sosfiltfilt(butter(2, cut, kind, output="sos"), x - x.mean()), dtype=np.float64)


def stretch_ends(n: int, window: int) -> NDArray[np.int64]:
    """First sample of each of n // window stretches of nearly the same length, and the end of the last."""
    parts = max(n // max(window, 1), 1)
    k = np.arange(parts + 1)
    return k * (n // parts) + np.minimum(k, n % parts)


def without_lines(x: Floats, window: int) -> Floats:
    """x, shape (n,), less the best straight line of each stretch; x where window is 0 or longer than it."""
    n = x.size
    if window <= 0 or window >= n:
        return x
    ends = stretch_ends(n, window)
    length = np.diff(ends)
    time = np.arange(n) - np.repeat(ends[:-1] + 0.5 * (length - 1), length)
    mean = np.add.reduceat(x, ends[:-1]) / length
    slope = np.add.reduceat(x * time, ends[:-1]) / np.maximum(np.add.reduceat(time**2, ends[:-1]), 0.5)
    return x - np.repeat(mean, length) - np.repeat(slope, length) * time
