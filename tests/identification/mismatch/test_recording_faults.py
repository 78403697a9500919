"""Faults of the recorder in the trends."""

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
    """The finding of a catalogue fault in a trend with one sample per second."""
    n = pv.size
    stamps = np.arange(n, dtype=float) if stamps is None else stamps
    find = fault(name).find
    assert find is not None
    return find(Recording(None, pv, np.zeros(n), np.ones(n, dtype=bool), 1.0, stamps))


def test_fault_free_recording_has_no_finding() -> None:
    """A trend rounded to 0.01 or 0.05 % is not reported as compressed, quantized, clipped or badly sampled."""
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
    """A transmitter limit of 54 % is found at this value."""
    found = found_in("sensor-clipping", np.minimum(PV, 54.0))
    assert found is not None
    assert found.values["clip_pct"] == 54.0


def test_scattered_polling_is_found() -> None:
    """Time stamps that scatter by 8 % of a sample are reported as jitter of the polling."""
    found = found_in("sampling", stamps=TICKS + np.random.default_rng(0).normal(0, 0.08, PV.size))
    assert found is not None
    assert set(found.values) == {"jitter_samples"}


def test_samples_in_a_gap_are_marked() -> None:
    """Only the samples in a gap between two time stamps are marked, and none if the time stamps are complete."""
    stamps = np.arange(100.0)[np.r_[0:40, 47:100]] * 2.0 + 7.0
    found = unlogged(stamps, 100, 2.0)
    assert np.array_equal(np.flatnonzero(found), np.arange(40, 47))
    assert not unlogged(np.arange(100.0) * 2.0 + np.random.default_rng(0).normal(0, 0.3, 100), 100, 2.0).any()


def test_the_grid_step_is_found_where_values_are_missing() -> None:
    """For a PV that stays at two set points and passes between them, the step is that of its grid, not the mean
    distance."""
    rng = np.random.default_rng(2)
    at_two_levels = np.where(np.arange(12_000) % 4000 < 2000, 40.0, 60.0) + 0.3 * rng.standard_normal(12_000)
    ramp = np.linspace(40.0, 60.0, 30)
    pv = np.round(np.concatenate((at_two_levels, ramp)) / 0.4) * 0.4
    found = found_in("quantization", pv)
    assert found is not None
    assert found.values["step_pct"] == pytest.approx(0.4, rel=0.01)


def with_stick(signal: np.ndarray, grip: float, grid: float) -> np.ndarray:
    """A sensor that follows only after a deviation of `grip`, recorded in steps of `grid`."""
    out, shown = np.empty(signal.size), signal[0]
    for k, value in enumerate(signal):
        shown = value if abs(value - shown) >= grip else shown
        out[k] = np.round(shown / grid) * grid
    return out


def test_a_sensor_that_sticks_and_jumps_is_found() -> None:
    """A PV that moves only after a deviation of 1 % is reported with this value. Noise, a coarse grid and few
    steps of SP are not reported."""
    rng = np.random.default_rng(3)
    signal = 50.0 + 6.0 * np.sin(np.arange(6000) / 90.0) + 0.1 * rng.standard_normal(6000)
    assert least_jump(with_stick(signal, 1.0, 0.01)) == pytest.approx(1.0, abs=0.1)
    stairs = np.repeat(50.0 + 5.0 * rng.standard_normal(12), 500)
    for fault_free in (signal, np.round(signal, 1), np.round(signal / 2.0) * 2.0, np.round(stairs, 2)):
        assert least_jump(fault_free) == 0.0
