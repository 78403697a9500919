"""Changes with their intervals as pictures: loop by loop, and on average (the study's Figures 12 and 13)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analyzer.comparison.before_after import MEASURES, Change, Measure, Verdict
from analyzer.pages.change_case import Case
from analyzer.pages.words import KINDS, counted, signed
from reports.pages import IntervalBar, IntervalChart

PRIMARY = tuple(m for m in MEASURES if m.primary)
"""The study's four figures."""


def _bar(change: Change, group: str) -> IntervalBar:
    ends = change.interval_pct
    low, high = ends if ends else (None, None)
    text = f"{signed(change.value_pct)} %" if ends else change.verdict.value
    return IntervalBar(
        group, change.measure.short_title, change.value_pct, low, high, KINDS[change.verdict], text
    )


def per_loop_chart(cases: Sequence[Case]) -> IntervalChart:
    """Change per loop and assessment (the study's Figure 12)."""
    bars = tuple(_bar(c, case.found.loop) for case in cases for c in case.found.primary)
    caption = "Bars: change in % of the span before; lines: its interval. Less is better in all four."
    return IntervalChart("change-per-loop", "Change per loop and assessment", "% of before", bars, caption)


def _average(cases: Sequence[Case], measure: Measure) -> IntervalBar:
    """Mean of the comparable loops' changes; errors of different loops taken as independent."""
    changes = [c for case in cases for c in case.found.primary if c.measure == measure]
    known = [c for c in changes if c.verdict is not Verdict.INCOMPARABLE and c.value_pct is not None]
    group = counted(len(known), "loop")
    if not known:
        return IntervalBar(group, measure.short_title, None, None, None, "incomparable", "nothing comparable")
    values = np.array([c.value_pct for c in known], float)
    ends = np.array([c.interval_pct for c in known], float)
    down, up = (float(np.sqrt(((ends[:, k] - values) ** 2).sum()) / len(known)) for k in (0, 1))
    mean = float(values.mean())
    low, high = max(mean - down, -100.0), mean + up
    verdict = Verdict.UNCLEAR if low <= 0 <= high else Verdict.BETTER if mean < 0 else Verdict.WORSE
    text = f"{signed(mean)} %"
    return IntervalBar(group, measure.short_title, mean, low, high, KINDS[verdict], text)


def average_chart(cases: Sequence[Case]) -> IntervalChart:
    """Average change of all comparable loops (the study's Figure 13)."""
    bars = tuple(_average(cases, m) for m in PRIMARY)
    caption = "Mean over the loops that can be compared; loops that were not better count as they are."
    return IntervalChart("average-change", "Average change", "% of before", bars, caption)
