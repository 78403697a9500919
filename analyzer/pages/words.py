"""Figures and times in words, the same on every page."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from analyzer.before_after import Change, Verdict

TITLES = {
    "average_absolute_error_pct": ("Average absolute error", "% of span"),
    "valve_travel_pct_per_h": ("Valve travel", "%/h"),
    "oscillation_significance": ("Oscillation significance", "% h a day"),
    "variability_pct": ("Variability (2σ of error)", "% of span"),
    "reversals_per_h": ("Valve reversals", "1/h"),
    "crossings_per_h": ("Setpoint crossings", "1/h"),
    "oscillating_pct": ("Time oscillating", "%"),
    "pv_variability_pct": ("PV variability (2σ over mean)", "%"),
    "at_limits_pct": ("Time at limits", "%"),
    "service_pct": ("Effective service factor", "%"),
    "noise_band_pct": ("Noise band", "% of span"),
    "normal_pct": ("Time in automatic", "%"),
    "harris_index": ("Harris index (1 is best)", ""),
    "settling_time_s": ("Settling time", "s"),
    "period_s": ("Period", "s"),
    "pv_amplitude_pct": ("Amplitude of PV", "% of span"),
    "regularity": ("Regularity", ""),
    "sp_mean_pct": ("Mean SP", "% of span"),
    "pv_mean_pct": ("Mean PV", "% of span"),
    "op_mean_pct": ("Mean OP", "%"),
    "usable_h": ("Usable time", "h"),
}
"""Name and unit of each figure."""
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


def stamp(time_s: float) -> str:
    """A time to the minute, UTC."""
    return datetime.fromtimestamp(time_s, UTC).strftime("%Y-%m-%d %H:%M")


def duration(seconds: float | None) -> str:
    """A length of time in the unit that reads best."""
    if seconds is None:
        return ""
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 7200 else f"{seconds / 3600:.3g} h"


def interval(change: Change) -> str:
    """The interval of a change in percent of before, or in the figure's unit where before is zero."""
    ends = change.interval_pct
    if ends is None:
        return f"{number(change.found.low)} … {number(change.found.high)} {TITLES[change.measure.name][1]}"
    return f"{signed(ends[0])} … {signed(ends[1])} %"


def setting(value: Any) -> str:
    """A controller setting as it was stated."""
    return "–" if value is None else f"{value:g}"


def counted(n: int, what: str) -> str:
    """A number with its noun."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"
