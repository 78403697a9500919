"""Autocorrelation and spectrum of a loop's error, as far as its thinned trend shows them."""

from __future__ import annotations

import numpy as np

from identification.record import Floats, Mask
from identification.signals.correlation import lag_sums

SEGMENTS = 4
"""Parts that the spectrum is averaged over."""
LEAST_SAMPLES = 64
"""Buckets that either needs at least."""


def even_error(time_s: Floats, error: Floats, known: Mask) -> tuple[Floats, float]:
    """Error at the middle of each bucket on an even grid, its mean taken off, and the grid's step [s].

    Parameters
    ----------
    time_s, error : ndarray of shape (n,)
        Middle of each bucket [s], and SP - PV there [% of span].
    known : ndarray of bool, shape (n,)
        False in gaps, over which the error is drawn straight.
    """
    step = float(np.median(np.diff(time_s)))
    grid = np.arange(time_s[0], time_s[-1] + 0.5 * step, step)
    filled = np.interp(grid, time_s[known], error[known])
    return filled - filled.mean(), step


def autocorrelation(x: Floats) -> Floats:
    """Autocorrelation of a signal without mean at lags 0 to n/2, shape (n // 2,); 1 at lag 0."""
    n = x.size
    found = lag_sums(x, n // 2)[: n // 2]
    return found / found[0] if found[0] > 0 else np.zeros(n // 2)


def power_shares(error: Floats, step_s: float) -> tuple[Floats, Floats]:
    """Frequencies [1/h] and the share of the power at each [%], shape (m,), by Welch's periodogram (1967)."""
    from scipy.signal import welch  # its import takes longer than a page

    n = max(error.size // SEGMENTS, LEAST_SAMPLES // 2)
    frequency, power = welch(error, 1.0 / step_s, nperseg=min(n, error.size))
    return 3600.0 * frequency, 100.0 * power / max(float(power.sum()), 1e-12)
