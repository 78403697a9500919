"""The candidates' simulator against closed forms and against the project's other simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.models import Backlash, Fopdt, Integrator, Motion, Process, Stiction, Valve
from identification.simulation.open_loop import ModelInputs, as_parameters, begun_at_rest, simulate
from identification.simulation.parameters import Slot, neutral
from identification.simulation.valve import backlash_stem
from tests.identification.slow_responses import pv_of


def inputs(seed: int = 1, n: int = 600) -> ModelInputs:
    """OP that moves every thirty samples."""
    op = 50 + np.repeat(np.random.default_rng(seed).uniform(-5, 5, n // 30), 30)
    return ModelInputs(op, 2.0, float(op[0]), 50.0, (40.0, 60.0))


def constants(**given: float) -> np.ndarray:
    """The baseline model with gain 1.5, time constant 40 s and dead time 7 s, and the given values by slot
    name."""
    c = neutral()
    c[Slot.K], c[Slot.T], c[Slot.L] = 1.5, 40.0, 7.0
    for name, value in given.items():
        c[Slot[name]] = value
    return c


def test_baseline_model_equals_exact_open_loop() -> None:
    """Without any effect the model is the exact first-order lag with fractional dead time."""
    s = inputs()
    expected = pv_of(Fopdt(1.5, 40.0, 7.0), None, s.op, s.dt_s)
    assert np.allclose(simulate(s, constants()), expected, atol=1e-9)


@pytest.mark.parametrize("process", [Fopdt(1.5, 40.0, 7.0), Integrator(0.03, 5.2), Integrator(-0.03, 0.0)])
@pytest.mark.parametrize(
    "valve", [None, Backlash(3.0), *(Stiction(3.0, 1.2, motion) for motion in Motion), Stiction(2.0, 2.0)]
)
def test_models_become_parameters(process: Process, valve: Valve) -> None:
    """The parameters of any process and valve give the PV of the stem and the difference equation."""
    s = inputs()
    got = simulate(s, as_parameters(process, valve))
    expected = pv_of(process, valve, s.op, s.dt_s)
    assert np.allclose(got - got[0], expected - expected[0], atol=1e-9)


def test_backlash_equals_backlash_before_lag() -> None:
    """The backlash of a candidate is the project's backlash before the same lag."""
    s = inputs()
    got = simulate(s, constants(STICKBAND=3.0))
    expected = pv_of(Fopdt(1.5, 40.0, 7.0), Backlash(3.0), s.op, s.dt_s)
    assert np.allclose(got - got[0], expected, atol=1e-9)
    assert not np.allclose(backlash_stem(s.op, 3.0), s.op)


@pytest.mark.parametrize(
    "neutral_effect",
    [
        {"T2": 1e-6},
        {"SLOPE": 1e-9},
        {"GAIN_SLOPE": 1e-9},
        {"ASYMMETRY": 1e-12},
        {"DRIFT": 1e-12},
        {"CAP": 1e6},
    ],
)
def test_effect_of_zero_size_is_the_baseline_model(neutral_effect: dict[str, float]) -> None:
    """An effect of size zero does not change PV."""
    s = inputs()
    assert np.allclose(simulate(s, constants(**neutral_effect)), simulate(s, constants()), atol=1e-4)


def test_second_lag_equals_two_lags() -> None:
    """A second lag has the closed-form step response of two lags in series."""
    op = np.concatenate((np.full(5, 50.0), np.full(400, 51.0)))
    s = ModelInputs(op, 2.0, 50.0, 50.0, (40.0, 60.0))
    y = simulate(s, constants(T2=15.0, L=0.0))
    t = 2.0 * (np.arange(405) - 5)
    step = 1.5 * (1 - (40 * np.exp(-t / 40) - 15 * np.exp(-t / 15)) / 25)
    assert np.allclose(y, np.where(t > 0, step, 0.0), atol=5e-3)


def test_opposing_mode_starts_in_the_opposite_direction() -> None:
    """A fast mode of opposite sign moves PV down before PV rises."""
    op = np.concatenate((np.full(5, 50.0), np.full(200, 52.0)))
    y = simulate(ModelInputs(op, 1.0, 50.0, 50.0, (40.0, 60.0)), constants(SHARE=-0.3, MODE_T=2.0, L=0.0))
    assert y[:20].min() < -0.2
    assert y[-1] > 2.5


def test_pipe_delay_is_dead_time_at_rest_and_shorter_at_flow() -> None:
    """A pipe at its nominal flow has the constant dead time; with more flow PV responds earlier."""
    op = np.concatenate((np.full(50, 50.0), np.full(100, 50.2), np.full(100, 90.0), np.full(100, 90.2)))
    s = ModelInputs(op, 1.0, 50.0, 50.0, (40.0, 60.0))
    plain, piped = (simulate(s, constants(L=20.0, PIPE=pipe)) for pipe in (0.0, 1.0))
    assert np.allclose(plain[:140], piped[:140], atol=2e-2)
    assert np.flatnonzero(piped > 5.0)[0] < np.flatnonzero(plain > 5.0)[0] - 3


def test_overflow_is_flat_and_then_late() -> None:
    """Above the overflow level PV is constant. A clipped sensor is also constant, but its vessel continues to
    fill."""
    s = inputs()
    top = float(simulate(s, constants()).max())
    wide = replace(s, pv_range=(0.0, 100.0))
    capped = simulate(wide, constants(CAP=50.0 + 0.5 * top))
    clipped = simulate(wide, constants(CLIP_HI=50.0 + 0.5 * top))
    assert capped.max() < 0.5 * top + 0.3
    assert clipped.max() <= 0.5 * top + 1e-9
    assert not np.allclose(capped, clipped, atol=0.05)


def by_euler(op: np.ndarray, c: np.ndarray, level: float, parts: int = 400) -> np.ndarray:
    """Deviation of PV of two vessels in series, of which the upper one overflows, in small steps, shape (n,)."""
    middle, dt = float(op[0]), 2.0 / parts
    x, above, out = c[Slot.START], c[Slot.BIAS] + c[Slot.BEGUN], np.empty(op.size)
    fed = np.concatenate((np.full(round(c[Slot.L] / dt), op[0]), np.repeat(op, parts)))
    for k in range(op.size):
        out[k] = x
        for u in fed[k * parts : (k + 1) * parts]:
            above += dt / c[Slot.T2] * (c[Slot.K] * (u - middle) + c[Slot.BIAS] - above)
            spilt = max(above - (c[Slot.UPPER_CAP] - level), 0.0)
            above -= spilt
            x += dt / c[Slot.T] * (above - x) + c[Slot.PASSED] * spilt * c[Slot.T2] / c[Slot.T]
    return out


def test_a_vessel_that_overflows_into_the_next() -> None:
    """The overflow of the upper vessel enters the lower one with the stated share, as in small steps of the
    balance."""
    s = inputs(n=150)
    c = constants(T2=25.0, UPPER_CAP=52.0, PASSED=0.6, BEGUN=-3.0, L=8.0)
    expected = by_euler(s.op, c, s.level)
    assert np.abs(simulate(s, c) - expected).max() < 0.02 * np.ptp(expected)
    without = simulate(s, constants(T2=25.0, BEGUN=-3.0, L=8.0))
    assert np.abs(without - expected).max() > 0.2 * np.ptp(expected)


@pytest.mark.parametrize("root", [0.0, 0.8])
def test_begun_at_rest_pv_does_not_move(root: float) -> None:
    """A vessel whose inflow equals its outflow at the start keeps its level, for every level and OP. Otherwise
    the level moves."""
    s, c = inputs(), constants(T2=60.0, BEGUN=5.0, START=-6.0, BIAS=2.0, ROOT=root)
    assert np.diff(simulate(s, begun_at_rest(s, c)))[0] == pytest.approx(0.0, abs=0.01)
    assert np.diff(simulate(s, c))[0] > 0.3
