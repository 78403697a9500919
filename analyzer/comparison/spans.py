"""Spans of hours around a change, and the store's hourly figures on their grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.comparison.block_bootstrap import Floats, Side

HOUR_S = 3600.0
TRANSITION_S = 3600.0
"""Left out after a change [s], beside the hour it falls into; ours: a bump of new settings is not their
behaviour."""


@dataclass(frozen=True, slots=True)
class Span:
    """A span of time [s since 1970-01-01 UTC]."""

    first_s: float
    last_s: float


Hours = Mapping[str, Floats]
"""Columns of the store's hourly table of one loop, shape (h,) each, NaN where not known."""


def spans_around(changed_s: float, days: float, others: Sequence[float] = ()) -> tuple[Span, Span]:
    """Spans before and after a change, ended by other changes of the same loop [s]."""
    first, last = changed_s - days * 24 * HOUR_S, changed_s + days * 24 * HOUR_S
    earlier = [o + TRANSITION_S for o in others if o < changed_s]
    later = [o for o in others if o > changed_s]
    after = Span(changed_s + TRANSITION_S, min([last, *later]))
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


def mean(hours: Hours, span: Span, column: str) -> float | None:
    """Mean of a column over the usable hours of a span, None where there are none."""
    side = gridded(hours, span, column)
    return side.mean if side.weight.sum() > 0 else None
