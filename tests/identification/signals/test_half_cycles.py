"""Half-cycles of signals whose half-cycles are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.signals.correlation import levelled_correlation, rhythm
from identification.signals.spectrum import (
    band_signal,
    bands,
    half_cycles,
    shape,
    size_kurtosis,
    spectrum,
    tapered_power,
    usual_prominence,
)

N = 6000
T = np.arange(N)


def scatter(halves):
    """Spread of whole cycles' lengths: 1.48 median absolute deviations of their logarithm."""
    whole = np.log(halves[1:] + halves[:-1])
    return 1.4826 * np.median(np.abs(whole - np.median(whole)))


def test_a_sine_has_half_cycles_of_half_its_period():
    """Each half-cycle of a sine of 60 s lasts 30 s within a sample, and whole ones do not scatter."""
    found = half_cycles(2.0 * np.sin(2 * np.pi * T / 60), 1.0)
    assert found.size == pytest.approx(2 * N / 60, abs=2)
    assert np.abs(found - 30).max() <= 1.0
    assert scatter(found) < 0.01


def test_the_scatter_of_cycles_is_that_of_their_lengths():
    """Halves of independent log-normal length with a spread of .3 make cycles with a scatter of .3 / sqrt 2."""
    lengths = 40 * np.exp(0.3 * np.random.default_rng(1).standard_normal(400))
    edges = np.concatenate(([0], np.cumsum(lengths)))
    phase = np.interp(np.arange(int(lengths.sum())), edges, 0.5 * np.arange(401))
    found = half_cycles(np.sin(2 * np.pi * phase), 1.0)
    assert scatter(found) == pytest.approx(0.3 / np.sqrt(2), rel=0.3)


def test_one_large_swing_does_not_hide_a_cycle_once_halves_are_levelled():
    """A swing of 40 times the cycle's size takes the autocorrelation's peak away, not that of levelled halves."""
    cycle = np.sin(2 * np.pi * T / 60)
    swing = 40 * np.exp(-(((T - 3000) / 30.0) ** 2)) * np.sin(2 * np.pi * (T - 3000) / 90)
    assert rhythm(cycle + swing, 1.0, 60.0).first < 0.5
    assert levelled_correlation(cycle + swing, 1.0, 60.0) > 0.85


def test_levelling_leaves_a_sine_as_it_is():
    """The levelled correlation of a sine is its plain one."""
    x = np.sin(2 * np.pi * T / 60)
    assert levelled_correlation(x, 1.0, 60.0) == pytest.approx(rhythm(x, 1.0, 60.0).first, abs=0.02)


def test_of_gaussian_noise_usual_and_mean_prominence_agree():
    """On coloured Gaussian noise the median over time tells the same prominence as the mean, within 15 %."""
    ratio = []
    for seed in range(10):
        s = spectrum(lfilter([1], [1, -0.9], np.random.default_rng(seed).standard_normal(N)), 1.0)
        b = bands(tapered_power(s), 3.0)
        ks = [k for k in range(b.line.size) if 40 < b.line[k] < N / 12]
        ratio += [usual_prominence(s, float(b.line[k])) / float(b.prominence[k]) for k in ks]
    assert np.median(ratio) == pytest.approx(1.0, rel=0.3)


def test_a_passing_swing_does_not_fill_the_surroundings_of_a_cycle():
    """A slow swing in a fifth of the time takes nine tenths of a cycle's mean prominence, half of its usual one."""
    x = np.sin(2 * np.pi * T / 100) + 0.5 * np.random.default_rng(3).standard_normal(N)
    swing = 8 * np.exp(-(((T - 3000) / 400.0) ** 2)) * np.sin(2 * np.pi * T / 220)
    told = []
    for signal in (x, x + swing):
        s = spectrum(signal, 1.0)
        b = bands(tapered_power(s), 3.0)
        k = int(np.argmin(np.abs(b.line - N / 100)))
        told.append((float(b.prominence[k]), usual_prominence(s, N / 100)))
    assert told[1][0] < 0.1 * told[0][0]
    assert told[1][1] > 0.5 * told[0][1]


@pytest.mark.parametrize(
    ("wave", "kurtosis"),
    [(np.sign, 1.0), (np.asarray, 1.5), (lambda x: np.arcsin(np.clip(x, -1, 1)), 1.8)],
    ids=["square", "sine", "triangle"],
)
def test_the_kurtosis_of_a_wave_is_that_of_theory(wave, kurtosis):
    """A square has 1, a sine 1.5, a triangle 1.8, within 15 % (the band cuts a square's edges)."""
    found = shape(spectrum(wave(np.sin(2 * np.pi * T / 300 + 0.01)), 1.0), N / 300)
    assert found.kurtosis == pytest.approx(kurtosis, rel=0.15)
    assert found.spread < 0.1


def test_noise_has_the_kurtosis_of_gaussian_noise_whatever_its_colour():
    """Coloured noise has a kurtosis of 3 within .3 in the mean over bands and seeds."""
    found = []
    for seed in range(10):
        s = spectrum(lfilter([1], [1, -0.97], np.random.default_rng(seed).standard_normal(N)), 1.0)
        found += [shape(s, line).kurtosis for line in (30.0, 60.0, 120.0)]
    assert np.mean(found) == pytest.approx(3.0, abs=0.3)


def test_the_band_of_a_record_of_few_samples_is_told():
    """Sixteen samples are enough for both signs to be finite."""
    s = spectrum(np.random.default_rng(4).standard_normal(16), 1.0)
    assert np.isfinite(usual_prominence(s, 3.0))
    assert np.isfinite(levelled_correlation(*band_signal(s, 3.0), 16 / 3.0))


def test_a_sine_keeps_its_size_and_noise_through_a_resonance_does_not():
    """The band about a sine of wandering phase has a kurtosis of 1.5, about noise through a resonance of 3."""
    wander = np.cumsum(0.1 * np.random.default_rng(5).standard_normal(N))
    sine = np.sin(2 * np.pi * T / 60 + wander)
    assert size_kurtosis(spectrum(sine, 1.0), N / 60) == pytest.approx(1.5, abs=0.2)
    told = []
    for seed in range(10):
        radius, turn = 0.985, 2 * np.pi / 60
        noise = np.random.default_rng(seed).standard_normal(N)
        swung = lfilter([1], [1, -2 * radius * np.cos(turn), radius**2], noise)
        told.append(size_kurtosis(spectrum(swung, 1.0), N / 60))
    assert np.mean(told) == pytest.approx(3.0, abs=0.4)
