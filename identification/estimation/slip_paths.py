"""The most probable path of a stem whose slips come a little early or late, told from OP and from what PV shows.

Run open, one constant friction loses its place with the first slip that comes a sample sooner than the one before,
and its likelihood with it. Here the distance at which the stem lets go is drawn anew for each slip, and several
paths are carried side by side, each scored by its innovations and by how likely its slips are; the poorer ones are
dropped (a beam search over a hidden state, as in multiple-hypothesis tracking: Reid 1979).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from identification.estimation.slip_beam import (
    EVENT,
    LATE,
    MOST_EVENTS,
    SCORE,
    STEM,
    Beam,
    Block,
    Events,
    Friction,
    Noise,
    Response,
    X,
    best_paths,
    divided,
    judge_block,
    room,
    shares_of,
)
from identification.record import Floats, Mask

PLACES = 13
"""Places of the stem that a path may begin at, across what it may be behind OP; ours."""
SAME = 0.01
"""Distance of two stems, in the mean distance at which they let go, under which their paths are one; ours."""
LOOKED = 8
"""Blocks after which paths are compared, if they do not become too many before; ours: bounds the time."""


@njit(cache=True)
def _begun(b: Beam, op: Floats, first: float, breakaway: float) -> int:
    """Paths from places of the stem from which it will have to slip; how many they are."""
    early = op[: max(op.size // 3, 1)]
    high, low, count = early.max(), early.min(), 0
    for k in range(PLACES):
        stem = op[0] + breakaway * (2.0 * k / (PLACES - 1) - 1.0)
        if max(high - stem, stem - low) < breakaway and k % (PLACES - 1) > 0:
            continue
        b.numbers[count, STEM] = b.numbers[count, LATE] = stem
        b.numbers[count, X] = first
        b.marks[count, EVENT] = count
        count += 1
    return count


@njit(cache=True)
def _traced(events: Events, event: int, n: int) -> Floats:
    """The stem of the path that ends with an event, shape (n,)."""
    stem, last = np.empty(n), n
    while event >= 0:
        stem[events.moment[event] : last] = events.place[event]
        last, event = events.moment[event], events.parent[event]
    return stem


@njit(cache=True)
def decoded(
    op: Floats, y: Floats, counts: Mask, r: Response, n: Noise, f: Friction, most: int
) -> tuple[Floats, float]:
    """The stem [% OP], shape of op, of the most probable path, and its log probability.

    op : shape (n * factor,); y : shape (n,), PV less its mean, in blocks of `factor` samples; counts : bool, shape
    (n,), blocks whose innovations are judged; most : paths that are carried side by side.
    """
    factor, near = op.size // y.size, SAME * f.breakaway
    rows = 6 * most + PLACES
    b, other = room(rows, n.ar.size), room(rows, n.ar.size)
    events = Events(np.empty(MOST_EVENTS, np.int64), np.zeros(MOST_EVENTS, np.int64), np.empty(MOST_EVENTS))
    count = _begun(b, op, (y[0] - r.slow[0]) / r.gain, f.breakaway)
    events.parent[:count], events.place[:count] = -1, b.numbers[:count, STEM]
    slips, shares = count, shares_of(r, factor)
    for block in range(y.size):
        first, last = block * factor, (block + 1) * factor
        low, high = op[first], op[first]
        for u in op[first:last]:
            low, high = min(low, u), max(high, u)
        at = Block(first, last, low, high, *shares)
        count, slips = divided(b, events, (count, slips), at, op, f, r)
        judge_block(b, count, y[block] - r.slow[block], block, factor, r, n, counts[block])
        if count > 2 * most or (block + 1) % LOOKED == 0:
            count = best_paths(b, other, count, most, near)
            b, other = other, b
    best = int(np.argmax(b.numbers[:count, SCORE]))
    return _traced(events, b.marks[best, EVENT], op.size), float(b.numbers[best, SCORE])
