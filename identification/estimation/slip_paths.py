"""The most probable path of a stem whose slips come a little early or late, told from OP and from what PV shows.

Run open, one constant friction loses its place with the first slip that comes a sample sooner than the one before,
and its likelihood with it. Here the distance at which the stem lets go is drawn anew for each slip, and several
paths are carried side by side, each scored by its innovations and by how likely its slips are; the poorer ones are
dropped (a beam search over a hidden state, as in multiple-hypothesis tracking: Reid 1979).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identification.record import Floats, Mask

Indices = NDArray[np.int64]
SCATTER = 0.05
"""Standard deviation of the distance at which a stem lets go, in that distance; ours, the one
value tried: on six simulated stems of dry friction OP, which comes in samples, goes 2 to 5 % beyond it (median)."""
PLACES = 13
"""Places of the stem that a path may begin at, across what it may be behind OP; ours."""
FAR = 3.5
"""Standard deviations below the mean distance from which a slip is thought of at all; ours: about RARE."""
RARE = 1e-4
"""Chance of a slip under which no path is begun for it; ours: 9 nat, what an outlier costs."""
STUCK = 100.0
"""Log probability that a stem costs which rests for longer than is asked; ours: on simulated stems parking for good
cost less than the wrong dead time did at first, and cost three of six their slips."""
SAME = 0.01
"""Distance of two stems, in the mean distance at which they let go, under which their paths are one; ours."""
LOOKED = 8
"""Blocks after which paths are compared, if they do not become too many before; ours: bounds the time."""
MOST_EVENTS = 60_000
"""Slips of all paths that are remembered; beyond it no path divides any more; ours: 8,400 were seen."""


class Response(NamedTuple):
    """How PV follows the stem: the lag's pole and weights, the delay [samples], gain, and PV's slow terms, shape
    (blocks,)."""

    pole: float
    now: float
    before: float
    delay: int
    gain: float
    slow: Floats


class Noise(NamedTuple):
    """Noise model of single lags, of blocks, shape (order,), and the variance of its innovations [% PV squared]."""

    ar: Floats
    sigma2: float


class Friction(NamedTuple):
    """Mean distances |OP - stem| at which a stem lets go and comes to rest [% OP], and its longest rest [samples]."""

    breakaway: float
    sliding: float
    rest: int


class _Beam(NamedTuple):
    """Paths side by side, a row each: stem, farthest distance below and above since its last slip, response, its sum
    over the block, score, last stems, last residuals, last event, sample of the last slip."""

    stem: Floats
    farthest: Floats
    x: Floats
    total: Floats
    score: Floats
    ring: Floats
    past: Floats
    event: Indices
    rested: Indices


@njit(cache=True)
def _normal(x: float) -> float:
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


@njit(cache=True)
def slip_chance(distance: float, farthest: float, breakaway: float) -> float:
    """Chance that a stem lets go between the farthest distance that it has borne and a farther one."""
    scatter = SCATTER * breakaway
    borne = _normal((farthest - breakaway) / scatter)
    return min((_normal((distance - breakaway) / scatter) - borne) / max(1.0 - borne, 1e-12), 1.0)


@njit(cache=True)
def _copy(into: _Beam, to: int, b: _Beam, source: int) -> None:
    """A path of one beam as one of another, or of the same."""
    into.stem[to], into.x[to], into.total[to] = b.stem[source], b.x[source], b.total[source]
    into.score[to], into.event[to], into.rested[to] = b.score[source], b.event[source], b.rested[source]
    into.farthest[to], into.ring[to], into.past[to] = b.farthest[source], b.ring[source], b.past[source]


@njit(cache=True)
def _best(b: _Beam, other: _Beam, count: int, most: int, near: float) -> int:
    """The best paths of `b` in `other`, of two at the same place the better; how many they are."""
    kept = 0
    for at in np.argsort(-b.score[:count]):
        same = False
        for k in range(kept):
            if abs(other.stem[k] - b.stem[at]) < near and abs(other.x[k] - b.x[at]) < 2.0 * near:
                same = True
                break
        if not same:
            _copy(other, kept, b, at)
            kept += 1
        if kept == most:
            break
    return kept


@njit(cache=True)
def _room(rows: int, delay: int, order: int) -> _Beam:
    return _Beam(
        np.zeros(rows),
        np.zeros((rows, 2)),
        np.zeros(rows),
        np.zeros(rows),
        np.zeros(rows),
        np.zeros((rows, delay + 2)),
        np.zeros((rows, order)),
        np.zeros(rows, np.int64),
        np.zeros(rows, np.int64),
    )


@njit(cache=True)
def _begun(b: _Beam, op: Floats, first: float, breakaway: float) -> int:
    """Paths from places of the stem from which it will have to slip; how many they are."""
    early = op[: max(op.size // 3, 1)]
    high, low, count = early.max(), early.min(), 0
    for k in range(PLACES):
        stem = op[0] + breakaway * (2.0 * k / (PLACES - 1) - 1.0)
        if max(high - stem, stem - low) < breakaway and k % (PLACES - 1) > 0:
            continue
        b.stem[count], b.x[count] = stem, first
        b.ring[count, :] = stem
        b.event[count] = count
        count += 1
    return count


class _Events(NamedTuple):
    """Slips of all paths, shape (MOST_EVENTS,): the slip before on the same path, sample, and stem after it."""

    parent: Indices
    moment: Indices
    place: Floats


@njit(cache=True)
def _divided(
    b: _Beam, events: _Events, known: tuple[int, int], k: int, op: float, f: Friction
) -> tuple[int, int]:
    """Each path as one that slips at a sample and one that does not, with the chance of either.

    `known` and what is returned: how many paths and events there are.
    """
    count, slips = known
    for h in range(count):
        if k - b.rested[h] > f.rest:
            b.score[h], b.rested[h] = b.score[h] - STUCK, k
        gap = op - b.stem[h]
        far, side = abs(gap), 1 if gap > 0 else 0
        if k == 0 or far <= b.farthest[h, side] or far <= f.breakaway * (1.0 - FAR * SCATTER):
            continue
        chance = slip_chance(far, b.farthest[h, side], f.breakaway)
        if chance > RARE and count < b.stem.size and slips < MOST_EVENTS:
            _copy(b, count, b, h)
            b.stem[count] = op - math.copysign(f.sliding, gap)
            b.farthest[count, :] = 0.0
            b.rested[count] = k
            b.score[count] += math.log(chance)
            events.parent[slips], events.moment[slips], events.place[slips] = b.event[h], k, b.stem[count]
            b.event[count] = slips
            slips, count = slips + 1, count + 1
        b.score[h] += math.log(max(1.0 - chance, 1e-12))
        b.farthest[h, side] = far
    return count, slips


@njit(cache=True)
def _answered(b: _Beam, count: int, k: int, r: Response) -> None:
    """PV's response of each path stepped on by one sample."""
    size = r.delay + 2
    at, now, before = k % size, (k - r.delay) % size, (k - r.delay - 1) % size
    for h in range(count):
        b.total[h] += b.x[h]
        b.ring[h, at] = b.stem[h]
        b.x[h] = r.pole * b.x[h] + r.now * b.ring[h, now] + r.before * b.ring[h, before]


@njit(cache=True)
def _judge(b: _Beam, count: int, left: float, counts: bool, factor: int, r: Response, n: Noise) -> None:
    """Score all paths by their innovation of a block, of which `left` is PV less its slow terms."""
    order = n.ar.size
    for h in range(count):
        residual = left - r.gain * b.total[h] / factor
        b.total[h] = 0.0
        if counts:
            e = residual
            for i in range(order):
                e -= n.ar[i] * b.past[h, i]
            b.score[h] -= 0.5 * e * e / n.sigma2
        for i in range(order - 1, 0, -1):
            b.past[h, i] = b.past[h, i - 1]
        b.past[h, 0] = residual


@njit(cache=True)
def _traced(events: _Events, event: int, n: int) -> Floats:
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

    Parameters
    ----------
    op : ndarray of shape (n * factor,)
    y : ndarray of shape (n,)
        PV less its mean, in blocks of `factor` samples.
    counts : ndarray of bool, shape (n,)
        Blocks whose innovations are judged.
    r : Response
    n : Noise
    f : Friction
    most : int
        Paths that are carried side by side.
    """
    factor, rows, near = op.size // y.size, 3 * most + PLACES, SAME * f.breakaway
    b, other = _room(rows, r.delay, n.ar.size), _room(rows, r.delay, n.ar.size)
    events = _Events(np.empty(MOST_EVENTS, np.int64), np.zeros(MOST_EVENTS, np.int64), np.empty(MOST_EVENTS))
    count = _begun(b, op, (y[0] - r.slow[0]) / r.gain, f.breakaway)
    events.parent[:count], events.place[:count] = -1, b.stem[:count]
    slips = count
    for k in range(factor * y.size):
        count, slips = _divided(b, events, (count, slips), k, op[k], f)
        _answered(b, count, k, r)
        block, ended = k // factor, (k + 1) % factor == 0
        if ended:
            _judge(b, count, y[block] - r.slow[block], counts[block], factor, r, n)
        if count > 2 * most or (ended and (block + 1) % LOOKED == 0):
            count = _best(b, other, count, most, near)
            b, other = other, b
    first = int(np.argmax(b.score[:count]))
    return _traced(events, b.event[first], op.size), float(b.score[first])


@njit(cache=True)
def log_chance(op: Floats, stem: Floats, breakaway: float) -> float:
    """Log probability of when a stem, shape of op, has slipped, given OP [nat]."""
    below, above, out = 0.0, 0.0, 0.0
    for k in range(1, op.size):
        gap = op[k] - stem[k - 1]
        far, farthest = abs(gap), above if gap > 0 else below
        if stem[k] != stem[k - 1]:
            out += math.log(max(slip_chance(far, farthest, breakaway), 1e-12))
            below, above = 0.0, 0.0
        elif far > farthest and far > breakaway * (1.0 - FAR * SCATTER):
            out += math.log(max(1.0 - slip_chance(far, farthest, breakaway), 1e-12))
            below, above = (below, far) if gap > 0 else (far, above)
    return out
