"""Figures and times in words, the same on every page."""

from __future__ import annotations

from typing import Any

from analyzer.comparison.before_after import Change, Verdict
from analyzer.history.plant_clock import stamp
from analyzer.words.units import duration

__all__ = ["KINDS", "counted", "duration", "interval", "number", "setting", "signed", "stamp"]

KINDS = {
    Verdict.BETTER: "better",
    Verdict.WORSE: "worse",
    Verdict.UNCLEAR: "unclear",
    Verdict.INCOMPARABLE: "incomparable",
}
"""Colour of each verdict."""


def number(value: float | None) -> str:
    """Three digits, empty where not known."""
    if value is None:
        return ""
    if value == 0:
        return "0"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def signed(value: float | None) -> str:
    """A percentage with its sign, whole numbers from 10 on."""
    if value is None:
        return "–"
    text = f"{value:+.1f}" if abs(value) < 9.95 else f"{value:+.0f}"
    return text.replace("-", "−")


def interval(change: Change) -> str:
    """The interval of a change in percent of before, or in the figure's unit where before is zero."""
    ends = change.interval_pct
    if ends is None:
        return f"{number(change.found.low)} … {number(change.found.high)} {change.measure.unit}"
    return f"{signed(ends[0])} … {signed(ends[1])} %"


def setting(value: Any) -> str:
    """A controller setting as it was stated."""
    return "–" if value is None else f"{value:g}"


def counted(n: int, what: str) -> str:
    """A number with its noun."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"
