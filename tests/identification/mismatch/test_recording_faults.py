"""What the recorder does to trends."""

from __future__ import annotations

import numpy as np
import pytest

from identification.controller.check import Finding
from identification.mismatch.catalogue import fault
from identification.mismatch.recording import Recording, least_jump, unlogged
from tests.identification.recordings import recording

PV = recording(1).pv
TICKS = np.arange(PV.size, dtype=float)


def found_in(name: str, pv: np.ndarray = PV, stamps: np.ndarray | None = None) -> Finding | None:
    """What a fault of the catalogue finds in a trend sampled each second."""
    n = pv.size
    stamps = np.arange(n, dtype=float) if stamps is None else stamps
    find = fault(name).find
    assert find is not None
    return find(Recording(None, pv, np.zeros(n), np.ones(n, dtype=bool), 1.0, stamps))


def test_sound_recording_has_no_trace() -> None:
    """A trend rounded to 0.01 or 0.05 % is neither compressed, coarse, clipped nor badly sampled."""
    for step in (0.01, 0.05):
        pv = np.round(PV / step) * step
        assert found_in("compression", pv) is None
        assert found_in("quantization", pv) is None
        assert found_in("sensor-clipping", pv) is None
    assert found_in("sampling", stamps=TICKS + np.random.default_rng(0).normal(0, 0.01, PV.size)) is None


def test_coarse_converter_is_found_under_rounding() -> None:
    """Steps of 0.13 % are found although the historian rounds them to 0.02 %."""
    pv = np.round(np.round(PV / 0.13) * 0.13 / 0.02) * 0.02
    found = found_in("quantization", pv)
    assert found is not None
    assert abs(found.values["step_pct"] - 0.13) < 0.01


def test_clip_is_found_at_its_value() -> None:
    """A transmitter that ends at 54 % is found there, a peak that is only high is not."""
    found = found_in("sensor-clipping", np.minimum(PV, 54.0))
    assert found is not None
    assert found.values["clip_pct"] == 54.0


def test_scattered_polling_is_found() -> None:
    """Stamps that scatter by 8 % of a sample are the polling's."""
    found = found_in("sampling", stamps=TICKS + np.random.default_rng(0).normal(0, 0.08, PV.size))
    assert found is not None
    assert set(found.values) == {"jitter_samples"}


def test_samples_over_a_hole_are_unlogged() -> None:
    """Exactly the samples between two stamps that lie apart are marked, and none where the clock is full."""
    stamps = np.arange(100.0)[np.r_[0:40, 47:100]] * 2.0 + 7.0
    found = unlogged(stamps, 100, 2.0)
    assert np.array_equal(np.flatnonzero(found), np.arange(40, 47))
    assert not unlogged(np.arange(100.0) * 2.0 + np.random.default_rng(0).normal(0, 0.3, 100), 100, 2.0).any()


def test_the_grid_is_its_unit_where_values_are_left_out() -> None:
    """Of a PV that stands at two set points and passes between, the step is that of its grid, not the mean gap."""
    rng = np.random.default_rng(2)
    stand = np.where(np.arange(12_000) % 4000 < 2000, 40.0, 60.0) + 0.3 * rng.standard_normal(12_000)
    ramp = np.linspace(40.0, 60.0, 30)
    pv = np.round(np.concatenate((stand, ramp)) / 0.4) * 0.4
    found = found_in("quantization", pv)
    assert found is not None
    assert found.values["step_pct"] == pytest.approx(0.4, rel=0.01)


def standing(wave: np.ndarray, grip: float, grid: float) -> np.ndarray:
    """A sensor that follows only once it is `grip` off, recorded in steps of `grid`."""
    out, shown = np.empty(wave.size), wave[0]
    for k, value in enumerate(wave):
        shown = value if abs(value - shown) >= grip else shown
        out[k] = np.round(shown / grid) * grid
    return out


def test_a_sensor_that_stands_and_jumps_is_seen() -> None:
    """PV that moves only once it is 1 % off is told with that; noise, a coarse grid and few steps of SP are not."""
    rng = np.random.default_rng(3)
    wave = 50.0 + 6.0 * np.sin(np.arange(6000) / 90.0) + 0.1 * rng.standard_normal(6000)
    assert least_jump(standing(wave, 1.0, 0.01)) == pytest.approx(1.0, abs=0.1)
    stairs = np.repeat(50.0 + 5.0 * rng.standard_normal(12), 500)
    for sound in (wave, np.round(wave, 1), np.round(wave / 2.0) * 2.0, np.round(stairs, 2)):
        assert least_jump(sound) == 0.0
