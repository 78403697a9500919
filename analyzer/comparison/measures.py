"""What is compared before and after a change: spans, measures, and the result of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.comparison.block_bootstrap import Difference, Side
from analyzer.comparison.equal_load import LogRatio
from analyzer.config import ComparisonLimits
from analyzer.history.plant_clock import HOUR_S
from identification.record import Floats

Hours = Mapping[str, Floats]
"""Columns of the store's hourly table of one loop, shape (h,) each, NaN where unknown."""
LIMITS = ComparisonLimits()
"""The default limits."""


@dataclass(frozen=True, slots=True)
class Span:
    """A span of time [s since 1970-01-01 UTC]."""

    first_s: float
    last_s: float


def spans_around(
    changed_s: float, days: float, others: Sequence[float] = (), limits: ComparisonLimits = LIMITS
) -> tuple[Span, Span]:
    """Spans before and after a change, limited by other changes of the same loop [s]."""
    first, last = changed_s - days * 24 * HOUR_S, changed_s + days * 24 * HOUR_S
    earlier = [o + limits.transition_s for o in others if o < changed_s]
    later = [o for o in others if o > changed_s]
    after = Span(changed_s + limits.transition_s, min([last, *later]))
    return Span(max([first, *earlier]), changed_s), after


def gridded(hours: Hours, span: Span, column: str) -> Side:
    """A column on the grid of whole hours inside a span, each weighted by its usable share."""
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
    """A compared figure.

    name : its column in the table of hours; least : smaller differences, in the figure's unit, count as none; scale :
    factor from the hourly mean to the displayed unit, which is that of the column if scaled_unit is ''; primary : one
    of the study's four; lower_is_better : direction of improvement.
    """

    name: str
    least: float
    primary: bool = False
    scale: float = 1.0
    lower_is_better: bool = True
    scaled_unit: str = ""
    own_title: str = ""

    @property
    def title(self) -> str:
        """The column's title, unless it has its own."""
        return self.own_title or BY_NAME[self.name].title

    @property
    def short_title(self) -> str:
        """The title without the part in brackets."""
        return self.title.split(" (")[0]

    @property
    def unit(self) -> str:
        """The displayed unit."""
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
resolution of a historian."""


TRAVEL = next(m for m in MEASURES if m.name == "valve_travel_pct_per_h")


STEM_TRAVEL = replace(TRAVEL, own_title="Valve travel (stem, simulated)")


OP_TRAVEL = replace(TRAVEL, primary=False, own_title="Travel of OP")
"""Behind a faulty valve the stem travels differently from OP, and the stem wears."""


SIMULATED = {TRAVEL.name: "valve_travel_pct_per_h", **{m.name: m.name for m in (MEASURES[0], MEASURES[3])}}
"""Simulated figures, and their names in equal_load.py."""


class ChangeVerdict(StrEnum):
    """Verdict on a figure."""

    BETTER = "better"
    WORSE = "worse"
    SAME = "no change"
    UNCLEAR = "no clear change"
    INCOMPARABLE = "not comparable"

    @property
    def colour(self) -> str:
        """The name of its colour on pages."""
        return ChangeVerdict.UNCLEAR.colour if self is ChangeVerdict.SAME else self.name.lower()


class Grade(StrEnum):
    """Verdict on a loop, from its four figures."""

    CLEAR = "clear"
    MODEST = "modest"
    PARTIAL = "partial"
    TRADED = "traded"
    WORSE = "worse"
    SAME = "same"
    NONE = "none"
    INCOMPARABLE = "incomparable"


@dataclass(frozen=True, slots=True)
class Parts:
    """Components of a difference, as logarithms of ratios: the change's own part, that of load and set point, the
    residual; and the predicted effect of the settings under the load of before."""

    change: LogRatio
    load: LogRatio
    left: LogRatio
    promised: LogRatio


@dataclass(frozen=True, slots=True)
class Change:
    """One figure before and after; percent of before, None if before is zero; parts, None without a simulation."""

    measure: Measure
    found: Difference
    verdict: ChangeVerdict
    parts: Parts | None = None

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
