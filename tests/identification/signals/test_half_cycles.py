"""Half periods of signals whose half periods are known."""

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
    """Relative scatter of the periods: 1.48 median absolute deviations of their logarithm."""
    whole = np.log(halves[1:] + halves[:-1])
    return 1.4826 * np.median(np.abs(whole - np.median(whole)))


def test_a_sine_has_half_periods_of_constant_length():
    """Each half period of a sine of 60 s lasts 30 s within a sample, and the periods do not scatter."""
    found = half_cycles(2.0 * np.sin(2 * np.pi * T / 60), 1.0)
    assert found.size == pytest.approx(2 * N / 60, abs=2)
    assert np.abs(found - 30).max() <= 1.0
    assert scatter(found) < 0.01


def test_the_scatter_of_periods_is_that_of_their_lengths():
    """Half periods of independent log-normal length with a spread of 0.3 give periods with a scatter of 0.3 /
    sqrt 2."""
    lengths = 40 * np.exp(0.3 * np.random.default_rng(1).standard_normal(400))
    edges = np.concatenate(([0], np.cumsum(lengths)))
    phase = np.interp(np.arange(int(lengths.sum())), edges, 0.5 * np.arange(401))
    found = half_cycles(np.sin(2 * np.pi * phase), 1.0)
    assert scatter(found) == pytest.approx(0.3 / np.sqrt(2), rel=0.3)


def test_one_large_oscillation_does_not_hide_an_oscillation_of_levelled_halves():
    """A short oscillation of 40 times the amplitude hides the autocorrelation's peak, but not that of levelled
    half periods."""
    oscillation = np.sin(2 * np.pi * T / 60)
    burst = 40 * np.exp(-(((T - 3000) / 30.0) ** 2)) * np.sin(2 * np.pi * (T - 3000) / 90)
    assert rhythm(oscillation + burst, 1.0, 60.0).first < 0.5
    assert levelled_correlation(oscillation + burst, 1.0, 60.0) > 0.85


def test_levelling_does_not_change_a_sine():
    """The levelled correlation of a sine is its usual correlation."""
    x = np.sin(2 * np.pi * T / 60)
    assert levelled_correlation(x, 1.0, 60.0) == pytest.approx(rhythm(x, 1.0, 60.0).first, abs=0.02)


def test_of_gaussian_noise_usual_and_mean_prominence_agree():
    """On coloured Gaussian noise the median over time and the mean give the same prominence within 30 %."""
    ratio = []
    for seed in range(10):
        s = spectrum(lfilter([1], [1, -0.9], np.random.default_rng(seed).standard_normal(N)), 1.0)
        b = bands(tapered_power(s), 3.0)
        ks = [k for k in range(b.line.size) if 40 < b.line[k] < N / 12]
        ratio += [usual_prominence(s, float(b.line[k])) / float(b.prominence[k]) for k in ks]
    assert np.median(ratio) == pytest.approx(1.0, rel=0.3)


def test_a_short_slow_oscillation_hardly_lowers_the_usual_prominence():
    """A slow oscillation in a fifth of the time lowers the mean prominence by more than 90 %, and the usual one
    by less than 50 %."""
    x = np.sin(2 * np.pi * T / 100) + 0.5 * np.random.default_rng(3).standard_normal(N)
    burst = 8 * np.exp(-(((T - 3000) / 400.0) ** 2)) * np.sin(2 * np.pi * T / 220)
    results = []
    for signal in (x, x + burst):
        s = spectrum(signal, 1.0)
        b = bands(tapered_power(s), 3.0)
        k = int(np.argmin(np.abs(b.line - N / 100)))
        results.append((float(b.prominence[k]), usual_prominence(s, N / 100)))
    assert results[1][0] < 0.1 * results[0][0]
    assert results[1][1] > 0.5 * results[0][1]


@pytest.mark.parametrize(
    ("waveform", "kurtosis"),
    [(np.sign, 1.0), (np.asarray, 1.5), (lambda x: np.arcsin(np.clip(x, -1, 1)), 1.8)],
    ids=["square", "sine", "triangle"],
)
def test_the_kurtosis_of_a_waveform_is_that_of_theory(waveform, kurtosis):
    """A square has a kurtosis of 1, a sine 1.5, a triangle 1.8, within 15 % (the band removes a square's
    edges)."""
    found = shape(spectrum(waveform(np.sin(2 * np.pi * T / 300 + 0.01)), 1.0), N / 300)
    assert found.kurtosis == pytest.approx(kurtosis, rel=0.15)
    assert found.spread < 0.1


def test_noise_of_any_colour_has_the_kurtosis_of_gaussian_noise():
    """Coloured noise has a kurtosis of 3 within 0.3, as the mean over bands and seeds."""
    found = []
    for seed in range(10):
        s = spectrum(lfilter([1], [1, -0.97], np.random.default_rng(seed).standard_normal(N)), 1.0)
        found += [shape(s, line).kurtosis for line in (30.0, 60.0, 120.0)]
    assert np.mean(found) == pytest.approx(3.0, abs=0.3)


def test_the_band_of_a_record_of_few_samples_is_finite():
    """With sixteen samples the usual prominence and the levelled correlation are finite."""
    s = spectrum(np.random.default_rng(4).standard_normal(16), 1.0)
    assert np.isfinite(usual_prominence(s, 3.0))
    assert np.isfinite(levelled_correlation(*band_signal(s, 3.0), 16 / 3.0))


def test_a_sine_keeps_its_size_and_noise_through_a_resonance_does_not():
    """The band about a sine with a random phase has a kurtosis of 1.5, and about noise through a resonance 3."""
    wander = np.cumsum(0.1 * np.random.default_rng(5).standard_normal(N))
    sine = np.sin(2 * np.pi * T / 60 + wander)
    assert size_kurtosis(spectrum(sine, 1.0), N / 60) == pytest.approx(1.5, abs=0.2)
    results = []
    for seed in range(10):
        radius, turn = 0.985, 2 * np.pi / 60
        noise = np.random.default_rng(seed).standard_normal(N)
        resonant = lfilter([1], [1, -2 * radius * np.cos(turn), radius**2], noise)
        results.append(size_kurtosis(spectrum(resonant, 1.0), N / 60))
    assert np.mean(results) == pytest.approx(3.0, abs=0.4)
