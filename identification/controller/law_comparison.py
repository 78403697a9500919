"""Comparison of a stated control law with that of the record: which settings differ. All unlisted properties of the
law are free."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from identification.controller.gain_pieces import ScheduledGain
from identification.controller.law_variants import (
    GIVES,
    PLAINLY_BETTER,
    SEEN_FILTER,
    STRAIGHT,
    LawVariant,
    PreparedRecord,
    VariantFit,
    bent_shapes,
    gains_of,
    prepared_record,
    recognized,
    rough_variants,
    shape_of,
    usual_variants,
    with_best_filter,
    with_shape,
)
from identification.controller.pid_regression import (
    LONGEST_INTEGRAL,
    SMALL,
    best_gains,
    blurred,
    explained,
    integral_time,
)
from identification.models import Pid
from identification.record import Floats, LoopRecord

AS_WELL = 1.15
"""Largest ratio of the residual of a law with fewer settings to that of the freest law: the simplest such is
the answer."""
WORTH = 0.1  # Log reduction of the residual from which a filter, or another usual form of the law, is taken
PARTS = ((0.0, 0.33), (0.67, 1.0), (0.33, 0.67), (0.0, 0.5), (0.5, 1.0))
"""Parts of the range of OP, PV or SP, as quantiles, in which a stated law may hold alone: gains are scheduled
in two to four pieces."""
ROUNDING = 1e-6  # Share of OP's variance below which what a law leaves is rounding


@dataclass(frozen=True, slots=True)
class LawsCompared:
    """An identified and a stated law, compared on the increments with the strongest evidence against the stated one:
    the share of OP's variance explained by each [-], and whether the stated law agrees with the record."""

    found: Pid
    explained: float
    explained_stated: float
    agree: bool = False

    @property
    def residual_ratio(self) -> float:
        """Ratio of the residual of the stated law to that of the identified law [-]."""
        return (1.0 - self.explained_stated) / max(1.0 - self.explained, 1e-9)


def _variants(x: PreparedRecord, stated: Pid) -> Iterator[VariantFit]:
    """All variants of the law, first with the stated error shape, then with unlisted properties."""
    own, gains = shape_of(stated), gains_of(stated)
    yield from usual_variants(x, own, stated)
    if stated.scan_s < x.record.dt_s:
        yield from rough_variants(x, own)
    if own == STRAIGHT:
        for shape in bent_shapes(x, gains):
            yield from chain(usual_variants(x, shape, smoothing=False), rough_variants(x, shape))
    else:
        yield from usual_variants(x, STRAIGHT, stated)


def compare_laws(record: LoopRecord, period_s: float, stated: Pid) -> LawsCompared | None:
    """Compare a stated law with that of the record, which differs in as few settings as explain OP.

    period_s : period, or other time scale on which the loop moves [s]. None where the record does not show a law; the
    stated law, completed by what the record shows, where it agrees.
    """
    gains, x = gains_of(stated), prepared_record(record, period_s, stated)
    best, given = None, None
    for seen in _variants(x, stated):
        if seen.reproduces_op(gains):
            return LawsCompared(
                recognized(x, stated, seen, _needed_variant(seen, given, stated)), 1.0, 1.0, True
            )
        if not seen.is_law(gains):
            continue
        if best is None or seen.misfit(seen.free) < best.misfit(best.free) - WORTH:
            best = seen
        if given is None or seen.misfit(gains) < given.misfit(gains):
            given = seen
        if seen.variant.pv_filter > given.variant.pv_filter and _is_decided(best, given, gains):
            break
    if best is None or given is None:
        return None
    if given.variant.pv_filter >= SEEN_FILTER:
        near = with_best_filter(x, given.variant, gains)
        if near is not None and near.reproduces_op(gains):
            return LawsCompared(recognized(x, stated, near, near.variant), 1.0, 1.0, True)
    found = _simplest(best, gains, record.duration_s, with_shape(stated, best.variant.shape))
    return None if found is None else _clearest_comparison(best, given, gains, *found)


def _needed_variant(seen: VariantFit, before: VariantFit | None, stated: Pid) -> LawVariant:
    """The variant in which the stated law reproduces OP; with the stated error shape if that is about as good."""
    own, gains = shape_of(stated), gains_of(stated)
    if seen.variant.shape == own or before is None:
        return seen.variant
    bent = before.misfit(gains) - seen.misfit(gains) > PLAINLY_BETTER
    return seen.variant if bent else replace(seen.variant, shape=own)


def scheduled_over(record: LoopRecord, period_s: float, stated: Pid) -> ScheduledGain | None:
    """The signal, OP, PV or SP, in a part of whose range the stated law reproduces OP; None if there is no such part.
    A gain scheduled over the signal has the stated value only there.

    A part counts if the integral is visible in it, on increments of half an integral time.
    """
    gains, whole = gains_of(stated), prepared_record(record, period_s, stated)
    for name in ("op", "pv", "sp"):
        x = getattr(record, name)
        for low, high in PARTS:
            a, b = (float(np.quantile(x[record.usable], share)) for share in (low, high))
            within = replace(whole, out=whole.out | (x < a) | (x > b))
            seen = within.simplest_fit(shape_of(stated)) if b > a else None
            if seen is None or (stated.ki and max(seen.moves) * record.dt_s < 0.5 * stated.ti_s):
                continue
            if seen.reproduces_op(gains):
                return ScheduledGain(name)
    return None


def best_of(record: LoopRecord, period_s: float, laws: Sequence[Pid]) -> Pid:
    """The law, of several with a derivative, that reproduces OP clearly best; the first if none does.

    Laws that agree with a record within the usual uncertainty are distinguished here by their residual of an OP with
    every scan recorded.
    """
    poor = np.full(len(laws), np.inf)
    for seen in usual_variants(prepared_record(record, period_s, laws[0]), STRAIGHT, *laws, smoothing=False):
        shares = np.stack([seen.residual_shares(gains_of(law)) for law in laws])
        poor = np.minimum(poor, np.log(np.maximum(shares, ROUNDING)).mean(axis=1))
    best = int(np.argmin(poor))
    return laws[best] if poor[0] - poor[best] > PLAINLY_BETTER else laws[0]


def _is_decided(best: VariantFit, given: VariantFit, gains: Floats) -> bool:
    """Whether another law reproduces OP fully and the stated one is far off, so that more variants are
    useless. It is tested only if a longer filter of PV does not improve the stated one."""
    share = best.residual_share(best.free)
    return share < SMALL and given.residual_share(gains) > max(10.0 * share, GIVES)


def _clearest_comparison(
    best: VariantFit, given: VariantFit, gains: Floats, pid: Pid, law: Floats
) -> LawsCompared | None:
    """The identified law and the stated one, over the increments that distinguish them most."""
    stated = {k: explained(m, gains) + blurred(m, gains) for k, m in given.moves.items()}
    laws = [
        LawsCompared(pid, explained(m, law), stated[k])
        for (k, m), weight in zip(best.moves.items(), best.weight, strict=True)
        if weight > 0 and k in stated
    ]
    return max(laws, key=lambda x: x.residual_ratio * x.explained, default=None)


def settings_of(gains: Floats, record_s: float, stated: Pid) -> Pid | None:
    """A controller with given gains, shape (3,), of a record of so many seconds; None if no controller has them."""
    kp, ki, kd = (float(g) for g in gains)
    if kp == 0:
        return replace(stated, kp=0.0, ti_s=1.0 / ki, td_s=0.0) if ki else None
    if kd / kp < -1e-9:
        return None
    ti_s = integral_time(kp, ki, record_s)
    integral_runs_back = ki / kp < 0 and abs(ki / kp) * record_s > 1.0 / LONGEST_INTEGRAL
    return None if integral_runs_back else replace(stated, kp=kp, ti_s=ti_s, td_s=max(kd / kp, 0.0))


def _simplest(seen: VariantFit, gains: Floats, record_s: float, stated: Pid) -> tuple[Pid, Floats] | None:
    """The law that differs from the stated one in the fewest settings, and its gains."""
    p, i, d = np.eye(3)
    none = np.zeros(3)
    whole = gains / gains[0] if gains[0] else i
    trials = [
        (d[None], gains * (p + i)),  # td alone
        (whole[None], none),  # kp alone
        (i[None], gains * (p + d)),  # ti alone
        (i[None], none),  # integral alone
        (np.stack((p + whole * d, i)), none),  # kp and ti
        (np.eye(3), none),
    ]
    enough = AS_WELL * seen.residual_share(seen.free) + 1e-6  # an exact law has only a rounding residual
    for along, held in trials:
        law = best_gains(seen.moves.values(), seen.weight, along, held)
        pid = settings_of(law, record_s, stated)
        if pid is not None and seen.residual_share(law) <= enough:
            return pid, law
    return None
