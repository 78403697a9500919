"""Growth over the nights: of a valve's width, with its rate and the time at which it reaches a size; and of the
overshoot of a phase of a programme, with the repetition at which it began.

First a width that is constant and then grows is tested (two straight lines, Bai 1997); a growing width is then a
state-space trend with a drifting slope (statsmodels' smooth trend: Harvey 1989, ch. 2), without nights that have no
width. All widths of one valve may have a common error, which no number of nights shows: the interval includes it.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta
from typing import Any

import numpy as np

from analyzer.config import WearLimits
from analyzer.loop.oscillation.setpoint_moves import alike
from identification.estimation.descent import NINETY
from identification.record import Floats

Width = tuple[str, float, float]
"""A night, its width [% OP], and the standard deviation of its logarithm."""
MONTH_D = 30.0
"""Days of a month, as unit of rates."""


def wear(widths: Sequence[Width], limits: WearLimits) -> dict[str, Any] | None:
    """Growth of a width, from the nights with a result, oldest first; None if it is constant or too few have one.

    As columns of a belief: the night since which it grows, growth in thirty days with its 90 % interval [% OP], the
    next size [% OP], and the days between which it is reached with 90 %, None if too far ahead.
    """
    if len(widths) < limits.nights:
        return None
    days = np.array([date.fromisoformat(night).toordinal() for night, _, _ in widths], dtype=np.float64)
    width = np.array([w for _, w, _ in widths])
    deviation = width * np.array([max(s, limits.least_deviation) for _, _, s in widths])
    at = change_point(days, width, deviation, limits)
    if at is None:
        return None
    return _wear_forecast(days[days >= at], width[days >= at], limits)


def change_point(days: Floats, width: Floats, deviation: Floats, limits: WearLimits) -> float | None:
    """The day from which a width, or another figure, grows; None if a line with one bend fits no better than
    a constant. Days, figure and its standard deviation are of shape (n,)."""
    weight = 1.0 / deviation
    flat = _left(np.ones((days.size, 1)), width, weight)[0]
    best, least, slope = None, math.inf, 0.0
    for at in days[: -limits.growing_nights]:
        design = np.column_stack((np.ones(days.size), np.maximum(days - at, 0.0)))
        left, found = _left(design, width, weight)
        if left < least:
            best, least, slope = float(at), left, float(found[1])
    if best is None or slope <= 0.0:
        return None
    spread = max(least / max(days.size - 3, 1), 1.0)  # nights differ by more than their own errors
    increase = slope * (days[-1] - best)
    start = float(np.median(width[: limits.growing_nights]))
    sure = (flat - least) / spread > limits.sure
    return best if sure and increase > limits.least_growth * start else None


def _left(design: Floats, width: Floats, weight: Floats) -> tuple[float, Floats]:
    """Weighted residual squares of one straight line or two, and their constants."""
    found = np.asarray(np.linalg.lstsq(design * weight[:, None], width * weight, rcond=None)[0], np.float64)
    return float((((width - design @ found) * weight) ** 2).sum()), found


def _wear_forecast(days: Floats, width: Floats, limits: WearLimits) -> dict[str, Any] | None:
    """The trend of a growing width, extrapolated to the next size."""
    from statsmodels.tsa.statespace.structural import UnobservedComponents

    n = int(days[-1] - days[0]) + 1
    observed = np.full(n, np.nan)
    observed[(days - days[0]).astype(int)] = width
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a variance of zero is a straight line, not a failure
        fit = UnobservedComponents(observed, level="strend").fit(disp=False, maxiter=200)
        ahead = fit.get_forecast(int(limits.ahead_d))
        mean = np.asarray(ahead.predicted_mean)
        error = np.hypot(np.asarray(ahead.se_mean), limits.scale * mean)
    slope = float(fit.filtered_state[1, -1])
    drift = math.sqrt(max(float(fit.filtered_state_cov[1, 1, -1]), 0.0))
    if not math.isfinite(slope) or slope - NINETY * drift <= 0.0:
        return None
    deviation = math.hypot(drift, limits.scale * slope)
    now = float(fit.filtered_state[0, -1])
    size = limits.size if limits.size > now else 2.0 * now
    last = date.fromordinal(int(days[-1]))
    half, around = NINETY * deviation, NINETY * error
    return {
        "wear_pct_per_month": MONTH_D * slope,
        "wear_low_pct": MONTH_D * (slope - half),
        "wear_high_pct": MONTH_D * (slope + half),
        "wear_since": date.fromordinal(int(days[0])).isoformat(),
        "reaches_pct": size,
        "reaches_from": _day_reached(mean + around, size, last),
        "reaches_by": _day_reached(mean - around, size, last),
    }


def _day_reached(path: Floats, size: float, last: date) -> str | None:
    """The day on which a path reaches a size, None if it does not."""
    reached = np.flatnonzero(path >= size)
    return (last + timedelta(days=int(reached[0]) + 1)).isoformat() if reached.size else None


@dataclass(frozen=True, slots=True)
class PhaseKnown:
    """One kind of move over the nights: set point before and after [% of span], number of repetitions, and of the
    latest ones their numbers, starts [s since 1970-01-01 UTC] and overshoots [% of the move]."""

    begin: float
    end: float
    count: int = 0
    shown: tuple[tuple[int, float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Growth:
    """Growth of an overshoot: the repetition since which it grows, its start [s since 1970-01-01 UTC], first and last
    value [% of the move]."""

    number: int
    start_s: float
    before: float
    now: float


def with_repetitions(
    known: Sequence[PhaseKnown], row: Mapping[str, Any], most: int
) -> tuple[PhaseKnown, ...]:
    """The phases with those in a night's row; a known repetition is not counted again, and at most `most` are
    stored."""
    out = list(known)
    for stored in json.loads(row.get("phases") or "[]"):
        ends = stored["begin"], stored["end"]
        at = next((k for k, p in enumerate(out) if alike((p.begin, p.end), ends)), len(out))
        phase = out[at] if at < len(out) else PhaseKnown(*ends)
        last = phase.shown[-1][1] if phase.shown else -math.inf
        found = zip(stored["start_s"], stored["overshoot_pct"], strict=True)
        new = [(start, size) for start, size in found if start > last]
        numbered = tuple((phase.count + k, *each) for k, each in enumerate(new, 1))
        shown = (*phase.shown, *numbered)[-most:]
        out[at : at + 1] = [replace(phase, count=phase.count + len(new), shown=shown)]
    return tuple(out)


def forgotten(known: Sequence[PhaseKnown]) -> tuple[PhaseKnown, ...]:
    """The phases of a loop after a change of settings: the count continues, the overshoots restart."""
    return tuple(replace(p, shown=()) for p in known)


def growth(phase: PhaseKnown, limits: WearLimits) -> Growth | None:
    """Growth of the overshoot of a phase from some repetition on; None if it is constant or too few show it."""
    if len(phase.shown) < limits.nights:
        return None
    number, start, size = (np.array(x, dtype=np.float64) for x in zip(*phase.shown, strict=True))
    at = change_point(number, size, np.full(size.size, limits.overshoot_deviation), limits)
    if at is None:
        return None
    some = int(limits.growing_nights)
    before, now = float(np.median(size[number <= at][-some:])), float(np.median(size[-some:]))
    if now - before < limits.overshoot_growth:
        return None
    return Growth(int(at), float(start[number == at][0]), before, now)
