"""The loop's own band: what its model speaks of is kept, slow load and ramps are not."""

from __future__ import annotations

import numpy as np
import pytest

from identification.controller.check import StatedSettings
from identification.mismatch.recording import Recording
from identification.signals.filters import in_band

T = np.arange(6000.0)
MIDDLE = slice(1000, 5000)


def sine(period: float) -> np.ndarray:
    """A sine of amplitude 1 and that period [samples]."""
    return np.sin(2 * np.pi * T / period)


@pytest.mark.parametrize("period", [40.0, 100.0])
def test_a_cycle_and_its_harmonics_are_kept(period: float) -> None:
    """Within the band a sine keeps its size and its phase, for the filter runs both ways."""
    assert np.abs(in_band(sine(period), 12.5, 200.0) - sine(period))[MIDDLE].max() < 0.08


@pytest.mark.parametrize("slow", [sine(3000.0), 0.01 * T, np.full(T.size, 7.0)])
def test_a_slow_load_is_none_of_it(slow: np.ndarray) -> None:
    """A sine of fifteen times the longest period, a ramp and a constant leave less than a hundredth."""
    assert np.abs(in_band(slow, 12.5, 200.0))[MIDDLE].max() < 0.01 * max(np.ptp(slow), 1.0)


def test_faster_noise_is_none_of_it_where_the_cycle_bounds_it() -> None:
    """Of a sine of a third of the shortest period less than a fiftieth is left; without a shortest it stays."""
    fast = sine(4.0)
    assert np.abs(in_band(fast, 12.5, 200.0))[MIDDLE].max() < 0.02
    assert np.abs(in_band(fast, 2.0, 200.0) - fast)[MIDDLE].max() < 0.02


def test_the_band_follows_from_cycle_or_integral_time() -> None:
    """An eighth to two of a cycle's periods; without a cycle up to four integral times; with neither none."""
    x = np.zeros(1000)
    given = (None, x, x, x == 0.0, 2.0, x)
    stated = StatedSettings(1.0, 20.0, 1.0)
    assert Recording(*given, period_s=160.0, stated=stated).band == (10.0, 160.0)
    assert Recording(*given, stated=stated).band == (2.0, 80.0)
    assert Recording(*given).band is None
    assert Recording(*given, stated=StatedSettings(1.0, np.inf, 1.0)).band is None
