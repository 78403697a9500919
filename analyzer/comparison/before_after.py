"""Effect of a change: hourly figures of a loop before and after it, compared with an interval and a verdict.

A change is called better or worse only if the interval of its own part, widened for drift and for the number of
figures compared, excludes zero. Under equal load that part combines the measurement and a simulation of both loops
(equal_load.py); if the weeks differ, it is the simulated change alone. All figures are means over usable hours.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from analyzer.comparison.block_bootstrap import Difference, Side, difference
from analyzer.comparison.equal_load import NO_RATIO, EqualLoad, LogRatio, Weeks
from analyzer.comparison.measures import (
    LIMITS,
    MEASURES,
    OP_TRAVEL,
    SIMULATED,
    STEM_TRAVEL,
    TRAVEL,
    Change,
    ChangeVerdict,
    Grade,
    Hours,
    Measure,
    Parts,
    Span,
    gridded,
)
from analyzer.config import ComparisonLimits
from analyzer.history.plant_clock import HOUR_S
from identification.signals.robust import robust_deviation


@dataclass(frozen=True, slots=True)
class LoopComparison:
    """A loop before and after: its changes, reasons against a comparison, the source loop, and the change in
    unchanged loops meanwhile."""

    loop: str
    before: Span
    after: Span
    hours: tuple[float, float]
    changes: tuple[Change, ...]
    reasons: tuple[str, ...]
    source_loop: str = ""
    limits: ComparisonLimits = LIMITS
    reference: Reference | None = None

    @property
    def primary(self) -> tuple[Change, ...]:
        """The changes of the study's four figures."""
        return tuple(c for c in self.changes if c.measure.primary)


def _too_little(hours: tuple[float, float], spans: tuple[Span, Span], limits: ComparisonLimits) -> list[str]:
    found = []
    for name, usable, span in zip(("before", "after"), hours, spans, strict=True):
        total = max((span.last_s - span.first_s) / HOUR_S, 0.0)
        if round(usable / 24, 1) < limits.least_days:  # rounded as reported
            least = f"{limits.least_days:g} usable days"
            found.append(f"too little time {name}: needs {least}, has {usable / 24:.1f}")
        elif usable < limits.usable_share * total:
            found.append(f"gaps {name}: {usable:.0f} of {total:.0f} h are usable")
    return found


def reasons_against(
    hours: Hours, before: Span, after: Span, limits: ComparisonLimits = LIMITS
) -> tuple[str, ...]:
    """Reasons why the two spans cannot be compared; empty if they can."""

    def pair(column: str) -> list[float | None]:
        """Means over the usable hours of both spans, None if there are none."""
        sides = (gridded(hours, span, column) for span in (before, after))
        return [side.mean if side.weight.sum() > 0 else None for side in sides]

    found = []
    for name, column, most in (
        ("set point", "sp_mean_pct", limits.set_point_pct),
        ("PV level", "pv_mean_pct", limits.set_point_pct),
        ("load (mean OP)", "op_mean_pct", limits.load_pct),
        ("share of time in automatic", "normal_pct", limits.mode_points),
    ):
        a, b = pair(column)
        if a is not None and b is not None and abs(b - a) > most:
            found.append(f"different {name}: {a:.3g} % before, {b:.3g} % after")
    a, b = (x or 0.0 for x in pair("sp_travel_pct"))
    if max(a, b) > limits.sp_travel_floor and max(a, b) > limits.sp_travel_ratio * min(a, b):
        found.append(f"different set point travel: {a:.3g} %/h before, {b:.3g} %/h after")
    a, b = (x or 0.0 for x in pair("at_limits_pct"))
    swings = (
        x or 0.0 for x in pair("oscillating_pct")
    )  # a loop that oscillates between limits causes this itself
    if max(x * (1.0 - share / 100.0) for x, share in zip((a, b), swings, strict=True)) > limits.limit_points:
        found.append(f"OP at a limit: {a:.0f} % of the time before, {b:.0f} % after")
    return tuple(found)


def reasons_of_load(
    hours: Hours, spans: tuple[Span, Span], weeks: Weeks, limits: ComparisonLimits
) -> list[str]:
    """Differences between two spans that tuning of the loop cannot cause: noise, load, an external oscillation."""
    found, sides = [], (weeks.before, weeks.after)
    if abs(weeks.noise_increase_db) > limits.noise_db:
        found.append(f"different noise: {10 ** (weeks.noise_increase_db / 20):.2g} times as large after")
    a, b = (
        _moves_of_load(*(gridded(hours, span, x) for x in ("op_mean_pct", "sp_mean_pct"))) for span in spans
    )
    reach = max((n.width for side in sides for n in side), default=0.0)  # OP motion hidden by the stem
    if min(a, b) > 0 and max(b / a, a / b) > limits.load_ratio and abs(b * b - a * a) > 0.25 * reach**2:
        found.append(f"different load: {b / a:.2g} times as large after")
    a, b = (sum(n.from_outside for n in side) / len(side) for side in sides)
    if abs(b - a) > limits.outside_share:
        found.append(f"an external oscillation in {100 * a:.0f} % of nights before, {100 * b:.0f} % after")
    return found


def _moves_of_load(op: Side, sp: Side) -> float:
    """Median over days of the deviation of hourly mean OP, without the part from the set point [% OP]; 0 if no day
    has enough hours."""
    known = op.weight > 0
    if not known.any():
        return 0.0
    target, moved = sp.value - sp.value[known].mean(), op.value - op.value[known].mean()
    moved = moved - target * float(target[known] @ moved[known]) / max(
        float(target[known] @ target[known]), 1e-9
    )
    days = [(moved[k : k + 24], known[k : k + 24]) for k in range(0, moved.size, 24)]
    spreads = [float(np.std(x[use])) for x, use in days if use.sum() >= 12]
    return float(np.median(spreads)) if spreads else 0.0


def _called(part: tuple[float, float, float], measure: Measure, least: float) -> ChangeVerdict:
    """The verdict on a value with its interval's ends; none below `least`."""
    value, low, high = part
    if abs(value) < least or low <= 0 <= high:
        return ChangeVerdict.UNCLEAR
    return ChangeVerdict.BETTER if (value < 0) == measure.lower_is_better else ChangeVerdict.WORSE


LEAST_DEVIATION = 1e-3
"""Minimum standard deviation of a measured logarithm of a ratio; ours: constant figures are not more certain."""


def _measured(
    found: Difference, measure: Measure, level: float, reference: Reference | None
) -> LogRatio | None:
    """A difference as the logarithm of a ratio, less that of unchanged loops, with its deviation towards zero; None
    if before or after is zero."""
    if min(found.before, found.after) <= measure.least:
        return None
    value = math.log(found.after / found.before)
    near = found.before + (found.high if value < 0 else found.low)
    deviation = abs(value - math.log(max(near, 0.01 * found.before) / found.before)) / float(
        ndtri(0.5 + level / 2)
    )
    common = NO_RATIO if reference is None else reference.of.get(measure.name, NO_RATIO)
    return LogRatio(value - common.value, max(math.hypot(deviation, common.deviation), LEAST_DEVIATION))


def parts_of(
    measured: LogRatio, simulated: EqualLoad, name: str, alike: bool, limits: ComparisonLimits
) -> Parts:
    """The components of a measured change.

    Without a change of settings or valve the change's own part is zero. In comparable weeks it combines measurement
    and simulation by their precision, or covers both if they contradict each other; otherwise it is the simulated
    change.
    """
    own = simulated.change[name]
    days = LogRatio(0.0, measured.deviation)  # loads of comparable weeks differ as days do
    if simulated.same:
        residual, load = (measured, days) if alike else (NO_RATIO, measured)
        return Parts(NO_RATIO, load, residual, NO_RATIO)
    load = days if alike else simulated.load[name]
    if alike:
        most = max(abs(part.value) for part in simulated.change.values())
        share = min(most / limits.full_change, 1.0)  # nearly equal settings have nearly equal effects
        sure = LogRatio(own.value, math.hypot(own.deviation, share * limits.measured_deviation))
        weight = measured.deviation**-2, sure.deviation**-2
        own = LogRatio(
            (measured.value * weight[0] + sure.value * weight[1]) / sum(weight), sum(weight) ** -0.5
        )
        if abs(measured.value - sure.value) > 2.0 * math.hypot(measured.deviation, sure.deviation):
            distance = max(abs(own.value - x.value) for x in (measured, sure))
            own = LogRatio(
                own.value, max(own.deviation, distance / float(ndtri(0.95)))
            )  # 90 % then includes both
    deviation = math.hypot(measured.deviation, own.deviation, 0.0 if alike else load.deviation)
    residual = LogRatio(measured.value - own.value - load.value, deviation)
    return Parts(own, load, residual, simulated.promised[name])


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence besides the hours of a loop: reasons why the weeks differ, the simulation, the change in unchanged
    loops, and whether travel is that of the recorded stem."""

    reasons: tuple[str, ...] = ()
    simulated: EqualLoad | None = None
    reference: Reference | None = None
    stem_recorded: bool = False


def change_of(
    hours: Hours, spans: tuple[Span, Span], measure: Measure, evidence: Evidence, limits: ComparisonLimits
) -> list[Change]:
    """The change of one figure, empty if it is unknown on either side; for travel behind a faulty valve those of the
    stem and of OP."""
    before, after = (gridded(hours, s, measure.name) for s in spans)
    if min(before.weight.sum(), after.weight.sum()) <= 0:
        return []
    family = sum(m.primary == measure.primary for m in MEASURES)
    level = 1 - (1 - limits.confidence) / family
    drifting = evidence.simulated is None or measure.name not in SIMULATED
    d = difference(before, after, level, drifting=drifting)
    found = Difference(*(x * measure.scale for x in (d.before, d.after, d.low, d.high)))
    own = _change(measure, found, level, evidence, limits)
    stem = None if evidence.simulated is None else evidence.simulated.stem
    if measure is not TRAVEL or stem is None or stem == NO_RATIO or evidence.stem_recorded:
        return [own]
    return [_of_stem(found, level, evidence, limits), replace(own, measure=OP_TRAVEL)]


def _of_stem(op: Difference, level: float, evidence: Evidence, limits: ComparisonLimits) -> Change:
    """The change of the stem's travel: that of OP times the ratio of the simulated stems' travel to it."""
    assert evidence.simulated is not None
    share, ratio = evidence.simulated.stem_share, evidence.simulated.stem
    before, factor = op.before * share, share * math.exp(ratio.value)
    wide = math.exp(ratio.deviation * float(ndtri(0.5 + level / 2)))
    low, high = (op.before + op.low) * factor / wide, (op.before + op.high) * factor * wide
    return _change(
        STEM_TRAVEL,
        Difference(before, op.after * factor, low - before, high - before),
        level,
        evidence,
        limits,
    )


def _change(
    measure: Measure, found: Difference, level: float, evidence: Evidence, limits: ComparisonLimits
) -> Change:
    """A difference with its parts and its verdict."""
    least = max(measure.least, limits.least_pct / 100 * abs(found.before))
    by_itself = _called((found.value, found.low, found.high), measure, least)
    simulated, alike = evidence.simulated, not evidence.reasons
    if simulated is not None and simulated.same:
        by_itself = ChangeVerdict.SAME
    measured = _measured(found, measure, level, evidence.reference)
    of_stem = measure is STEM_TRAVEL or (measure is TRAVEL and evidence.stem_recorded)
    name = "stem_travel" if of_stem else SIMULATED.get(measure.name)
    if simulated is None or measured is None or name is None:
        kept = alike or by_itself is ChangeVerdict.SAME
        return Change(measure, found, by_itself if kept else ChangeVerdict.INCOMPARABLE)
    parts = parts_of(measured, simulated, name, alike, limits)
    if simulated.same:
        return Change(measure, found, ChangeVerdict.SAME, parts)
    low, high = parts.change.interval(float(ndtri(0.5 + limits.confidence / 2)))
    least = max(limits.least_pct / 100, measure.least / found.before)
    verdict = _called((parts.change.value, low, high), measure, least)
    if verdict is ChangeVerdict.UNCLEAR and max(-low, high) < math.log1p(limits.none_pct / 100):
        verdict = ChangeVerdict.SAME
    if verdict is ChangeVerdict.UNCLEAR and not alike:
        verdict = ChangeVerdict.INCOMPARABLE
    return Change(measure, found, verdict, parts)


def compare(
    loop: str,
    hours: Hours,
    before: Span,
    after: Span,
    source_loop: str = "",
    limits: ComparisonLimits = LIMITS,
    evidence: Evidence | None = None,
) -> LoopComparison:
    """Compare a loop's hourly figures of two spans; if not comparable, give the reasons without verdicts.

    source_loop : the loop that this one follows, if the nights name one; evidence : further evidence.
    """
    spans, further = (before, after), evidence or Evidence()
    usable = [gridded(hours, s, "usable_h").weight.sum() for s in spans]
    held = float(usable[0]), float(usable[1])
    short = _too_little(held, spans, limits)
    if short:
        further = replace(further, simulated=None)
    reasons = (*short, *reasons_against(hours, before, after, limits), *further.reasons)
    further = replace(further, reasons=reasons)
    known = tuple(c for m in MEASURES for c in change_of(hours, spans, m, further, limits))
    return LoopComparison(loop, before, after, held, known, reasons, source_loop, limits, further.reference)


@dataclass(frozen=True, slots=True)
class Reference:
    """Change in loops without a change between the same spans: their number, and logs of ratios by figure."""

    loops: int
    of: Mapping[str, LogRatio]


def reference(
    others: Sequence[Hours], before: Span, after: Span, limits: ComparisonLimits = LIMITS
) -> Reference | None:
    """The common change of unchanged loops, figure by figure: their median ratio if significant; None with too few of
    them (difference in differences, Card and Krueger 1994)."""
    of: dict[str, LogRatio] = {}
    for m in (m for m in MEASURES if m.primary):
        ratios = []
        for hours in others:
            sides = [gridded(hours, span, m.name) for span in (before, after)]
            if (
                min(s.weight.sum() for s in sides) >= 24 * limits.least_days
                and min(s.mean for s in sides) > m.least
            ):
                ratios.append(math.log(sides[1].mean / sides[0].mean))
        if len(ratios) < limits.controls:
            continue
        value, spread = float(np.median(ratios)), robust_deviation(np.array(ratios) - np.median(ratios))
        deviation = math.sqrt(math.pi / 2 / len(ratios)) * spread  # of a median
        if abs(value) > 2.0 * deviation:
            of[m.name] = LogRatio(value, deviation)
    return Reference(len(others), of) if len(others) >= limits.controls else None


def grade(found: LoopComparison) -> Grade:
    """A loop's four verdicts combined."""
    verdicts = [c.verdict for c in found.primary]
    better = [c for c in found.primary if c.verdict is ChangeVerdict.BETTER]
    known = [c for c in found.primary if c.verdict is not ChangeVerdict.INCOMPARABLE]
    present = {c.verdict for c in known}
    if not present:
        return Grade.INCOMPARABLE
    if ChangeVerdict.WORSE in verdicts:
        return Grade.TRADED if better else Grade.WORSE
    simulated = {c.verdict for c in known if c.measure.name in SIMULATED}
    if simulated == {ChangeVerdict.SAME} and not better:
        return Grade.SAME
    if ChangeVerdict.INCOMPARABLE in verdicts and not better:
        return Grade.INCOMPARABLE
    if len(better) < len(verdicts):
        return Grade.PARTIAL if better else Grade.NONE
    least = min(abs(c.value_pct or np.inf) for c in better)
    return Grade.MODEST if least < found.limits.modest_pct else Grade.CLEAR


def follows(
    sources: Sequence[str | None], oscillating: Sequence[bool], limits: ComparisonLimits = LIMITS
) -> str:
    """The source loop in most of the oscillating nights, or ''."""
    named = [s for s, on in zip(sources, oscillating, strict=True) if s and on]
    if not named or len(named) < limits.source_share * sum(oscillating):
        return ""
    return max(sorted(set(named)), key=named.count)
