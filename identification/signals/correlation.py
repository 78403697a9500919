"""Autocorrelation of a signal: periodicity, correlation time, and the minimum variance of a controller."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from identification.record import Floats, Mask

LEVEL = 1.5
"""Size to which every half-cycle is clipped, in medians of the band's absolute value: a sine is not clipped
(its peak is 1.41 medians), only what exceeds the loop's usual half-cycles."""
SMOOTHING = 0.1
"""Share of the loop's own time over which the error is averaged before its correlation time is computed,
because noise would shorten it."""
COARSEST = 0.2
"""Largest sample interval relative to the loop's own time; above it the noise of one sample looks like
correlation."""
HARRIS_LAGS = 15  # Lags of the predictor of minimum variance
HARRIS_STEP = 6  # Samples per dead time that the error is thinned to: so that the lags span a few dead times
HARRIS_MOST = 4000  # Samples that the predictor uses at most, the latest [samples]
HARRIS_LEAST = 200  # Usable samples that it needs [samples]

CONSTANT = 1e-12
"""Share of its mean square below which an error's variance is rounding."""


def lag_sums(x: Floats, most: int) -> Floats:
    """Sums over x[k] x[k + lag] at lags 0 to most, shape (most + 1,)."""
    size = next_fast_len(x.size + most + 1, real=True)
    f = rfft(x, size)
    return irfft(f.real**2 + f.imag**2, size)[: most + 1]  # type: ignore[no-any-return]


def autocorrelation(x: Floats, most: int) -> Floats:
    """Unbiased autocorrelation at lags 0 to most, shape (most + 1,); zero for a zero signal."""
    r = lag_sums(x, most)
    return r / r[0] * x.size / (x.size - np.arange(most + 1)) if r[0] > 0 else np.zeros(most + 1)


def correlated(e: Floats) -> float:
    """Number of samples per independent one: one plus twice the sum of the autocorrelation up to its first negative
    value (Geyer 1992's initial positive sequence); 1 for white noise, all samples for a constant."""
    auto = lag_sums(e - e.mean(), e.size - 1)
    if not auto[0] > CONSTANT * float(e @ e):
        return float(e.size)
    rho = auto / auto[0]
    end = int(np.argmax(rho < 0.0)) if (rho < 0.0).any() else rho.size
    return float(1.0 + 2.0 * rho[1:end].sum())


@dataclass(frozen=True, slots=True)
class Rhythm:
    """Autocorrelation of one period.

    period_s : lag of the first peak [s]; first, third : heights of these peaks [-]; trough : depth of the first
    trough [-]; regularity : mean over three standard deviations of the zero crossings' intervals [-] (Thornhill,
    Huang, Zhang 2003).
    """

    period_s: float
    first: float
    third: float
    trough: float
    regularity: float


def _peak(r: Floats, low: float, high: float) -> tuple[float, float]:
    """Lag and height of the highest point between two lags, by parabola."""
    a, b = max(int(low), 1), min(int(high) + 2, r.size - 1)
    if b <= a:
        return float("nan"), 0.0
    k = a + int(np.argmax(r[a:b]))
    if k <= a or k + 1 >= r.size:
        return float(k), float(r[k])
    curve = r[k - 1] - 2 * r[k] + r[k + 1]
    shift = 0.5 * (r[k - 1] - r[k + 1]) / curve if curve < 0 else 0.0
    return k + float(np.clip(shift, -1, 1)), float(r[k])


def _regularity(r: Floats) -> float:
    """Mean over three standard deviations of the intervals between up to eleven zero crossings; 0: too few."""
    below = np.signbit(r)
    at = np.flatnonzero(below[1:] != below[:-1])
    if at.size < 4:
        return 0.0
    exact = at + r[at] / (r[at] - r[at + 1])
    gaps = np.diff(exact[:11])
    spread = float(gaps.std(ddof=1))
    return float(gaps.mean()) / max(3 * spread, 1e-3 * float(gaps.mean()))


def rhythm(x: Floats, dt_s: float, period_s: float) -> Rhythm:
    """Autocorrelation features of a band's signal, shape (m,), near the period of the expected peak."""
    lag = period_s / dt_s
    r = autocorrelation(x, min(x.size - 2, int(6 * lag) + 2))
    at, first = _peak(r, 0.6 * lag, 1.45 * lag)
    if not math.isfinite(at):
        return Rhythm(period_s, 0.0, 0.0, 0.0, 0.0)
    trough = -float(r[int(0.25 * at) : int(0.75 * at) + 2].min())
    third = _peak(r, 2.75 * at, 3.25 * at)[1]
    return Rhythm(at * dt_s, first, third, trough, _regularity(r))


def levelled_correlation(x: Floats, dt_s: float, period_s: float) -> float:
    """Autocorrelation of a band's signal at one period after limiting half-cycles to the usual size [-].

    The lesser of the first peak and 1.5 times the trough before it. One load step, which the band filter turns into a
    few large swings, hides a cycle of many half-cycles from the ordinary autocorrelation, but not from this one.
    """
    usual = float(np.median(np.abs(x)))
    if usual <= 0.0:
        return 0.0
    found = rhythm(np.clip(x, -LEVEL * usual, LEVEL * usual), dt_s, period_s)
    return min(found.first, 1.5 * found.trough)


def _averaged(error: Floats, good: Mask, blocks: int, width: int) -> tuple[Floats, Mask]:
    """Means of the good samples of each block, 0 if half of them are bad, and the other blocks, shape (blocks,)."""
    weight = good[: blocks * width].reshape(blocks, width).mean(axis=1)
    total = np.where(good, error, 0.0)[: blocks * width].reshape(blocks, width).mean(axis=1)
    use = weight > 0.5
    return np.where(use, total / np.where(use, weight, 1.0), 0.0), use


def correlation_time(error: Floats, good: Mask, dt_s: float, scale_s: float) -> float | None:
    """The time [s] after which the autocorrelation of the averaged error is below 1/e.

    After a load change, the error of a PI loop decays with its slowest pole. If Kp times the process gain is below
    one, its time constant is about Ti/(Kp K), longer than Ti: a correlation time of several integral times indicates
    sluggish control. With Kp K of 1.2 to 3 it is 0.5 to 1.7 Ti, with 0.45 and less 2 to 12 Ti, whether the load steps
    or wanders (tests/identification/signals/test_correlation_time.py).

    error, good : SP - PV and where it may be used, shape (n,); scale_s : the loop's own time [s], its integral time;
    the result has steps of a tenth of it. None if the record is shorter than ten of `scale_s`, samples are coarser
    than a fifth of it, or nothing moves.
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
    r = lag_sums(x, x.size - 1)
    n = np.arange(blocks, 0, -1.0) if use.all() else lag_sums(use.astype(np.float64), x.size - 1)
    if not r[0] > 0.0:
        return None
    known = n > 0.05 * n[0]
    under = np.flatnonzero(known & (r / np.maximum(n, 1.0) < math.exp(-1.0) * r[0] / n[0]))
    return float(under[0] if under.size else known.sum()) * width * dt_s


def harris_index(error: Floats, usable: Mask, dt_s: float, dead_time_s: float) -> float | None:
    """Minimum variance over variance of the error: 1 is minimum variance, 0 is far from it.

    The minimum variance is the residual of a predictor one dead time ahead (Harris 1989; estimated by regression as
    in Desborough, Harris 1992).

    error, usable : shape (n,). None where fewer than 200 samples are usable or the error is constant.
    """
    step = max(int(dead_time_s / HARRIS_STEP / dt_s), 1)
    e, use = error[::step][-HARRIS_MOST:], usable[::step][-HARRIS_MOST:]
    ahead = max(round(dead_time_s / (step * dt_s)), 1) + 1
    reach = ahead + HARRIS_LAGS
    n = e.size - reach
    if n < HARRIS_LEAST:
        return None
    e = e - e[use].mean() if use.any() else e
    rows = np.stack([e[reach - ahead - k : reach - ahead - k + n] for k in range(HARRIS_LAGS)])
    seen = np.concatenate(([0], np.cumsum(~use)))
    whole = seen[reach + 1 : reach + 1 + n] == seen[:n]
    y = e[reach : reach + n][whole]
    power = float(y @ y)
    if y.size < HARRIS_LEAST or power <= 0:
        return None
    x = rows[:, whole]
    gram = x @ x.T
    beta = np.linalg.solve(gram + 1e-9 * np.trace(gram) * np.eye(HARRIS_LAGS), x @ y)
    residual = y - beta @ x
    return float(np.clip(residual @ residual / power, 0.0, 1.0))
