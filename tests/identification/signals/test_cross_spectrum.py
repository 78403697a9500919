"""Coherence, lag and drift of two signals against a slow twin, theory and signals whose answer is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from identification.signals.cross_spectrum import (
    band,
    chance_coherence,
    coherences,
    drift,
    lag,
    tapered,
)
from identification.signals.spectrum import spectrum

N, PERIOD = 20_000, 100.0
LINE = N / PERIOD


def walking(seed: int, walk: float = 0.03) -> np.ndarray:
    """A wave whose phase walks, shape (N,)."""
    rng = np.random.default_rng(seed)
    return np.sin(2 * np.pi * np.arange(N) / PERIOD + np.cumsum(walk * rng.standard_normal(N)))


def lines(x: np.ndarray) -> np.ndarray:
    """Tapered lines of a signal from number 1 on."""
    return tapered(spectrum(x, 1.0).lines)


def coherence_of(x: np.ndarray, y: np.ndarray, shift: int = 0) -> float:
    """Coherence of two stretches of lines from number 1 on."""
    flat, count = np.concatenate((x, y)), np.array([x.size, y.size])
    offset, first = np.array([0, x.size]), np.array([1, 1])
    span = np.array(band(LINE))
    return float(coherences(flat, offset, first, count, 0, np.array([1]), span, shift)[0])


@pytest.mark.parametrize("shift", [0, 5, -7])
def test_coherence_is_that_of_a_slow_twin(shift):
    """The kernel's coherence is, piece by piece, what the textbook's formula gives."""
    rng = np.random.default_rng(1)
    x = lines(walking(1))
    y = lines(walking(1) + 0.5 * rng.standard_normal(N))
    low, high, width = band(LINE)
    edges = [low + (high - low) * p // ((high - low) // width) for p in range((high - low) // width + 1)]
    shared = whole = 0.0
    for a, b in pairwise(edges):
        u, v = x[a - 1 : b - 1], y[a - 1 + shift : b - 1 + shift]
        shared += abs(np.vdot(v, u)) ** 2
        whole += np.vdot(u, u).real * np.vdot(v, v).real
    assert coherence_of(x, y, shift) == pytest.approx(shared / whole, rel=1e-9)


def test_a_filter_and_a_delay_do_not_part_two_signals():
    """A wave and the same wave a period and a half later at another size are coherent, and two walkers are not."""
    x = walking(2)
    assert coherence_of(lines(x), lines(0.2 * np.roll(x, 150))) > 0.95
    assert coherence_of(lines(x), lines(walking(3))) < 0.5


@pytest.mark.parametrize(("count", "width"), [(8, 8), (16, 8), (40, 8), (60, 12)])
def test_chance_reaches_what_theory_says(count, width):
    """Of tapered white lines without anything in common, two in a hundred exceed the coherence for 2 %."""
    rng = np.random.default_rng(4)
    least, trials = chance_coherence(count, width, 0.02), 20_000
    raw = rng.standard_normal((2, trials, count + 2)) + 1j * rng.standard_normal((2, trials, count + 2))
    x, y = raw[..., 1:-1] - 0.5 * (raw[..., :-2] + raw[..., 2:])
    edges = np.arange(count // width) * count // (count // width)
    shared = np.abs(np.add.reduceat(x * y.conj(), edges, axis=1)) ** 2
    whole = np.add.reduceat(np.abs(x) ** 2, edges, axis=1) * np.add.reduceat(np.abs(y) ** 2, edges, axis=1)
    over = float(np.mean(shared.sum(axis=1) / whole.sum(axis=1) > least))
    assert 0.005 < over < 0.05


@pytest.mark.parametrize("late", [-60, 0, 35, 140])
def test_the_lag_is_the_delay(late):
    """The lag of a delayed wave with noise is its delay within three of the deviations told, and those are useful."""
    rng = np.random.default_rng(5)
    x = walking(6)
    y = np.roll(x, late) + 0.2 * rng.standard_normal(N)
    low, high, _ = band(LINE)
    found = lag(lines(x)[low - 1 : high - 1], lines(y)[low - 1 : high - 1], N, 400.0)
    assert abs(found.lag_s - late) < max(3 * found.deviation_s, 10.0)
    assert found.deviation_s < 30.0
    assert found.coherence > 0.9


def test_a_steady_wave_tells_no_lag():
    """The lag of a wave without any wandering has a deviation of many periods."""
    t = np.arange(N)
    x, y = np.sin(2 * np.pi * t / PERIOD), np.sin(2 * np.pi * (t - 35) / PERIOD)
    low, high, _ = band(LINE)
    cut = slice(low - 1, high - 1)
    rng = np.random.default_rng(8)
    x, y = x + 0.3 * rng.standard_normal(N), y + 0.3 * rng.standard_normal(N)
    assert lag(lines(x)[cut], lines(y)[cut], N, 400.0).deviation_s > 30.0


@pytest.mark.parametrize("turns", [0.0, 0.5, 1.0, 2.0])
def test_drift_is_the_difference_of_frequencies(turns):
    """Two walks that are one but for a frequency a line or so apart drift by as many turns."""
    x = 2 * np.pi * np.arange(N) / PERIOD
    rng = np.random.default_rng(9)
    walk = np.cumsum(0.005 * rng.standard_normal(N))
    apart = 2 * np.pi * turns * np.arange(N) / N
    low, high, _ = band(LINE)
    one, other = (spectrum(np.sin(p), 1.0).lines[low:high] for p in (x + walk, x + walk + apart))
    assert abs(drift(one, other[None])[0]) == pytest.approx(turns, abs=0.1)
