"""Isolated single values, unrelated to the values before and after."""

from __future__ import annotations

import numpy as np

from identification.record import Floats, Mask


def isolated_values(x: Floats, usable: Mask, factor: float, least: float) -> Mask:
    """True where a single value differs from both neighbours, in one direction, by so many usual changes and by a
    share `least` of the range of all others, while the neighbours are near each other; shape (n,)."""
    out = np.zeros(x.size, dtype=bool)
    if x.size < 5:
        return out
    rise = np.diff(x)
    usual = float(np.quantile(np.abs(rise), 0.75))
    low, high = np.quantile(x[usable] if usable.any() else x, [0.005, 0.995])
    there, back = rise[:-1], -rise[1:]
    away = np.minimum(np.abs(there), np.abs(back))
    across = np.abs(x[2:] - x[:-2])
    far = away > max(factor * usual, least * float(high - low))
    out[1:-1] = far & (there * back > 0.0) & (across < 0.1 * away) & usable[1:-1]
    return out


def without_lone(x: Floats, lone: Mask) -> Floats:
    """The signal with each such value replaced by the one before, shape (n,)."""
    at = np.maximum.accumulate(np.where(lone, 0, np.arange(x.size)))
    return x[at]
