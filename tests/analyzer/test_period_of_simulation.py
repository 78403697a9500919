"""The period of a simulated loop, read from its autocorrelation, and none where nothing returns."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.loop.agreement import period_of
from identification.record import LoopRecord


def record(error: np.ndarray) -> LoopRecord:
    """A record whose error is given, its set point at rest."""
    n = error.size
    return LoopRecord("L", 0.0, 1.0, np.zeros(n), -error, np.zeros(n), np.zeros(n, dtype=bool))


def test_a_sine_has_its_period() -> None:
    """A sine of 50 samples in noise of a third of it has a period of 50 s."""
    t, rng = np.arange(2000), np.random.default_rng(1)
    error = np.sin(2 * np.pi * t / 50.0) + 0.33 * rng.standard_normal(t.size)
    assert period_of(record(error)) == pytest.approx(50.0, abs=2.0)


@pytest.mark.parametrize(
    "shape", [np.linspace(-1.0, 1.0, 400), np.r_[np.ones(200), -np.ones(200)], np.zeros(400)]
)
def test_what_never_returns_has_none(shape: np.ndarray) -> None:
    """A drift, one step and a constant, whose autocorrelation stays below zero once it is, have no period."""
    assert period_of(record(shape)) == 0.0
