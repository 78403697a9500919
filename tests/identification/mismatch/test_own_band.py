"""The loop's own frequency band: it keeps the oscillation of the loop, and removes slow loads and ramps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from identification.controller.check import StatedSettings
from identification.estimation.model import Fitted, Model
from identification.estimation.prediction_error import FULL_STEPS, descended
from identification.estimation.problem import Problem, problem
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.explanation import Explanation, carried_over
from identification.mismatch.proof import gain_z, held_out
from identification.mismatch.recording import Recording
from identification.mismatch.selection import Candidate
from identification.signals.filters import in_band
from identification.simulation.open_loop import ModelInputs
from identification.simulation.parameters import Slot, neutral

T = np.arange(6000.0)
MIDDLE = slice(1000, 5000)


def sine(period: float) -> np.ndarray:
    """A sine of amplitude 1 and this period [samples]."""
    return np.sin(2 * np.pi * T / period)


@pytest.mark.parametrize("period", [40.0, 100.0])
def test_an_oscillation_and_its_harmonics_are_kept(period: float) -> None:
    """Within the band a sine keeps its amplitude and its phase, because the filter runs in both directions."""
    assert np.abs(in_band(sine(period), 12.5, 200.0) - sine(period))[MIDDLE].max() < 0.08


@pytest.mark.parametrize("slow", [sine(3000.0), 0.01 * T, np.full(T.size, 7.0)])
def test_a_slow_load_is_removed(slow: np.ndarray) -> None:
    """A sine of fifteen times the longest period, a ramp and a constant have a residual below 1 %."""
    assert np.abs(in_band(slow, 12.5, 200.0))[MIDDLE].max() < 0.01 * max(np.ptp(slow), 1.0)


def test_faster_noise_is_removed_above_the_band() -> None:
    """A sine of a third of the shortest period has a residual below 2 %. Without a shortest period it stays."""
    fast = sine(4.0)
    assert np.abs(in_band(fast, 12.5, 200.0))[MIDDLE].max() < 0.02
    assert np.abs(in_band(fast, 2.0, 200.0) - fast)[MIDDLE].max() < 0.02


def test_the_band_follows_from_oscillation_or_integral_time() -> None:
    """The band reaches from an eighth of a period to two periods. Without a period it ends at four integral
    times; with neither there is no band."""
    x = np.zeros(1000)
    given = (None, x, x, x == 0.0, 2.0, x)
    stated = StatedSettings(1.0, 20.0, 1.0)
    assert Recording(*given, period_s=160.0, stated=stated).band == (10.0, 160.0)
    assert Recording(*given, stated=stated).band == (2.0, 80.0)
    assert Recording(*given).band is None
    assert Recording(*given, stated=StatedSettings(1.0, np.inf, 1.0)).band is None


def oscillating(width: float, seed: int, sine_pct: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """PV and OP, shape (6000,), of a lag of 300 samples with backlash and a dead time of four samples, in plain
    Python. The PI loop oscillates every 154 samples. The load is a random walk and a sine of 1500 samples."""
    rng = np.random.default_rng(seed)
    stem, x, total, load, pipe, pv_out, op_out = 50.0, 0.0, 50.0, 0.0, [50.0] * 4, [], []
    for k in range(6500):
        slow = sine_pct * math.sin(2.0 * math.pi * k / 1500.0)
        load += 0.01 * rng.standard_normal()
        pv = 50.0 + x + 0.02 * rng.standard_normal()
        total += 1.5 * (50.0 - pv) / 20.0
        op = total + 1.5 * (50.0 - pv)
        pv_out.append(pv)
        op_out.append(op)
        stem = min(max(stem, op - width / 2), op + width / 2)
        pipe.append(stem)
        x += (1.0 - math.exp(-1.0 / 300.0)) * (10.0 * (pipe.pop(0) - 50.0 + load + slow) - x)
    return np.array(pv_out[500:]), np.array(op_out[500:])


def fitted(pv: np.ndarray, op: np.ndarray) -> tuple[Problem, Fitted, Fitted]:
    """Problem, baseline fit and fit with backlash of such a loop."""
    level = float(pv.mean())
    inputs = ModelInputs(op, 1.0, float(op.mean()), level, (float(pv.min()), float(pv.max())))
    p, c = problem(inputs, pv - level, np.ones(pv.size, dtype=bool)), neutral()
    c[Slot.K], c[Slot.T], c[Slot.L] = 10.0, 300.0, 4.0
    plain = descended(p, Model((), c), FULL_STEPS)
    with_backlash = c.copy()
    with_backlash[Slot.STICKBAND] = 4.0
    return p, plain, descended(p, Model((EFFECTS["backlash"].candidates[0],), with_backlash), FULL_STEPS)


@pytest.mark.parametrize("seed", [1, 2])
def test_backlash_shows_in_the_band_on_held_out_data(seed: int) -> None:
    """Backlash of 4 % removes more than half of the residual of the best baseline model in the band, with a
    significant difference of the squared errors. A model compared with itself removes nothing."""
    p, plain, better = fitted(*oscillating(4.0, seed))
    found = held_out(p, plain, better, 0, (19.0, 308.0)).in_band
    assert found is not None
    assert found.share > 0.5
    assert found.gain_z > 3.0
    same = held_out(p, plain, plain, 0, (19.0, 308.0)).in_band
    assert same is not None
    assert same.share == 0.0


@pytest.mark.parametrize(("second", "kept"), [("load-oscillation", True), ("valve-characteristic", False)])
def test_a_slow_load_in_addition_to_backlash_is_kept(second: str, kept: bool) -> None:
    """A sine of five times the band's longest period is kept in addition to backlash. A valve characteristic
    that is absent and removes nothing in the band is not kept."""
    p, plain, better = fitted(*oscillating(4.0, 1, 0.6))
    c, row = better.model.c.copy(), EFFECTS[second].candidates[0]
    if second == "load-oscillation":
        c[Slot.OMEGA], c[Slot.SINE] = 2.0 * math.pi / 1500.0, 0.1
    both = descended(p, Model((*better.model.added, row), c), 2 * FULL_STEPS)
    accepted = Candidate(better, 1.0, 1.0), Candidate(both, 1.0, 1.0)
    found = carried_over(Explanation(p, plain, both, accepted, band=(19.0, 308.0)))
    assert (second in [c.name for c in found.accepted]) is kept


def test_squared_errors_of_equal_models_differ_by_chance() -> None:
    """For 200 pairs of equal white errors the difference exceeds 1.645 standard errors in 1 to 10 % of the
    pairs, on each side."""
    rng = np.random.default_rng(3)
    z = np.array([gain_z(*rng.standard_normal((2, 2000)), 0, 50.0) for _ in range(200)])
    assert 0.01 <= float(np.mean(z < -1.645)) <= 0.1
    assert 0.01 <= float(np.mean(z > 1.645)) <= 0.1
    assert gain_z(np.ones(100), np.zeros(100), 0, 50.0) == 0.0  # two blocks are too few
