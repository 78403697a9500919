"""Straight lines taken out of stretches of a trend."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.record import Floats


def stretch_ends(n: int, window: int) -> NDArray[np.int64]:
    """First sample of each of n // window stretches of nearly the same length, and the end of the last."""
    parts = max(n // max(window, 1), 1)
    length = np.full(parts, n // parts)
    length[: n % parts] += 1
    return np.concatenate(([0], np.cumsum(length)))


def without_lines(x: Floats, window: int) -> Floats:
    """x, shape (n,), less the straight line that suits each stretch best; x where window is 0 or longer than it."""
    n = x.size
    if window <= 0 or window >= n:
        return x
    ends = stretch_ends(n, window)
    length = np.diff(ends)
    time = np.arange(n) - np.repeat(ends[:-1] + 0.5 * (length - 1), length)
    mean = np.add.reduceat(x, ends[:-1]) / length
    slope = np.add.reduceat(x * time, ends[:-1]) / np.maximum(np.add.reduceat(time**2, ends[:-1]), 0.5)
    return x - np.repeat(mean, length) - np.repeat(slope, length) * time
