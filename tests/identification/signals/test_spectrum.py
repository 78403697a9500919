"""Spectra, correlations and harmonics against closed forms and slow implementations."""

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
    """peak_prominence at a trial frequency equals the result of the scan over all frequencies."""
    power = tapered_power(spectrum(noise(1) + np.sin(2 * np.pi * T / PERIOD), 1.0))
    found = bands(power, 3.0)
    for k in range(0, found.line.size, 7):
        assert peak_prominence(power, float(found.line[k])) == pytest.approx(found.prominence[k])


def test_prominence_of_a_sine_grows_with_the_square_of_its_amplitude():
    """Twice the amplitude gives four times the power in the peak and does not change the surroundings."""
    small, large = (
        peak_prominence(
            tapered_power(spectrum(noise(2) + a * np.sin(2 * np.pi * T / PERIOD), 1.0)), N / PERIOD
        )
        for a in (2.0, 4.0)
    )
    assert large / small == pytest.approx(4.0, rel=0.03)


def test_taper_of_the_lines_is_the_taper_of_the_signal():
    """A taper by neighbouring lines gives the power of the Hann-tapered signal."""
    x = without_line(noise(3, 4096))
    s = spectrum(x, 1.0)
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(4096) / 4096)
    slow = np.abs(np.fft.rfft(hann * without_line(x))) ** 2
    assert tapered_power(s)[1:-1] == pytest.approx(slow[1:-1], rel=1e-6, abs=1e-6 * slow.max())


def test_line_is_removed_exactly():
    """A straight line is removed without a residual, and the residual of a signal has no mean and no slope."""
    assert np.abs(without_line(3.0 - 0.2 * T)).max() < 1e-8
    residual = without_line(noise(4) + 0.01 * T)
    assert np.polyfit(T, residual, 1) == pytest.approx([0.0, 0.0], abs=1e-9)


def test_variance_is_that_of_the_signal_without_its_line():
    """The variance of a spectrum agrees with Parseval's sum over its lines."""
    s = spectrum(noise(5), 1.0)
    assert 2 * np.sum(np.abs(s.lines[1:]) ** 2) / s.n**2 == pytest.approx(s.variance, rel=1e-3)


def test_autocorrelation_agrees_with_a_slow_implementation():
    """The unbiased autocorrelation agrees with numpy.correlate, lag by lag."""
    x = noise(6, 700) + np.sin(2 * np.pi * np.arange(700) / 31)
    slow = np.correlate(x, x, mode="full")[699:] / (700 - np.arange(700))
    assert autocorrelation(x, 200) == pytest.approx(slow[:201] / slow[0], abs=1e-12)


def test_autocorrelation_of_zeros_is_zero():
    """A signal of zeros has an autocorrelation of zeros, not of NaN."""
    assert not autocorrelation(np.zeros(100), 10).any()


@pytest.mark.parametrize(
    ("waveform", "expected"),
    [
        (sawtooth(2 * np.pi * T / PERIOD, 0.5), 1 / 9),
        (square(2 * np.pi * T / PERIOD), 1 / 3),
        (np.sin(2 * np.pi * T / PERIOD), 0.0),
    ],
    ids=["triangle", "square", "sine"],
)
def test_locked_harmonic_of_known_waveforms(waveform, expected):
    """The third harmonic of a triangle is 1/9 of the fundamental, of a square 1/3, and of a sine 0, also in
    noise."""
    for clean in (waveform, waveform + 0.2 * noise(7)):
        assert locked_harmonic(spectrum(clean, 1.0), PERIOD) == pytest.approx(expected, abs=0.015)


def test_harmonic_that_is_not_locked_is_small():
    """A sine and another one near three times its frequency, with a drifting phase, have no locked harmonic."""
    other = 0.3 * np.sin(2 * np.pi * T * 3.02 / PERIOD)
    assert locked_harmonic(spectrum(np.sin(2 * np.pi * T / PERIOD) + other, 1.0), PERIOD) < 0.05


def test_band_signal_of_a_sine_is_the_sine():
    """The band about a sine has its power and none of the noise outside the band."""
    s = spectrum(2 * np.sin(2 * np.pi * T / PERIOD) + 0.01 * noise(8), 1.0)
    x, dt = band_signal(s, s.duration_s / PERIOD)
    assert np.mean(x**2) == pytest.approx(2.0, rel=0.01)
    assert x.size * dt == pytest.approx(s.duration_s)


def test_regularity_is_large_for_a_sine_and_small_for_noise():
    """Thornhill's regularity is above 10 for a sine, and below 1 for broad noise without a band-pass filter."""
    assert rhythm(np.sin(2 * np.pi * T / PERIOD), 1.0, PERIOD).regularity > 10
    assert rhythm(noise(9), 1.0, PERIOD).regularity < 1


def test_rhythm_of_a_sine():
    """The autocorrelation of a sine is 1 after its period and -1 after half its period."""
    found = rhythm(np.sin(2 * np.pi * T / PERIOD), 1.0, 180.0)
    assert found.period_s == pytest.approx(PERIOD, rel=1e-3)
    assert [found.first, found.third, found.trough] == pytest.approx([1.0] * 3, abs=0.01)
