"""Stretches of a recording that are worth drawing."""

from __future__ import annotations

import numpy as np

from identification.controller.check import runs
from identification.record import Floats, Mask

WINDOW = 240
"""Samples of a stretch that is drawn; ours: single samples can still be seen."""
MOST_WINDOW = 1500
"""Samples of a stretch at most."""


def busiest(x: Floats, length: int, usable: Mask | None = None) -> slice:
    """The stretch of that many samples in which a signal travels most, samples not usable left out of account."""
    length = min(length, x.size)
    travel = np.abs(np.diff(x, prepend=x[0]))
    if usable is not None:
        travel = np.where(usable, travel, 0.0)
    total = np.concatenate(([0.0], np.cumsum(travel)))
    first = int(np.argmax(total[length:] - total[:-length]))
    return slice(first, first + length)


def biggest_move(x: Floats, length: int, usable: Mask) -> slice:
    """A stretch of that many samples about a signal's biggest move, a third of it before."""
    size = np.where(usable, np.abs(np.diff(x, prepend=x[0])), 0.0)
    length = min(length, x.size)
    first = min(max(int(np.argmax(size)) - length // 3, 0), x.size - length)
    return slice(first, first + length)


def around(where: Mask, length: int) -> slice:
    """A stretch about the longest run of a mask."""
    found = runs(where)
    if not found:
        return slice(0, min(length, where.size))
    first, last = max(found, key=lambda r: r[1] - r[0])
    length = min(max(length, 2 * (last - first)), MOST_WINDOW, where.size)
    start = min(max((first + last - length) // 2, 0), where.size - length)
    return slice(start, start + length)
