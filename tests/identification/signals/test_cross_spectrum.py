"""Coherence, lag and drift of two signals against a slow implementation, theory and signals with known answers."""

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


def with_random_phase(seed: int, walk: float = 0.03) -> np.ndarray:
    """A sine with a random walk of its phase, shape (N,)."""
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
def test_coherence_agrees_with_a_slow_implementation(shift):
    """The kernel's coherence equals the textbook's formula, piece by piece."""
    rng = np.random.default_rng(1)
    x = lines(with_random_phase(1))
    y = lines(with_random_phase(1) + 0.5 * rng.standard_normal(N))
    low, high, width = band(LINE)
    edges = [low + (high - low) * p // ((high - low) // width) for p in range((high - low) // width + 1)]
    shared = whole = 0.0
    for a, b in pairwise(edges):
        u, v = x[a - 1 : b - 1], y[a - 1 + shift : b - 1 + shift]
        shared += abs(np.vdot(v, u)) ** 2
        whole += np.vdot(u, u).real * np.vdot(v, v).real
    assert coherence_of(x, y, shift) == pytest.approx(shared / whole, rel=1e-9)


def test_a_gain_and_a_delay_keep_two_signals_coherent():
    """A signal and its copy with another gain and a delay of 1.5 periods are coherent. Two independent signals
    are not."""
    x = with_random_phase(2)
    assert coherence_of(lines(x), lines(0.2 * np.roll(x, 150))) > 0.95
    assert coherence_of(lines(x), lines(with_random_phase(3))) < 0.5


@pytest.mark.parametrize(("count", "width"), [(8, 8), (16, 8), (40, 8), (60, 12)])
def test_chance_coherence_agrees_with_theory(count, width):
    """Of independent tapered white lines, about 2 % exceed the coherence limit for 2 %."""
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
    """The lag of a delayed signal with noise is its delay within three reported deviations, and these are below
    30 s."""
    rng = np.random.default_rng(5)
    x = with_random_phase(6)
    y = np.roll(x, late) + 0.2 * rng.standard_normal(N)
    low, high, _ = band(LINE)
    found = lag(lines(x)[low - 1 : high - 1], lines(y)[low - 1 : high - 1], N, 400.0)
    assert abs(found.lag_s - late) < max(3 * found.deviation_s, 10.0)
    assert found.deviation_s < 30.0
    assert found.coherence > 0.9


def test_a_sine_of_constant_frequency_gives_no_lag():
    """The lag of a sine of constant frequency has a deviation above 30 s."""
    t = np.arange(N)
    x, y = np.sin(2 * np.pi * t / PERIOD), np.sin(2 * np.pi * (t - 35) / PERIOD)
    low, high, _ = band(LINE)
    cut = slice(low - 1, high - 1)
    rng = np.random.default_rng(8)
    x, y = x + 0.3 * rng.standard_normal(N), y + 0.3 * rng.standard_normal(N)
    assert lag(lines(x)[cut], lines(y)[cut], N, 400.0).deviation_s > 30.0


@pytest.mark.parametrize("cycles", [0.0, 0.5, 1.0, 2.0])
def test_drift_is_the_difference_of_frequencies(cycles):
    """Two signals with a frequency difference of 0 to 2 lines drift by as many cycles."""
    x = 2 * np.pi * np.arange(N) / PERIOD
    rng = np.random.default_rng(9)
    walk = np.cumsum(0.005 * rng.standard_normal(N))
    apart = 2 * np.pi * cycles * np.arange(N) / N
    low, high, _ = band(LINE)
    one, other = (spectrum(np.sin(p), 1.0).lines[low:high] for p in (x + walk, x + walk + apart))
    assert abs(drift(one, other[None])[0]) == pytest.approx(cycles, abs=0.1)
