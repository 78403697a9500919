"""Did it help? Hourly figures of a loop before and after a change, compared with an interval and a verdict.

A change is called better or worse only where the two spans can be compared and the interval, widened for
drift and for the number of figures looked at, leaves zero out. All figures are means over usable hours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.comparison.block_bootstrap import Difference, Floats, Side, difference
from analyzer.config import ComparisonLimits
from analyzer.history.plant_clock import HOUR_S

LIMITS = ComparisonLimits()
"""The limits in force where none are given."""


@dataclass(frozen=True, slots=True)
class Span:
    """A span of time [s since 1970-01-01 UTC]."""

    first_s: float
    last_s: float


Hours = Mapping[str, Floats]
"""Columns of the store's hourly table of one loop, shape (h,) each, NaN where not known."""


def spans_around(
    changed_s: float, days: float, others: Sequence[float] = (), limits: ComparisonLimits = LIMITS
) -> tuple[Span, Span]:
    """Spans before and after a change, ended by other changes of the same loop [s]."""
    first, last = changed_s - days * 24 * HOUR_S, changed_s + days * 24 * HOUR_S
    earlier = [o + limits.transition_s for o in others if o < changed_s]
    later = [o for o in others if o > changed_s]
    after = Span(changed_s + limits.transition_s, min([last, *later]))
    return Span(max([first, *earlier]), changed_s), after


def gridded(hours: Hours, span: Span, column: str) -> Side:
    """A column on the grid of the whole hours inside a span, each weighted by its usable share."""
    first, last = np.ceil(span.first_s / HOUR_S), np.floor(span.last_s / HOUR_S)
    n = max(int(last - first), 0)
    value, weight = np.zeros(n), np.zeros(n)
    at = np.round(hours["hour_s"] / HOUR_S - first).astype(int)
    known = (at >= 0) & (at < n) & np.isfinite(hours[column]) & (hours["usable_h"] > 0)
    value[at[known]] = hours[column][known]
    weight[at[known]] = hours["usable_h"][known]
    return Side(value, weight)


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure that is compared.

    name : its column in the table of hours; least : differences below this, in the figure's unit, are none; scale :
    factor from the hourly mean to the unit shown, which is that of the column where scaled_unit is ''; primary : one
    of the study's four; lower_is_better : which way is better.
    """

    name: str
    least: float
    primary: bool = False
    scale: float = 1.0
    lower_is_better: bool = True
    scaled_unit: str = ""

    @property
    def title(self) -> str:
        """The column's title."""
        return BY_NAME[self.name].title

    @property
    def short_title(self) -> str:
        """The title without what it says in brackets."""
        return self.title.split(" (")[0]

    @property
    def unit(self) -> str:
        """The unit that it is shown in."""
        return self.scaled_unit or BY_NAME[self.name].unit


MEASURES = (
    Measure("average_absolute_error_pct", 0.005, primary=True),
    Measure("valve_travel_pct_per_h", 0.2, primary=True),
    Measure("oscillation_significance", 0.1, primary=True, scale=24.0, scaled_unit="% h a day"),
    Measure("variability_pct", 0.01, primary=True),
    Measure("reversals_per_h", 0.5),
    Measure("crossings_per_h", 0.5),
    Measure("oscillating_pct", 2.0),
    Measure("pv_variability_pct", 0.01),
    Measure("at_limits_pct", 1.0),
    Measure("service_pct", 1.0, lower_is_better=False),
)
"""The study's four first (its section 7), then the others of the store. Least differences are ours: about the
resolution of what a historian keeps."""


class ChangeVerdict(StrEnum):
    """What became of a figure."""

    BETTER = "better"
    WORSE = "worse"
    UNCLEAR = "no clear change"
    INCOMPARABLE = "not comparable"

    @property
    def colour(self) -> str:
        """The kind under which pages colour it."""
        return self.name.lower()


class Grade(StrEnum):
    """What became of a loop, from its four verdicts."""

    CLEAR = "clear"
    MODEST = "modest"
    PARTIAL = "partial"
    MIXED = "mixed"
    WORSE = "worse"
    NONE = "none"
    INCOMPARABLE = "incomparable"


@dataclass(frozen=True, slots=True)
class Change:
    """One figure before and after; percent of before, None where before is zero."""

    measure: Measure
    found: Difference
    verdict: ChangeVerdict

    @property
    def value_pct(self) -> float | None:
        """The change [% of before]."""
        return self.percent(self.found.value)

    @property
    def interval_pct(self) -> tuple[float, float] | None:
        """The change's interval [% of before], ending at -100."""
        low, high = self.percent(self.found.low), self.percent(self.found.high)
        return None if low is None or high is None else (max(low, -100.0), max(high, -100.0))

    def percent(self, difference: float) -> float | None:
        """A difference as percent of before."""
        before = self.found.before
        return 100.0 * difference / before if before > self.measure.least else None


@dataclass(frozen=True, slots=True)
class LoopComparison:
    """A loop before and after: its changes, reasons against comparing, and the source loop."""

    loop: str
    before: Span
    after: Span
    hours: tuple[float, float]
    changes: tuple[Change, ...]
    reasons: tuple[str, ...]
    source_loop: str = ""
    limits: ComparisonLimits = LIMITS

    @property
    def primary(self) -> tuple[Change, ...]:
        """The study's four."""
        return tuple(c for c in self.changes if c.measure.primary)


def _too_little(hours: tuple[float, float], spans: tuple[Span, Span], limits: ComparisonLimits) -> list[str]:
    found = []
    for name, usable, span in zip(("before", "after"), hours, spans, strict=True):
        total = max((span.last_s - span.first_s) / HOUR_S, 0.0)
        if round(usable / 24, 1) < limits.least_days:  # as it is told
            least = f"{limits.least_days:g} usable days"
            found.append(f"too little time {name}: needs {least}, has {usable / 24:.1f}")
        elif usable < limits.usable_share * total:
            found.append(f"gaps {name}: {usable:.0f} of {total:.0f} h are usable")
    return found


def reasons_against(
    hours: Hours, before: Span, after: Span, limits: ComparisonLimits = LIMITS
) -> tuple[str, ...]:
    """Why the two spans cannot be compared; empty where they can."""

    def pair(column: str) -> list[float | None]:
        """Means over the usable hours of both spans, None where there are none."""
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
    if max(a, b) > limits.limit_points:
        found.append(f"OP at a limit: {a:.0f} % of the time before, {b:.0f} % after")
    return tuple(found)


def _change_verdict(found: Difference, measure: Measure, limits: ComparisonLimits) -> ChangeVerdict:
    small = abs(found.value) < max(measure.least, limits.least_pct / 100 * abs(found.before))
    if small or found.low <= 0 <= found.high:
        return ChangeVerdict.UNCLEAR
    return ChangeVerdict.BETTER if (found.value < 0) == measure.lower_is_better else ChangeVerdict.WORSE


def change_of(
    hours: Hours, spans: tuple[Span, Span], measure: Measure, comparable: bool, limits: ComparisonLimits
) -> Change | None:
    """The change of one figure; None where it is not known on both sides."""
    before, after = (gridded(hours, s, measure.name) for s in spans)
    if min(before.weight.sum(), after.weight.sum()) <= 0:
        return None
    family = sum(m.primary == measure.primary for m in MEASURES)
    d = difference(before, after, 1 - (1 - limits.confidence) / family)
    found = Difference(*(x * measure.scale for x in (d.before, d.after, d.low, d.high)))
    verdict = _change_verdict(found, measure, limits) if comparable else ChangeVerdict.INCOMPARABLE
    return Change(measure, found, verdict)


def compare(
    loop: str,
    hours: Hours,
    before: Span,
    after: Span,
    source_loop: str = "",
    limits: ComparisonLimits = LIMITS,
) -> LoopComparison:
    """A loop's hourly figures of two spans; without verdicts, and with the reasons, where they cannot be compared.

    source_loop : the loop that this one follows, where the nights name one.
    """
    spans = before, after
    usable = [gridded(hours, s, "usable_h").weight.sum() for s in spans]
    held = float(usable[0]), float(usable[1])
    reasons = (*_too_little(held, spans, limits), *reasons_against(hours, before, after, limits))
    changes = [change_of(hours, spans, m, not reasons, limits) for m in MEASURES]
    known = tuple(c for c in changes if c is not None)
    return LoopComparison(loop, before, after, held, known, reasons, source_loop, limits)


def grade(found: LoopComparison) -> Grade:
    """A loop's four verdicts as one."""
    verdicts = [c.verdict for c in found.primary]
    better = [c for c in found.primary if c.verdict is ChangeVerdict.BETTER]
    if found.reasons or not verdicts:
        return Grade.INCOMPARABLE
    if ChangeVerdict.WORSE in verdicts:
        return Grade.MIXED if better else Grade.WORSE
    if len(better) < len(verdicts):
        return Grade.PARTIAL if better else Grade.NONE
    least = min(abs(c.value_pct or np.inf) for c in better)
    return Grade.MODEST if least < found.limits.modest_pct else Grade.CLEAR


def follows(
    sources: Sequence[str | None], oscillating: Sequence[bool], limits: ComparisonLimits = LIMITS
) -> str:
    """The source loop that most of the oscillating nights name, or ''."""
    named = [s for s, on in zip(sources, oscillating, strict=True) if s and on]
    if not named or len(named) < limits.source_share * sum(oscillating):
        return ""
    return max(sorted(set(named)), key=named.count)
