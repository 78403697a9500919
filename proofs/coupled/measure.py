"""Periods, rhythms and spreads of trends."""

from __future__ import annotations

import numpy as np

SLOWEST = 6
"""Least number of cycles in a record; slower components are drift and not used in autocorrelations."""
ENOUGH = 0.75
"""The period is the first peak of at least this share of the highest peak; later peaks are its multiples."""

BLOCKS = 6
"""Significant bits of the record length that are kept, because transforms of prime lengths are slow."""


def correlations(x: np.ndarray) -> np.ndarray:
    """Autocorrelation at lags up to a quarter of the record, without drift, shape (about n / 4,)."""
    x = x[: x.size - x.size % (1 << max(x.size.bit_length() - BLOCKS, 0))]
    n = x.size
    f = np.fft.rfft(x - x.mean())
    f[:SLOWEST] = 0
    g = np.fft.rfft(np.fft.irfft(f, n), 2 * n)
    r = np.fft.irfft(np.abs(g) ** 2)[: n // 4]
    return r / max(r[0], 1e-300) * n / (n - np.arange(r.size))


def returning(x: np.ndarray) -> tuple[float, float]:
    """Lag [samples] and height of the first returning peak of the autocorrelation; 0, 0: none."""
    r = correlations(x)
    below = np.flatnonzero(r < 0)
    if not below.size:
        return 0.0, 0.0
    inner = np.arange(max(int(below[0]), 1), r.size - 1)
    peaks = inner[(r[inner] >= r[inner - 1]) & (r[inner] > r[inner + 1])]
    if not peaks.size or r[peaks].max() <= 0:
        return 0.0, 0.0
    at = int(peaks[np.argmax(r[peaks] >= ENOUGH * r[peaks].max())])
    near = slice(max(at - max(at // 8, 1), 1), at + max(at // 8, 1) + 1)
    at = near.start + int(np.argmax(r[near]))
    return _vertex(r, at), min(float(r[at]), 1.0)


def _vertex(r: np.ndarray, at: int) -> float:
    """Position of the vertex of the parabola through a peak and its neighbours."""
    if not 0 < at < r.size - 1:
        return float(at)
    bend = r[at - 1] - 2 * r[at] + r[at + 1]
    return at + (0.5 * (r[at - 1] - r[at + 1]) / bend if bend < 0 else 0.0)


def period(x: np.ndarray) -> float:
    """Period [samples]: the returning peak, refined by its multiples while these are distinct; 0: none."""
    first, height = returning(x)
    if first <= 0:
        return 0.0
    r, best = correlations(x), first
    for multiple in range(2, 9):
        half = max(int(0.2 * best), 1)
        low = round(multiple * best) - half
        if low + 2 * half + 2 > r.size:
            break
        at = low + int(np.argmax(r[low : low + 2 * half + 1]))
        if r[at] < 0.5 * height:
            break
        best = _vertex(r, at) / multiple
    return best


def spread(x: np.ndarray) -> np.ndarray:
    """Standard deviation of each column, never zero."""
    return np.maximum(np.std(x, axis=0), 1e-9)


def lasting(x: np.ndarray, cycle: float, least: float) -> float:
    """Share of sections of four periods [samples] in which the spread of a trend is `least` or more."""
    pieces = np.array_split(x, max(int(x.size / (4 * cycle)), 1))
    return float(np.mean([np.std(piece) >= least for piece in pieces]))
