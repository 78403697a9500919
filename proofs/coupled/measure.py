"""Periods, rhythms and spreads of trends."""

from __future__ import annotations

import numpy as np

SLOWEST = 6
"""Cycles in a record below which a swing is drift and left out of autocorrelations."""
ENOUGH = 0.75
"""The first peak of at least this share of the highest one is the period: later ones are its multiples."""

BLOCKS = 6
"""Bits kept of a record's length, as transforms of prime lengths are slow."""


def correlations(x: np.ndarray) -> np.ndarray:
    """Autocorrelation at lags up to a quarter of the record, drift left out, shape (about n / 4,)."""
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
    """Where the parabola through a peak and its neighbours turns."""
    if not 0 < at < r.size - 1:
        return float(at)
    bend = r[at - 1] - 2 * r[at] + r[at + 1]
    return at + (0.5 * (r[at - 1] - r[at + 1]) / bend if bend < 0 else 0.0)


def period(x: np.ndarray) -> float:
    """Period [samples]: the returning peak, made finer by its multiples as long as they stand out; 0: none."""
    first, height = returning(x)
    if first <= 0:
        return 0.0
    r, best = correlations(x), first
    for turns in range(2, 9):
        half = max(int(0.2 * best), 1)
        low = round(turns * best) - half
        if low + 2 * half + 2 > r.size:
            break
        at = low + int(np.argmax(r[low : low + 2 * half + 1]))
        if r[at] < 0.5 * height:
            break
        best = _vertex(r, at) / turns
    return best


def spread(x: np.ndarray) -> np.ndarray:
    """Standard deviation of each column, never zero."""
    return np.maximum(np.std(x, axis=0), 1e-9)


def lasting(x: np.ndarray, turn: float, least: float) -> float:
    """Share of stretches of four periods [samples] in which a trend is spread by `least` or more."""
    pieces = np.array_split(x, max(int(x.size / (4 * turn)), 1))
    return float(np.mean([np.std(piece) >= least for piece in pieces]))
