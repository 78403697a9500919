"""Spectra, correlations and harmonics against closed forms and slow twins."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import sawtooth, square

from identification.signals.correlation import autocorrelation, rhythm
from identification.signals.spectrum import (
    band_signal,
    bands,
    locked_harmonic,
    peak_prominence,
    spectrum,
    tapered_power,
    without_line,
)

N = 20_000
PERIOD = 173.0
T = np.arange(N)


def noise(seed: int, n: int = N) -> np.ndarray:
    """White noise of unit variance, shape (n,)."""
    return np.random.default_rng(seed).standard_normal(n)


@pytest.mark.parametrize("power", [0.0, -1.0, -2.0, -3.0])
def test_a_power_law_has_no_peak(power):
    """A spectrum f^p has prominence 1 at every frequency, within the widths of the averages."""
    lines = np.arange(1, 4001, dtype=float) ** power
    found = bands(np.concatenate(([lines[0]], lines)), 40.0)
    inside = found.line < 4000 / 4
    assert found.prominence[inside] == pytest.approx(1.0, rel=0.25)
    assert found.prominence[inside].max() / found.prominence[inside].min() < 1.06


def test_prominence_of_one_frequency_is_that_of_the_scan():
    """peak_prominence at a trial frequency is what the scan over all frequencies says there."""
    power = tapered_power(spectrum(noise(1) + np.sin(2 * np.pi * T / PERIOD), 1.0))
    found = bands(power, 3.0)
    for k in range(0, found.line.size, 7):
        assert peak_prominence(power, float(found.line[k])) == pytest.approx(found.prominence[k])


def test_prominence_of_a_sine_grows_with_the_square_of_its_amplitude():
    """Twice the amplitude has four times the power in the peak, and the surroundings stay as they are."""
    small, large = (
        peak_prominence(
            tapered_power(spectrum(noise(2) + a * np.sin(2 * np.pi * T / PERIOD), 1.0)), N / PERIOD
        )
        for a in (2.0, 4.0)
    )
    assert large / small == pytest.approx(4.0, rel=0.03)


def test_taper_of_the_lines_is_the_taper_of_the_signal():
    """Tapering by neighbouring lines gives the power of the Hann-tapered signal."""
    x = without_line(noise(3, 4096))
    s = spectrum(x, 1.0)
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(4096) / 4096)
    slow = np.abs(np.fft.rfft(hann * without_line(x))) ** 2
    assert tapered_power(s)[1:-1] == pytest.approx(slow[1:-1], rel=1e-6, abs=1e-6 * slow.max())


def test_line_is_removed_exactly():
    """A straight line leaves nothing, and what is left of a signal has no mean and no slope."""
    assert np.abs(without_line(3.0 - 0.2 * T)).max() < 1e-8
    left = without_line(noise(4) + 0.01 * T)
    assert np.polyfit(T, left, 1) == pytest.approx([0.0, 0.0], abs=1e-9)


def test_variance_is_that_of_the_signal_without_its_line():
    """The variance of a spectrum agrees with Parseval's sum over its lines."""
    s = spectrum(noise(5), 1.0)
    assert 2 * np.sum(np.abs(s.lines[1:]) ** 2) / s.n**2 == pytest.approx(s.variance, rel=1e-3)


def test_autocorrelation_agrees_with_slow_twin():
    """Unbiased autocorrelation as numpy.correlate computes it, lag by lag."""
    x = noise(6, 700) + np.sin(2 * np.pi * np.arange(700) / 31)
    slow = np.correlate(x, x, mode="full")[699:] / (700 - np.arange(700))
    assert autocorrelation(x, 200) == pytest.approx(slow[:201] / slow[0], abs=1e-12)


def test_autocorrelation_of_nothing_is_nothing():
    """A signal of zeros has an autocorrelation of zeros, not of NaN."""
    assert not autocorrelation(np.zeros(100), 10).any()


@pytest.mark.parametrize(
    ("wave", "expected"),
    [
        (sawtooth(2 * np.pi * T / PERIOD, 0.5), 1 / 9),
        (square(2 * np.pi * T / PERIOD), 1 / 3),
        (np.sin(2 * np.pi * T / PERIOD), 0.0),
    ],
    ids=["triangle", "square", "sine"],
)
def test_locked_harmonic_of_known_waves(wave, expected):
    """The third harmonic of a triangle is 1/9 of the fundamental, of a square 1/3, of a sine 0, in noise too."""
    for clean in (wave, wave + 0.2 * noise(7)):
        assert locked_harmonic(spectrum(clean, 1.0), PERIOD) == pytest.approx(expected, abs=0.015)


def test_harmonic_that_is_not_locked_counts_little():
    """A sine and another near three times its frequency, whose phase slides, have no locked harmonic."""
    other = 0.3 * np.sin(2 * np.pi * T * 3.02 / PERIOD)
    assert locked_harmonic(spectrum(np.sin(2 * np.pi * T / PERIOD) + other, 1.0), PERIOD) < 0.05


def test_band_signal_of_a_sine_is_the_sine():
    """The band about a sine returns its power and none of the noise outside the band."""
    s = spectrum(2 * np.sin(2 * np.pi * T / PERIOD) + 0.01 * noise(8), 1.0)
    x, dt = band_signal(s, s.duration_s / PERIOD)
    assert np.mean(x**2) == pytest.approx(2.0, rel=0.01)
    assert x.size * dt == pytest.approx(s.duration_s)


def test_regularity_is_large_for_a_sine_and_small_for_noise():
    """Thornhill's regularity of a sine is far beyond 1; that of broad noise, not band-passed, is below 1."""
    assert rhythm(np.sin(2 * np.pi * T / PERIOD), 1.0, PERIOD).regularity > 10
    assert rhythm(noise(9), 1.0, PERIOD).regularity < 1


def test_rhythm_of_a_sine():
    """A sine comes back after its period with correlation 1 and turns to -1 in between."""
    found = rhythm(np.sin(2 * np.pi * T / PERIOD), 1.0, 180.0)
    assert found.period_s == pytest.approx(PERIOD, rel=1e-3)
    assert [found.first, found.third, found.trough] == pytest.approx([1.0] * 3, abs=0.01)
