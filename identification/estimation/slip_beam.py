"""Beam search over stem paths: slip probability, and paths advanced by blocks, split and scored."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identification.record import Floats, Mask
from identification.simulation.lag import Lag, stepped

SCATTER = 0.05
"""Standard deviation of the distance at which a stem lets go, in that distance [of the distance]: the one
value tried: on six simulated stems of dry friction OP, which comes in samples, goes 2 to 5 % beyond it
(median)."""
FAR = 3.5
"""Standard deviations below the mean distance from which a slip is possible [deviations]: about rare."""
RARE = 1e-4  # Probability of a slip under which no path is begun for it: 9 nat, what an outlier costs
STUCK = 100.0
"""Log-probability penalty for a stem at rest for longer than required [nat]. Without it, a simulated stem
that always rests cost less than a wrong dead time at first. Three of six stems then had no slips."""
WAITING = 12
"""Largest number of a path's slips without a response of PV yet: a dead time of six cycles is no dead
time."""
MOST_EVENTS = 60_000  # Stored slips of all paths; beyond it no path divides: 8,400 were seen
PLACES = 13  # Places of the stem that a path may begin at, across what it may be behind OP
SAME = 0.01
"""Distance of two stems, in the mean distance at which they let go, under which their paths are one [of the
distance]."""
LOOKED = 8
"""Blocks after which paths are compared, if they do not become too many before [blocks]: bounds the time."""


class Response(NamedTuple):
    """Response of PV to the stem: its lag, the gain, and PV's slow terms, shape (blocks,)."""

    lag: Lag
    gain: float
    slow: Floats


class Noise(NamedTuple):
    """Noise model of single lags of blocks, shape (order,), and the innovations variance [% PV squared]."""

    ar: Floats
    sigma2: float


class SlipDistances(NamedTuple):
    """Mean distances |OP - stem| at start and end of a slip [% OP], and the longest rest [samples]."""

    breakaway: float
    sliding: float
    rest: int


@njit(cache=True)
def _normal(x: float) -> float:
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


@njit(cache=True)
def slip_chance(distance: float, farthest: float, breakaway: float) -> float:
    """Probability that a stem slips between the farthest distance so far without a slip and a farther one."""
    scatter = SCATTER * breakaway
    passed = _normal((farthest - breakaway) / scatter)
    return min((_normal((distance - breakaway) / scatter) - passed) / max(1.0 - passed, 1e-12), 1.0)


@njit(cache=True)
def log_chance(op: Floats, stem: Floats, breakaway: float) -> float:
    """Log probability of the slip times of a stem, shape of op, given OP [nat]."""
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


Indices = NDArray[np.int64]
STEM, X, TOTAL, SCORE, LATE, FAR_LOW, FAR_HIGH, PLACED = 0, 1, 2, 3, 4, 5, 6, 7
"""Columns of a path's numbers: stem, response, its sum over the block, score, stem that acts on PV now, farthest
distance below and above since the last slip; then stem positions still within the dead time, and residuals."""
EVENT, LAST_SLIP, NEXT_SAMPLE, PENDING, DUE = 0, 1, 2, 3, 4
"""Columns of a path's marks: last event, sample of the last slip, next sample, number of slips within the dead time;
then the samples at which they act on PV."""


class Beam(NamedTuple):
    """Parallel paths, one per row, in two arrays: each array passed to a function has a cost."""

    numbers: Floats
    marks: Indices


class SlipBlock(NamedTuple):
    """First sample of a block, the first one after it, and the extremes of OP in it. For a stem at rest at u: the
    remaining share of a response x, and the weights of x and of u in its sum over the block."""

    first: int
    last: int
    low: float
    high: float
    remaining: float
    of_x: float
    of_u: float


@njit(cache=True)
def copy_path(into: Beam, to: int, b: Beam, source: int) -> None:
    """Copy a path of one beam to another beam or to the same one."""
    for i in range(b.numbers.shape[1]):
        into.numbers[to, i] = b.numbers[source, i]
    for i in range(b.marks.shape[1]):
        into.marks[to, i] = b.marks[source, i]


@njit(cache=True)
def best_paths(b: Beam, other: Beam, count: int, most: int, near: float) -> int:
    """Write the best paths of `b` to `other`, the better of two at the same position; return their number."""
    kept = 0
    for at in np.argsort(-b.numbers[:count, SCORE]):
        same = False
        for k in range(kept):
            stem, x = other.numbers[k, STEM] - b.numbers[at, STEM], other.numbers[k, X] - b.numbers[at, X]
            if abs(stem) < near and abs(x) < 2.0 * near:
                same = True
                break
        if not same:
            copy_path(other, kept, b, at)
            kept += 1
        if kept == most:
            break
    return kept


@njit(cache=True)
def empty_beam(rows: int, order: int) -> Beam:
    return Beam(np.zeros((rows, PLACED + WAITING + order)), np.zeros((rows, DUE + WAITING), np.int64))


class Events(NamedTuple):
    """Slips of all paths, shape (MOST_EVENTS,): previous slip on the same path, sample, and stem after it."""

    parent: Indices
    moment: Indices
    place: Floats


@njit(cache=True, inline="always")
def _advance_response(own: Floats, marks: Indices, k: int, r: Response) -> None:
    """Advance a path's PV response by one sample."""
    own[TOTAL] += own[X]
    before = own[LATE]
    if marks[PENDING] > 0 and marks[DUE] <= k:
        own[LATE] = own[PLACED]
        marks[PENDING] -= 1
        for i in range(marks[PENDING]):
            marks[DUE + i], own[PLACED + i] = marks[DUE + i + 1], own[PLACED + i + 1]
    own[X] = stepped(own[X], r.lag, own[LATE], before)


@njit(cache=True)
def _add_slip(b: Beam, events: Events, at: tuple[int, int, int, int], place: float, r: Response) -> None:
    """Write path `at[0]` as `at[1]` with another stem position from sample `at[2]` on, recorded as event `at[3]`."""
    h, to, k, event = at
    copy_path(b, to, b, h)
    own, marks = b.numbers[to], b.marks[to]
    own[STEM], marks[LAST_SLIP] = place, k
    own[FAR_LOW] = own[FAR_HIGH] = 0.0
    own[PLACED + marks[PENDING]], marks[DUE + marks[PENDING]] = place, k + r.lag.delay
    marks[PENDING] += 1
    events.parent[event], events.moment[event], events.place[event] = marks[EVENT], k, place
    marks[EVENT] = event
    _advance_response(own, marks, k, r)
    marks[NEXT_SAMPLE] = k + 1


@njit(cache=True)
def shares_of(r: Response, factor: int) -> tuple[float, float, float]:
    """remaining, of_x and of_u of a block (`SlipBlock`)."""
    remaining, of_x = 1.0, 0.0
    for _ in range(factor):
        of_x += remaining
        remaining *= r.lag.pole
    return remaining, of_x, factor - of_x


@njit(cache=True, inline="always")
def _is_unchanged(numbers: Floats, marks: Indices, h: int, block: SlipBlock, f: SlipDistances) -> bool:
    """Whether a path is unchanged over a block: its stem does not slip, and no earlier slip starts to act on PV."""
    if marks[h, NEXT_SAMPLE] != block.first or block.first == 0:
        return False
    if block.last - 1 - marks[h, LAST_SLIP] > f.rest:
        return False
    if marks[h, PENDING] > 0 and marks[h, DUE] < block.last:
        return False
    stem, least = numbers[h, STEM], f.breakaway * (1.0 - FAR * SCATTER)
    above = block.high - stem <= max(numbers[h, FAR_HIGH], least)
    return above and stem - block.low <= max(numbers[h, FAR_LOW], least)


@njit(cache=True)
def _advance_path(
    b: Beam,
    events: Events,
    known: tuple[int, int],
    h: int,
    last: int,
    op: Floats,
    f: SlipDistances,
    r: Response,
) -> tuple[int, int]:
    """Advance a path through the samples before `last`, with a new path for each sufficiently probable slip.

    `known` and the return value: number of paths and events.
    """
    (count, slips), own, marks = known, b.numbers[h], b.marks[h]
    least = f.breakaway * (1.0 - FAR * SCATTER)
    for k in range(marks[NEXT_SAMPLE], last):
        if k - marks[LAST_SLIP] > f.rest:
            own[SCORE], marks[LAST_SLIP] = own[SCORE] - STUCK, k
        gap = op[k] - own[STEM]
        far, side = abs(gap), FAR_HIGH if gap > 0 else FAR_LOW
        if k > 0 and far > own[side] and far > least:
            chance = slip_chance(far, own[side], f.breakaway)
            room = count < b.marks.shape[0] and slips < MOST_EVENTS and marks[PENDING] < WAITING
            if chance > RARE and room:
                _add_slip(b, events, (h, count, k, slips), op[k] - math.copysign(f.sliding, gap), r)
                b.numbers[count, SCORE] += math.log(chance)
                count, slips = count + 1, slips + 1
            own[SCORE] += math.log(max(1.0 - chance, 1e-12))
            own[side] = far
        _advance_response(own, marks, k, r)
    marks[NEXT_SAMPLE] = last
    return count, slips


@njit(cache=True)
def advance_paths(
    b: Beam,
    events: Events,
    known: tuple[int, int],
    block: SlipBlock,
    op: Floats,
    f: SlipDistances,
    r: Response,
) -> tuple[int, int]:
    """Advance all paths through a block, including those that begin in it; return the number of paths and events."""
    (count, slips), numbers, marks = known, b.numbers, b.marks
    h = 0
    while h < count:
        if _is_unchanged(numbers, marks, h, block, f):
            x, u = numbers[h, X], numbers[h, LATE]
            numbers[h, TOTAL] = block.of_x * x + block.of_u * u
            numbers[h, X] = block.remaining * x + (1.0 - block.remaining) * u
            marks[h, NEXT_SAMPLE] = block.last
        else:
            count, slips = _advance_path(b, events, (count, slips), h, block.last, op, f, r)
        h += 1
    return count, slips


@njit(cache=True)
def judge_block(
    b: Beam, count: int, deviation: float, block: int, factor: int, r: Response, n: Noise, counts: bool
) -> None:
    """Score all paths by their innovation of a block, of which `deviation` is PV less its slow terms."""
    order, past = n.ar.size, PLACED + WAITING
    numbers, now = b.numbers, block % order
    for h in range(count):
        residual = deviation - r.gain * numbers[h, TOTAL] / factor
        numbers[h, TOTAL] = 0.0
        if counts:
            e = residual
            for i in range(order):
                e -= n.ar[i] * numbers[h, past + (now - 1 - i if now > i else now - 1 - i + order)]
            numbers[h, SCORE] -= 0.5 * e * e / n.sigma2
        numbers[h, past + now] = residual


@njit(cache=True)
def _initial_paths(b: Beam, op: Floats, first: float, breakaway: float) -> int:
    """Paths from stem positions from which the stem must slip; return their number."""
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
def _stem_of_path(events: Events, event: int, n: int) -> Floats:
    """The stem of the path that ends with an event, shape (n,)."""
    stem, last = np.empty(n), n
    while event >= 0:
        stem[events.moment[event] : last] = events.place[event]
        last, event = events.moment[event], events.parent[event]
    return stem


@njit(cache=True)
def decoded(
    op: Floats,
    y: Floats,
    counts: Mask,
    r: Response,
    n: Noise,
    f: SlipDistances,
    most: int,
    least: float = -math.inf,
) -> tuple[Floats, float]:
    """The stem [% OP], shape of op, of the most probable path, and its log probability.

    Scores only decrease: the search ends once all are below `least`, and the log probability is then -inf.

    op : shape (n * factor,); y : shape (n,), PV less its mean, in blocks of `factor` samples; counts : bool, shape
    (n,), blocks whose innovations are judged; most : number of parallel paths.
    """
    factor, near = op.size // y.size, SAME * f.breakaway
    rows = 6 * most + PLACES
    b, other = empty_beam(rows, n.ar.size), empty_beam(rows, n.ar.size)
    events = Events(np.empty(MOST_EVENTS, np.int64), np.zeros(MOST_EVENTS, np.int64), np.empty(MOST_EVENTS))
    count = _initial_paths(b, op, (y[0] - r.slow[0]) / r.gain, f.breakaway)
    events.parent[:count], events.place[:count] = -1, b.numbers[:count, STEM]
    slips, shares = count, shares_of(r, factor)
    for block in range(y.size):
        first, last = block * factor, (block + 1) * factor
        low, high = op[first], op[first]
        for u in op[first:last]:
            low, high = min(low, u), max(high, u)
        at = SlipBlock(first, last, low, high, *shares)
        count, slips = advance_paths(b, events, (count, slips), at, op, f, r)
        judge_block(b, count, y[block] - r.slow[block], block, factor, r, n, counts[block])
        if count > 2 * most or (block + 1) % LOOKED == 0:
            count = best_paths(b, other, count, most, near)
            b, other = other, b
            if b.numbers[0, SCORE] < least:
                return op[:0], -math.inf
    best = int(np.argmax(b.numbers[:count, SCORE]))
    return _stem_of_path(events, b.marks[best, EVENT], op.size), float(b.numbers[best, SCORE])
