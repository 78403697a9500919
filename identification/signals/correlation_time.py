"""How long an error is remembered: the time after which it is no longer like itself."""

from __future__ import annotations

import math

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from identification.record import Floats, Mask

SMOOTHING = 0.1
"""The error is averaged over this share of the loop's own time first, for noise is not swiftness [-]."""
COARSEST = 0.2
"""Interval of samples beyond which, in the loop's own time, one sample's noise passes for memory [-]; ours."""


def _averaged(error: Floats, good: Mask, blocks: int, width: int) -> tuple[Floats, Mask]:
    """Means of the good samples of each block, 0 in blocks that are half bad, and which are not, shape (blocks,)."""
    weight = good[: blocks * width].reshape(blocks, width).mean(axis=1)
    total = np.where(good, error, 0.0)[: blocks * width].reshape(blocks, width).mean(axis=1)
    use = weight > 0.5
    return np.where(use, total / np.where(use, weight, 1.0), 0.0), use


def _products(x: Floats) -> Floats:
    """Sums over x[k] x[k + lag] at all lags, shape (n,)."""
    size = next_fast_len(2 * x.size, real=True)
    f = rfft(x, size)
    return irfft(f.real**2 + f.imag**2, size)[: x.size]  # type: ignore[no-any-return]


def correlation_time(error: Floats, good: Mask, dt_s: float, scale_s: float) -> float | None:
    """The time [s] after which the autocorrelation of the averaged error is under 1/e.

    After a load has moved PV, the error of a PI loop dies with its slowest pole. Where Kp times the process gain is
    under one, that is about Ti/(Kp K), longer than Ti: a correlation time of several integral times is a controller
    that lets errors stand. With Kp K of 1.2 to 3 it is 0.5 to 1.7 Ti, with 0.45 and less 2 to 12 Ti, whether the load
    steps or wanders (tests/identification/signals/test_correlation_time.py).

    Parameters
    ----------
    error : ndarray of shape (n,)
        SP - PV [any unit].
    good : ndarray of bool, shape (n,)
        True where it may be used; what lies between counts for nothing.
    dt_s : float
        Sample interval [s].
    scale_s : float
        The loop's own time [s], its integral time; the answer has steps of a tenth of it.

    Returns
    -------
    float or None
        None where the record holds fewer than ten of `scale_s`, samples are coarser than a fifth of it, or nothing
        moves.
    """
    if not math.isfinite(scale_s) or dt_s > COARSEST * scale_s:
        return None
    width = max(round(SMOOTHING * scale_s / dt_s), 1)
    blocks = error.size // width
    if blocks * width * dt_s < 10.0 * scale_s:
        return None
    x, use = _averaged(error, good, blocks, width)
    if use.sum() < 2:
        return None
    x[use] -= x[use].mean()
    r = _products(x)
    n = np.arange(blocks, 0, -1.0) if use.all() else _products(use.astype(np.float64))
    if not r[0] > 0.0:
        return None
    known = n > 0.05 * n[0]
    under = np.flatnonzero(known & (r / np.maximum(n, 1.0) < math.exp(-1.0) * r[0] / n[0]))
    return float(under[0] if under.size else known.sum()) * width * dt_s
