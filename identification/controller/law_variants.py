"""Variants of a controller's error and slope, with any settings, as products of a recording's increments.

Properties that no list states (a filter of PV, one of the slope, set point weights of gain and derivative, one sample
between PV's stamp and OP's, a gap, a squared error) are chosen best for every law, also for a stated one. Where OP is
at its own limit, or repeatedly moves at its highest rate, no law is visible.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numba import njit

from identification.controller.pid_regression import (
    CLAMPED,
    END_SAMPLES,
    SMALL,
    best_gains,
    blurred,
    clamped,
    explained,
    increments,
    out_of_law,
    rows_of,
    weights_of,
)
from identification.models import ErrorForm, Pid
from identification.record import Floats, LoopRecord, Mask
from identification.simulation.lag import first_order
from identification.simulation.pi import Law, acting_error

REACH = 4
"""Longest increments, in integral times: beyond it the integral gathers PV's rounding rather than errors."""
ENOUGH = 1.25
"""Largest ratio of the residual of a stated law to that of the freest law, if that reproduces OP, to be in
force without a further test."""
GIVES = 0.1  # Largest residual of the freest law, at its best length, if it reproduces OP
PV_FILTERS = (0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0)
"""Filters of PV before the controller that are tried [samples]: none is far from one of them."""
SLOPE_FILTERS = (0.0, 2.0, 8.0)  # Filters of the slope that are tried [samples]
SEEN_FILTER = 2.0
"""Filter of PV from which it is recognized [samples]: a shorter one may be a matter of stamps."""
PLAIN_WEIGHT = 0.9  # Set point weight from which it is taken as 1: a gain is known within 10 %
FILTERS_NEAR = 13
"""Filters of PV tried between half and twice a suitable one, to estimate its time constant: 12 % from one to
the next."""
FILTER_PARTS = (4.0, 6.0, 8.0, 10.0, 16.0)
"""N of the derivative filters tried with a derivative time Td, with time constants Td/N: systems have 4 to
20."""
PLAINLY_BETTER = 0.7
"""Log reduction of OP's residual from which another form of the law is reported instead of the stated one.
For 18 correctly stated laws the log residual of the wrong form was higher by 0.8 to 6.0
(proofs/controllers.py)."""
LONGER = 4  # Times that a length of increments is longer than the one before
LEAST_REACH = 256
"""Least value of the longest increments, independently of the stated integral time [samples]: what is stated
may be wrong."""
MOST_INCREMENTS = 40000
"""Increments of one length at most, evenly over the record: a gain is then known to a few thousandths, and
three days at 1 s take no longer than a night."""
AT_RATE = 0.99  # Share of OP's fastest move from which a move counts as one at a limit of its rate: rounding
RATE_STEPS = 20.0
"""OP's fastest move over its smallest, from which it may be a limit of its rate: an OP that moves by few of
its steps has a fastest move that is not rare."""
NEAR_RATE = 0.9  # Share of OP's fastest move from which further moves are examined
GAPS = (0.1, 0.25, 0.5, 1.0, 1.5, 2.2, 3.3, 5.0, 8.0)  # Initial gaps of the search [medians of the error]
GAPS_APART = 2.0
"""Factor about the best of these gaps within which a better one is searched for; it reaches beyond the
next of them."""
GAP_WITHIN = 0.05  # Relative precision of a gap
GAP_GAINS = (0.0, 0.3)  # Gains inside a gap that are tried, over the gain outside: none, and a reduced one

ON_ERROR = ((1.0, 1.0), (1.0, 0.0), (0.0, 0.0))
"""Set point weights of gain and derivative: the usual three [-]."""
LATE = ((0, 0), (1, 0), (1, 1))
"""Candidate delays of OP's stamps relative to those of PV and of SP [samples]."""
PILED_UP = 8.0
"""Density of OP's moves at their highest rate over that just below, from which the rate is a limit; of a sine 4.1."""
WITH_SP = 10
"""Samples after a move of SP in which its gain moves OP; ours: scans are up to ten samples apart."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
Shape = tuple[float, float, bool]
"""Gap [% PV], gain inside it [-], and whether the error is squared."""
STRAIGHT: Shape = (0.0, 0.0, False)


@dataclass(frozen=True, slots=True)
class LawVariant:
    """Properties of a law other than its gains: the error shape, a filter of PV [samples], and the set point weight
    of the gain [-], None if unknown."""

    shape: Shape = STRAIGHT
    pv_filter: float = 0.0
    sp_weight: float | None = 1.0


@dataclass(frozen=True, slots=True)
class VariantFit:
    """A record under one variant of the law: products of increments by their length in samples, the weight of each
    length, the least-squares law, the variant, and its rows (pid_regression.rows_of)."""

    moves: dict[int, Floats]
    weight: Floats
    free: Floats
    variant: LawVariant
    rows: Floats = field(repr=False)

    def is_law(self, gains: Floats) -> bool:
        """Whether the least-squares law can be that of a controller with the stated gains: without set point moves, a
        law of the opposite sign is the response of PV to OP."""
        return self.variant.sp_weight == 1.0 or bool(self.free[0] * gains[0] >= 0.0)

    def residual_shares(self, gains: Floats) -> Floats:
        """Residual share of OP's variance under given gains at each length of increments [-]."""
        return np.array([1.0 - explained(m, gains) for m in self.moves.values()])

    def residual_share(self, gains: Floats) -> float:
        """The same, averaged over all lengths by their weights [-]."""
        moved = self.weight * np.array([m[3, 3] for m in self.moves.values()])
        return float(moved @ self.residual_shares(gains) / moved.sum())

    def misfit(self, gains: Floats) -> float:
        """Misfit of given gains: mean logarithm of the residual, comparable between all variants of the law."""
        return float(np.mean(np.log(SMALL + self.residual_shares(gains))))

    def reproduces_op(self, gains: Floats) -> bool:
        """Whether the gains reproduce OP about as well as any, and well enough."""
        shares, least = self.residual_shares(gains), self.residual_shares(self.free)
        unsure = np.array([blurred(m, gains) for m in self.moves.values()])
        return bool((shares - unsure <= ENOUGH * least + SMALL).all() and least.min() < GIVES)


def gains_of(c: Pid) -> Floats:
    """Gains of error, integral and slope, shape (3,)."""
    return np.array([c.kp, c.ki, c.kp * c.td_s])


def fastest(op: Floats) -> Mask:
    """True where OP moves at its highest rate, if that occurs far more often than slightly lower rates, shape (n,): a
    rate limit. Adjacent samples are included, because a limit may act between two of them."""
    size = np.abs(np.diff(op, prepend=op[0]))
    top = float(size.max())
    at = size >= AT_RATE * top
    nearly = np.count_nonzero((size >= NEAR_RATE * top) & ~at)
    coarse = top < RATE_STEPS * float(np.min(size, where=size > 0.0, initial=np.inf))
    expected = PILED_UP * nearly * (1.0 - AT_RATE) / (AT_RATE - NEAR_RATE)
    limited = not coarse and np.count_nonzero(at) > expected + CLAMPED * END_SAMPLES
    return _spread(at) if limited else np.zeros(op.size, dtype=bool)


def _spread(x: Mask) -> Mask:
    """The samples and the adjacent ones."""
    return np.convolve(x, np.ones(3), mode="same") > 0


def no_law(record: LoopRecord, stated: Pid) -> Mask:
    """True where OP does not follow a law visibly: out of use, at its own limit, a stated one or a rate limit."""
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
    """The part of an error [% PV], shape (n,), on which a law acts."""
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
class PreparedRecord:
    """A recording prepared for comparison: samples without a law, lengths of increments [samples], and the
    controller's scan [s]."""

    record: LoopRecord
    out: Mask
    lengths: tuple[int, ...]
    scan_s: float

    def rows(self, error: Floats, slope: Floats | None = None) -> Floats:
        """Rows of an error and its slope (pid_regression.rows_of)."""
        return rows_of(self.record, error, slope, self.scan_s)

    def fit_variant(self, rows: Floats, variant: LawVariant) -> VariantFit | None:
        """The recording under one variant; None where no length shows a law."""
        every = len(self.record) // MOST_INCREMENTS
        of = {k: increments(rows, self.out, k, max(k // 8, every, 1), True) for k in self.lengths}
        found = {k: m for k, m in of.items() if m is not None}
        weight = weights_of(found.values())
        if not weight.any():
            return None
        free = best_gains(found.values(), weight, np.eye(3), np.zeros(3))
        if free[2] * free[0] < 0.0:  # no controller has such a derivative: it compensates for a wrong filter
            free = best_gains(found.values(), weight, np.eye(3)[:2], np.zeros(3))
        return VariantFit(found, weight, free, variant, rows)

    def simplest_fit(self, shape: Shape) -> VariantFit | None:
        """The simplest variant with an error of that shape."""
        return self.fit_variant(self.rows(shaped(self.record.error, shape)), LawVariant(shape))


def prepared_record(record: LoopRecord, scale_s: float, stated: Pid) -> PreparedRecord:
    """Prepare the recording of a loop that moves on a time scale [s]."""
    n, ti = len(record), stated.ti_s if stated.ki else 0.0
    reach = min(n / 20, max(REACH * max(ti, scale_s) / record.dt_s, LEAST_REACH))
    lengths = tuple(LONGER**k for k in range(12) if LONGER**k <= reach)
    return PreparedRecord(record, no_law(record, stated), lengths, stated.scan_s)


def slope_filters(dt_s: float, laws: Iterable[Pid]) -> tuple[float, ...]:
    """Time constants of the slope's filter [samples]: usual fractions of the laws' derivative times, then others."""
    parts = {n * dt_s / c.td_s for c in laws if c.td_s > 0 for n in FILTER_PARTS}
    return (*(float(1.0 / np.log1p(part)) for part in sorted(parts)), *SLOPE_FILTERS)


def usual_variants(
    x: PreparedRecord, shape: Shape, *laws: Pid, smoothing: bool = True
) -> Iterator[VariantFit]:
    """The usual variants of laws on an error of that shape, simplest first; smoothing : also with filters of PV."""
    record, narrow = x.record, slope_filters(x.record.dt_s, laws)
    moves = float(np.ptp(record.sp)) > 0 and not record.sp_estimated
    stated = sorted({c.pv_filter_s / record.dt_s for c in laws} - {0.0})
    filters = [*stated, *PV_FILTERS] if smoothing else [0.0]
    for smooth, (late_pv, late_sp) in product(filters, LATE if moves else LATE[:2]):
        pv, sp = delayed(first_order(record.pv, smooth), late_pv), delayed(record.sp, late_sp)
        for rows, weight in _slopes(x, sp, pv, narrow, moves, shape):
            found = x.fit_variant(rows, LawVariant(shape, smooth, weight))
            if found is not None:
                yield found


def delayed(x: Floats, samples: int) -> Floats:
    """A signal delayed by `samples`, shape (n,)."""
    return np.concatenate((np.repeat(x[:1], samples), x[: x.size - samples]))


def _slopes(
    x: PreparedRecord, sp: Floats, pv: Floats, narrow: Iterable[float], moves: bool, shape: Shape
) -> Iterator[tuple[Floats, float | None]]:
    """Rows for every slope filter and set point weight, and that weight; None for the rows with the effect of set
    point moves removed."""
    for (on_gain, on_slope), filtered in product(ON_ERROR if moves else ON_ERROR[:1], narrow):
        slope = np.diff(on_slope * sp - pv, prepend=on_slope * sp[0] - pv[0]) / x.record.dt_s
        rows = x.rows(shaped(sp - pv, shape), first_order(slope, filtered))
        rows[0] += (on_gain - 1.0) * sp
        yield rows, on_gain
    if moves:
        slope = np.diff(-pv, prepend=-pv[0]) / x.record.dt_s
        yield np.vstack((x.rows(shaped(sp - pv, shape), slope), sp)), None


def rough_variants(x: PreparedRecord, shape: Shape) -> Iterator[VariantFit]:
    """Variants that ignore changes of PV from sample to sample: a derivative, or a filter, used other PV values
    between the samples."""
    record, pv = x.record, x.record.pv
    neighbour_mean = 0.5 * (np.concatenate((pv[:1], pv[:-1])) + np.concatenate((pv[1:], pv[-1:])))
    slope = np.gradient(-neighbour_mean, record.dt_s)
    rows = [np.vstack((x.rows(shaped(record.error, shape), slope), pv - neighbour_mean))]
    if float(np.ptp(record.sp)) > 0:
        rows.append(np.vstack((rows[0], record.sp)))
    for each, weight in zip(rows, (1.0, None), strict=False):
        found = x.fit_variant(each, LawVariant(shape, sp_weight=weight))
        if found is not None:
            yield found


def bent_shapes(x: PreparedRecord, gains: Floats | None) -> Iterator[Shape]:
    """Nonlinear error shapes that fit the record best: a squared one, and the best gaps for the least-squares law and
    for these gains, if any."""
    yield 0.0, 0.0, True
    size = float(np.median(np.abs(x.record.error[~x.out]))) if not x.out.all() else 0.0
    if size <= 0.0:
        return
    for inside, free in product(GAP_GAINS, (True,) if gains is None else (True, False)):
        width = _best_gap(x, size, inside, None if free else gains)
        if width > 0.0:
            yield width, inside, False


def _best_gap(x: PreparedRecord, size: float, inside: float, gains: Floats | None) -> float:
    """The gap with which the given gains, or the least-squares law, reproduce OP best [% PV]; 0 if none is better."""

    def poor(width: float) -> float:
        seen = x.simplest_fit((width, inside, False) if width > 0.0 else STRAIGHT)
        return np.inf if seen is None else seen.misfit(seen.free if gains is None else gains)

    tried = {w: poor(w) for w in (0.0, *(size * w for w in GAPS))}
    best = min(tried, key=tried.__getitem__)
    if best == 0.0:
        return 0.0
    low, high = best / GAPS_APART, best * GAPS_APART
    while high - low > GAP_WITHIN * best:
        a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        low, high = (low, b) if poor(a) < poor(b) else (a, high)
    return 0.5 * (low + high)


def recognized(x: PreparedRecord, stated: Pid, seen: VariantFit, variant: LawVariant) -> Pid:
    """A stated controller completed by what the record shows: the properties of a variant, which agrees
    with the stated gains, and the visible limits of OP and of its rate."""
    variant = _clearer(x, seen, variant, stated)
    if variant.pv_filter >= SEEN_FILTER and not stated.pv_filter_s:
        variant = replace(variant, pv_filter=_best_filter(x, variant, gains_of(stated)))
    return terms_of(x, stated, replace(seen, variant=variant))


def terms_of(x: PreparedRecord, c: Pid, seen: VariantFit) -> Pid:
    """A controller with the terms of a variant, and with the visible limits of OP and of its rate."""
    record, variant, c = x.record, seen.variant, with_shape(c, seen.variant.shape)
    if variant.pv_filter >= SEEN_FILTER and not c.pv_filter_s:
        c = replace(c, pv_filter_s=variant.pv_filter * record.dt_s)
    weight = _set_point_weight(x, seen, gains_of(c)) if variant.sp_weight is None else variant.sp_weight
    if weight < PLAIN_WEIGHT and c.kp and c.sp_weight == 1.0:
        c = replace(c, sp_weight=weight)
    if fastest(record.op).any():
        rate = float(np.abs(np.diff(record.op)).max()) / record.dt_s
        c = c if c.op_rate <= rate / AT_RATE else replace(c, op_rate=rate)
    at_end, middle = record.op[clamped(record.op)], 0.5 * float(record.op.min() + record.op.max())
    low, high = at_end[at_end < middle], at_end[at_end > middle]
    return replace(c, op_lo=float(max([c.op_lo, *low[:1]])), op_hi=float(min([c.op_hi, *high[:1]])))


def _set_point_weight(x: PreparedRecord, seen: VariantFit, gains: Floats) -> float:
    """The set point weight of the gain, from OP's moves with SP and within WITH_SP samples after it that the law with
    the full weight leaves [-]; 1 where other signals act on OP too."""
    if seen.rows.shape[0] != 6 or x.record.feed is not None or gains[0] == 0.0:
        return 1.0
    moved, use = np.diff(seen.rows, axis=1), ~(x.out[1:] | x.out[:-1])
    residual = (moved[3] - gains @ moved[:3])[use]
    sp = np.stack([delayed(moved[5], k)[use] for k in range(WITH_SP + 1)], axis=1)
    with_sp = float(np.linalg.lstsq(sp, residual, rcond=1e-9)[0].sum())
    return float(np.clip(1.0 + with_sp / gains[0], 0.0, 1.0))


def _clearer(x: PreparedRecord, seen: VariantFit, variant: LawVariant, stated: Pid) -> LawVariant:
    """The properties of the variant seen, or those with a filter of PV with which the stated gains
    reproduce OP clearly better. If little of OP is noise, gains agree with the record under any filter."""
    own = seen.misfit(gains_of(stated))
    if stated.td_s or stated.pv_filter_s or own < np.log(SMALL) + PLAINLY_BETTER:
        return variant
    found = {f: _misfit(x, variant, gains_of(stated), f) for f in PV_FILTERS if f > variant.pv_filter}
    best = min(found, key=found.__getitem__, default=variant.pv_filter)
    return replace(variant, pv_filter=best) if found.get(best, own) < own - PLAINLY_BETTER else variant


def with_best_filter(x: PreparedRecord, variant: LawVariant, gains: Floats | None) -> VariantFit | None:
    """A variant with the filter of PV, near its own, with which the gains, or the least-squares law, reproduce OP
    best."""
    return _filtered(x, variant, _best_filter(x, variant, gains))


def _filtered(x: PreparedRecord, variant: LawVariant, smooth: float) -> VariantFit | None:
    """A variant with another filter of PV [samples]."""
    error = x.record.sp - first_order(x.record.pv, smooth)
    return x.fit_variant(x.rows(shaped(error, variant.shape)), replace(variant, pv_filter=smooth))


def _misfit(x: PreparedRecord, variant: LawVariant, gains: Floats | None, smooth: float) -> float:
    """VariantFit.misfit of the gains, or of the least-squares law, behind another filter of PV [samples]."""
    seen = _filtered(x, variant, smooth)
    return np.inf if seen is None else seen.misfit(seen.free if gains is None else gains)


def _best_filter(x: PreparedRecord, variant: LawVariant, gains: Floats | None) -> float:
    """The filter of PV, near that of a variant, with which the gains, or the least-squares law, reproduce OP best
    [samples]; the variant's own if there is a derivative, which also has a filter."""
    if gains is not None and gains[2]:
        return variant.pv_filter
    near = variant.pv_filter * np.geomspace(0.5, 2.0, FILTERS_NEAR)
    return float(min(near, key=lambda smooth: _misfit(x, variant, gains, smooth)))
