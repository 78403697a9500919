"""Autocorrelation and spectrum of a loop's error drawn, with the detected period."""

from __future__ import annotations

import numpy as np

from analyzer.pages.reading import Thinned
from analyzer.pages.trend_rhythm import LEAST_SAMPLES, autocorrelation, even_error, power_shares
from analyzer.pages.words import duration
from identification.record import Floats
from reports.pages import Line, Mark, Plot, Text

LEAST_BUCKETS = 2.5
"""Buckets a period needs to be seen in a thinned trend [-]; below 2 it is folded (Nyquist)."""
SHOWN_PERIODS = 8.0
"""Length of the autocorrelation shown [periods]."""


def rhythm_plots(thin: Thinned, period_s: float | None) -> tuple[Plot | Text, ...]:
    """Both plots, or a sentence on why the trend cannot show them."""
    if thin.time_s.size < LEAST_SAMPLES or int((~thin.gap).sum()) < LEAST_SAMPLES:
        return (Text(("Too few samples for autocorrelation and spectrum.",), "note"),)
    error, step = even_error(thin.time_s, thin.middle("sp") - thin.middle("pv"), ~thin.gap)
    if period_s is not None and period_s < LEAST_BUCKETS * step:
        text = f"The stored trend, a bucket each {step:.0f} s, cannot show a period of {duration(period_s)}."
        return (Text((text,), "note"),)
    return _correlation(error, step, period_s), _spectrum(error, step, period_s)


def _correlation(error: Floats, step: float, period_s: float | None) -> Plot:
    found = autocorrelation(error)
    most = int(SHOWN_PERIODS * period_s / step) + 1 if period_s else min(240, found.size)
    lag = np.arange(found.size, dtype=float)[:most] * (step / 60.0)
    marks = (Mark(period_s / 60.0, duration(period_s)),) if period_s else ()
    line = Line("autocorrelation", lag, found[:most])
    caption = "A sustained oscillation keeps its height from period to period; noise dies away."
    return Plot("autocorrelation", "Autocorrelation of the error", "lag [min]", "–", (line,), marks, caption)


def _spectrum(error: Floats, step: float, period_s: float | None) -> Plot:
    per_hour, share = power_shares(error, step)
    shown = per_hour <= (6.0 * 3600.0 / period_s if period_s else per_hour[-1])
    marks = (Mark(3600.0 / period_s, duration(period_s)),) if period_s else ()
    line = Line("power", per_hour[shown], share[shown])
    caption = "Share of the error's power; a valve's cycle shows lines at odd multiples as well."
    return Plot("spectrum", "Spectrum of the error", "cycles per hour", "% of power", (line,), marks, caption)
