"""The ways in which a controller may see error and slope, beside its settings: products of a recording's increments.

Of what no list states (a filter of PV, one of the slope, what gain and derivative take of the set point's moves,
one sample between PV's stamp and OP's, a gap, a squared error) every law takes what suits it best, a stated one too.
Where OP stands at an end of its own, or moves as fast as it ever does time and again, no law is seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numba import njit

from identification.controller.pid_regression import (
    best_gains,
    blurred,
    clamped,
    explained,
    increments,
    out_of_law,
    rows_of,
    weights_of,
)
from identification.limits import LAW
from identification.models import ErrorForm, Pid
from identification.record import Floats, LoopRecord, Mask
from identification.simulation.lag import first_order
from identification.simulation.pi import Law, acting_error

ON_ERROR = ((1.0, 1.0), (1.0, 0.0), (0.0, 0.0))
"""What gain and derivative take of the set point's moves: the usual three [-]."""
LATE = ((0, 0), (1, 0), (1, 1))
"""By how many samples OP's stamps may be later than those of PV and of SP."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
Shape = tuple[float, float, bool]
"""Gap [% PV], gain inside it [-], and whether the error is squared."""
STRAIGHT: Shape = (0.0, 0.0, False)


@dataclass(frozen=True, slots=True)
class Way:
    """What a law has beside its gains: the shape of the error, a filter of PV [samples], and what the gain takes of
    the set point's moves [-], None where that is not known."""

    shape: Shape = STRAIGHT
    pv_filter: float = 0.0
    sp_weight: float | None = 1.0


@dataclass(frozen=True, slots=True)
class Seen:
    """A record as one way of the law's sees it: products of increments by their length in samples, what each weighs,
    the freest law, and what beside gains the way has."""

    moves: dict[int, Floats]
    weight: Floats
    free: Floats
    way: Way

    def is_law(self, gains: Floats) -> bool:
        """Whether the freest law may be a controller's beside stated gains: without the set point's moves, one of the
        other sign is how PV answers OP."""
        return self.way.sp_weight == 1.0 or bool(self.free[0] * gains[0] >= 0.0)

    def left(self, gains: Floats) -> Floats:
        """Share of OP's variance that gains leave at each length of increments [-]."""
        return np.array([1.0 - explained(m, gains) for m in self.moves.values()])

    def left_over_all(self, gains: Floats) -> float:
        """The same, of all of them by their weights [-]."""
        moved = self.weight * np.array([m[3, 3] for m in self.moves.values()])
        return float(moved @ self.left(gains) / moved.sum())

    def poorness(self, gains: Floats) -> float:
        """How poorly gains give OP: mean logarithm of what they leave, alike in all ways of the law."""
        return float(np.mean(np.log(LAW.small + self.left(gains))))

    def does(self, gains: Floats) -> bool:
        """Whether gains give OP about as well as any, and that well."""
        left, least = self.left(gains), self.left(self.free)
        unsure = np.array([blurred(m, gains) for m in self.moves.values()])
        return bool((left - unsure <= LAW.enough * least + LAW.small).all() and least.min() < LAW.gives)


def gains_of(c: Pid) -> Floats:
    """Gains of error, integral and slope, shape (3,)."""
    return np.array([c.kp, c.ki, c.kp * c.td_s])


def fastest(op: Floats) -> Mask:
    """True where OP moves as fast as it ever does, and does so far oftener than a little slower, shape (n,): a limit
    of its rate. The samples beside are with it, for a limit may act between two of them."""
    size = np.abs(np.diff(op, prepend=op[0]))
    top = float(size.max())
    at = size >= LAW.at_rate * top
    nearly = np.count_nonzero((size >= LAW.near_rate * top) & ~at)
    coarse = top < LAW.rate_steps * float(np.min(size, where=size > 0.0, initial=np.inf))
    limited = not coarse and np.count_nonzero(at) > LAW.clamped * (nearly + LAW.end_samples)
    return _spread(at) if limited else np.zeros(op.size, dtype=bool)


def _spread(x: Mask) -> Mask:
    """The samples and those beside them."""
    return np.convolve(x, np.ones(3), mode="same") > 0


def no_law(record: LoopRecord, stated: Pid) -> Mask:
    """True where OP is not seen to follow a law: out of use, at a limit of its own, a stated one or of its rate."""
    ends = (record.op <= stated.op_lo) | (record.op >= stated.op_hi)
    limited = clamped(record.op) | ends
    between = stated.scan_s < record.dt_s
    return out_of_law(record) | (_spread(limited) if between else limited) | fastest(record.op)


@njit(cache=True)
def _acting(error: Floats, law: Law) -> Floats:
    out = np.empty_like(error)
    for k in range(error.size):
        out[k] = acting_error(error[k], law)
    return out


def shaped(error: Floats, shape: Shape) -> Floats:
    """What of an error [% PV], shape (n,), a law acts on."""
    gap, inside, squared = shape
    return (
        error
        if shape == STRAIGHT
        else _acting(error, Law(1.0, 0.0, gap=gap, gap_gain=inside, squared=squared))
    )


def shape_of(c: Pid) -> Shape:
    """The shape of a controller's error."""
    return c.gap, c.gap_gain, c.error_form is ErrorForm.SQUARED


def with_shape(c: Pid, shape: Shape) -> Pid:
    """A controller whose error has that shape."""
    return replace(
        c, gap=shape[0], gap_gain=shape[1], error_form=ErrorForm.SQUARED if shape[2] else ErrorForm.LINEAR
    )


@dataclass(frozen=True, slots=True)
class Look:
    """A recording ready to be looked at: where it follows no law, and lengths of increments [samples]."""

    record: LoopRecord
    out: Mask
    lengths: tuple[int, ...]

    def seen(self, rows: Floats, way: Way) -> Seen | None:
        """One way of it; None where no length tells a law."""
        every = len(self.record) // LAW.most_increments
        of = {k: increments(rows, self.out, k, max(k // 8, every, 1), True) for k in self.lengths}
        found = {k: m for k, m in of.items() if m is not None}
        weight = weights_of(found.values())
        if not weight.any():
            return None
        free = best_gains(found.values(), weight, np.eye(3), np.zeros(3))
        if (
            free[2] * free[0] < 0.0
        ):  # no controller has such a derivative: it mends a filter that is not the true one
            free = best_gains(found.values(), weight, np.eye(3)[:2], np.zeros(3))
        return Seen(found, weight, free, way)

    def plainly(self, shape: Shape) -> Seen | None:
        """The plainest way, of an error of that shape."""
        return self.seen(rows_of(self.record, shaped(self.record.error, shape)), Way(shape))


def look(record: LoopRecord, scale_s: float, stated: Pid) -> Look:
    """A recording of a loop that moves on a time scale [s]."""
    n, ti = len(record), stated.ti_s if stated.ki else 0.0
    reach = min(n / 20, max(LAW.reach * max(ti, scale_s) / record.dt_s, LAW.least_reach))
    lengths = tuple(LAW.longer**k for k in range(12) if LAW.longer**k <= reach)
    return Look(record, no_law(record, stated), lengths)


def slope_filters(dt_s: float, laws: Iterable[Pid]) -> tuple[float, ...]:
    """Time constants of the slope's filter [samples]: usual parts of the laws' derivative times, then others."""
    parts = {n * dt_s / c.td_s for c in laws if c.td_s > 0 for n in LAW.filter_parts}
    return (*(float(1.0 / np.log1p(part)) for part in sorted(parts)), *LAW.slope_filters)


def usual_ways(x: Look, shape: Shape, *laws: Pid, smoothing: bool = True) -> Iterator[Seen]:
    """The usual ways of laws on an error of that shape, the plainest first; smoothing : behind
    filters of PV, too."""
    record, narrow = x.record, slope_filters(x.record.dt_s, laws)
    moves = float(np.ptp(record.sp)) > 0 and not record.sp_estimated
    stated = sorted({c.pv_filter_s / record.dt_s for c in laws} - {0.0})
    filters = [*stated, *LAW.pv_filters] if smoothing else [0.0]
    for smooth, (late_pv, late_sp) in product(filters, LATE if moves else LATE[:2]):
        pv, sp = delayed(first_order(record.pv, smooth), late_pv), delayed(record.sp, late_sp)
        for rows, weight in _slopes(record, sp, pv, narrow, moves, shape):
            found = x.seen(rows, Way(shape, smooth, weight))
            if found is not None:
                yield found


def delayed(x: Floats, samples: int) -> Floats:
    """A signal so many samples later, shape (n,)."""
    return np.concatenate((np.repeat(x[:1], samples), x[: x.size - samples]))


def _slopes(
    record: LoopRecord, sp: Floats, pv: Floats, narrow: Iterable[float], moves: bool, shape: Shape
) -> Iterator[tuple[Floats, float | None]]:
    """Rows of every slope filter and every weight of the set point, and that weight; None with the rows in which what
    goes with the set point's moves is left out."""
    for (on_gain, on_slope), filtered in product(ON_ERROR if moves else ON_ERROR[:1], narrow):
        slope = np.diff(on_slope * sp - pv, prepend=on_slope * sp[0] - pv[0]) / record.dt_s
        rows = rows_of(record, shaped(sp - pv, shape), first_order(slope, filtered))
        rows[0] += (on_gain - 1.0) * sp
        yield rows, on_gain
    if moves:
        slope = np.diff(-pv, prepend=-pv[0]) / record.dt_s
        yield np.vstack((rows_of(record, shaped(sp - pv, shape), slope), sp)), None


def rough_ways(x: Look, shape: Shape) -> Iterator[Seen]:
    """Ways in which what PV does from sample to sample goes for nothing: between the samples a derivative, or a
    filter, saw another PV."""
    record, pv = x.record, x.record.pv
    beside = 0.5 * (np.concatenate((pv[:1], pv[:-1])) + np.concatenate((pv[1:], pv[-1:])))
    slope = np.gradient(-beside, record.dt_s)
    rows = [np.vstack((rows_of(record, shaped(record.error, shape), slope), pv - beside))]
    if float(np.ptp(record.sp)) > 0:
        rows.append(np.vstack((rows[0], record.sp)))
    for each, weight in zip(rows, (1.0, None), strict=False):
        found = x.seen(each, Way(shape, sp_weight=weight))
        if found is not None:
            yield found


def bent_shapes(x: Look, gains: Floats) -> Iterator[Shape]:
    """Shapes of the error, beside a straight one, that suit the record best: a squared one, and a gap as it suits the
    freest law, and these gains."""
    yield 0.0, 0.0, True
    size = float(np.median(np.abs(x.record.error[~x.out]))) if not x.out.all() else 0.0
    if size <= 0.0:
        return
    for inside, free in product(LAW.gap_gains, (True, False)):
        width = _best_gap(x, size, inside, None if free else gains)
        if width > 0.0:
            yield width, inside, False


def _best_gap(x: Look, size: float, inside: float, gains: Floats | None) -> float:
    """The gap with which gains, or the freest law, give OP best [% PV]; 0 where none does better than no gap."""

    def poor(width: float) -> float:
        seen = x.plainly((width, inside, False) if width > 0.0 else STRAIGHT)
        return np.inf if seen is None else seen.poorness(seen.free if gains is None else gains)

    tried = {w: poor(w) for w in (0.0, *(size * w for w in LAW.gaps))}
    best = min(tried, key=tried.__getitem__)
    if best == 0.0:
        return 0.0
    low, high = best / LAW.gaps_apart, best * LAW.gaps_apart
    while high - low > LAW.gap_within * best:
        a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        low, high = (low, b) if poor(a) < poor(b) else (a, high)
    return 0.5 * (low + high)


def recognized(x: Look, stated: Pid, way: Way) -> Pid:
    """A stated controller with what the record shows beside: what the way has in which it obeys the stated gains, and
    limits of OP and of its rate at which it is seen."""
    record, c = x.record, with_shape(stated, way.shape)
    if way.pv_filter >= LAW.seen_filter and not stated.pv_filter_s:
        c = replace(c, pv_filter_s=_best_filter(x, way, stated) * record.dt_s)
    if way.sp_weight == 0.0 and c.kp and c.scan_s >= record.dt_s:
        c = replace(c, sp_weight=0.0)
    if fastest(record.op).any():
        c = replace(c, op_rate=min(c.op_rate, float(np.abs(np.diff(record.op)).max()) / record.dt_s))
    at_end, middle = record.op[clamped(record.op)], 0.5 * float(record.op.min() + record.op.max())
    low, high = at_end[at_end < middle], at_end[at_end > middle]
    return replace(c, op_lo=float(max([c.op_lo, *low[:1]])), op_hi=float(min([c.op_hi, *high[:1]])))


def _best_filter(x: Look, way: Way, stated: Pid) -> float:
    """The filter of PV near that of a way with which the stated gains give OP best [samples]; the way's own beside a
    derivative, which has a filter too."""
    if stated.td_s:
        return way.pv_filter

    def poor(smooth: float) -> float:
        error = x.record.sp - first_order(x.record.pv, smooth)
        seen = x.seen(rows_of(x.record, shaped(error, way.shape)), way)
        return np.inf if seen is None else seen.poorness(gains_of(stated))

    return float(min(way.pv_filter * np.geomspace(0.5, 2.0, LAW.filters_near), key=poor))
