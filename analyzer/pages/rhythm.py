"""Autocorrelation and spectrum of a loop's error from its thinned trend, with the detected period."""

from __future__ import annotations

import numpy as np

from analyzer.block_bootstrap import Floats
from analyzer.pages.reading import Thinned
from analyzer.pages.words import duration
from reports.map_blocks import Mark
from reports.pages import Line, Plot, Text

LEAST_BUCKETS = 2.5
"""Buckets a period needs to be seen in a thinned trend [-]; below 2 it is folded (Nyquist)."""
LEAST_SAMPLES = 64
SHOWN_PERIODS = 8.0
"""Length of the autocorrelation shown [periods]."""
SEGMENTS = 4
"""Parts that the spectrum is averaged over."""


def _error(thin: Thinned) -> tuple[Floats, float]:
    """Error at the middle of each bucket on an even grid, its mean taken off, and the grid's step [s]."""
    known = ~thin.gap
    step = float(np.median(np.diff(thin.time_s)))
    grid = np.arange(thin.time_s[0], thin.time_s[-1] + 0.5 * step, step)
    error = (thin.middle("sp") - thin.middle("pv"))[known]
    filled = np.interp(grid, thin.time_s[known], error)
    return filled - filled.mean(), step


def autocorrelation(x: Floats) -> Floats:
    """Autocorrelation of a signal without mean at lags 0 to n/2, shape (n // 2,); 1 at lag 0."""
    n = x.size
    power = np.abs(np.fft.rfft(x, 2 * n)) ** 2
    found = np.fft.irfft(power)[: n // 2]
    return found / found[0] if found[0] > 0 else np.zeros(n // 2)


def rhythm_plots(thin: Thinned, period_s: float | None) -> tuple[Plot | Text, ...]:
    """Both plots, or a sentence on why the trend cannot show them."""
    if thin.time_s.size < LEAST_SAMPLES or int((~thin.gap).sum()) < LEAST_SAMPLES:
        return (Text(("Too few samples for autocorrelation and spectrum.",), "note"),)
    error, step = _error(thin)
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
    from scipy.signal import welch  # its import takes longer than a page

    n = max(error.size // SEGMENTS, LEAST_SAMPLES // 2)
    frequency, power = welch(error, 1.0 / step, nperseg=min(n, error.size))
    per_hour = 3600.0 * frequency
    shown = per_hour <= (6.0 * 3600.0 / period_s if period_s else per_hour[-1])
    share = 100.0 * power / max(float(power.sum()), 1e-12)
    marks = (Mark(3600.0 / period_s, duration(period_s)),) if period_s else ()
    line = Line("power", per_hour[shown], share[shown])
    caption = "Share of the error's power; a valve's cycle shows lines at odd multiples as well."
    return Plot("spectrum", "Spectrum of the error", "cycles per hour", "% of power", (line,), marks, caption)
