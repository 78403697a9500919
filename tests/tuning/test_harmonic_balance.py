"""Maps against the source study's table and against the harmonic balance of single points."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve

from identification.models import Backlash, Fopdt, Integrator, Loop, Pid, Stiction
from proofs.valve_loops import largest_cycling_ratio
from tuning.describing import backlash, describing_function
from tuning.frequency_response import is_stable, loop_response
from tuning.harmonic_balance import (
    Balance,
    curves,
    harmonic_balance,
    predicted_cycle,
    travel_map,
)
from tuning.limit_cycle import confirm

LEVEL = Loop(Fopdt(80, 200, 1), Pid(1, 10, scan_s=0), Backlash(1.0))
TABLE = {
    2: (0.20, 0.33, 0.44),
    10: (0.33, 0.46, 0.54),
    50: (0.56, 0.66, 0.72),
    200: (0.73, 0.80, 0.83),
    500: (0.82, 0.87, 0.89),
}


@pytest.mark.parametrize("ratio", TABLE)
def test_largest_integral_time_that_cycles(ratio):
    """The largest Ti/T with a limit cycle (continuous, backlash) agrees with the study's table within 0.01."""
    found = [largest_cycling_ratio(Fopdt(1, ratio, 1), g) for g in (0.5, 1.0, 1.5)]
    assert found == pytest.approx(TABLE[ratio], abs=0.01)


@pytest.mark.parametrize(("ratio", "gain", "ti"), [(2, 1.0, 0.336), (10, 0.5, 0.336), (200, 1.5, 0.836)])
def test_cycles_just_beyond_the_table(ratio, gain, ti):
    """Where the largest ratio is 0.01 above the table, the closed form alone solves the balance to 1e-9."""
    kp = gain * ratio / 2.5

    def miss(x):
        amplitude, omega = 0.5 + np.exp(x[0]), np.exp(x[1])
        s = 1j * omega
        open_loop = kp * (1 + 1 / (ti * ratio * s)) * np.exp(-s) / (ratio * s + 1)
        total = open_loop * complex(backlash(amplitude, 1.0)) + 1
        return [total.real, total.imag]

    b = predicted_cycle(Loop(Fopdt(1, ratio, 1), Pid(kp, ti * ratio, scan_s=0), Backlash(1.0)))
    x, _, ok, _ = fsolve(
        miss, [np.log(b.op_amplitude - 0.5), np.log(2 * np.pi / b.period_s)], full_output=True
    )
    assert ok == 1
    assert np.abs(miss(x)).max() < 1e-9


def test_nominal_tuning_begins_to_cycle_between_ten_and_twenty():
    """A loop with nominal tuning rests at T/L = 10 and has a limit cycle at T/L = 20."""
    at = {r: largest_cycling_ratio(Fopdt(1, r, 1)) * r for r in (10, 20)}
    assert at[10] < min(10, 10)
    assert at[20] > min(20, 10)


@pytest.mark.parametrize("valve", [Backlash(1.0), Stiction(1.0, 1.0), Stiction(1.0, 0.4)])
@pytest.mark.parametrize("scan", [0.0, 1.0])
def test_map_agrees_with_the_balance_point_by_point(valve, scan):
    """Every cell has the period, the travel and the rest of the harmonic balance for this cell alone."""
    kp, ti = np.array([0.3, 0.7, 1.4]), np.array([5.0, 20.0, 120.0, 250.0])
    loop = replace(LEVEL, valve=valve, controller=Pid(1, 10, scan_s=scan))
    m = travel_map(loop, kp, ti)
    for i, t in enumerate(ti):
        for j, k in enumerate(kp):
            one = replace(loop, controller=Pid(k, t, scan_s=scan))
            b = predicted_cycle(one)
            assert m.unstable[i, j] == (not is_stable(one))
            if b is None:
                assert m.travel[i, j] == 0
            else:
                assert m.period_s[i, j] == pytest.approx(b.period_s, rel=2e-3)
                assert m.travel[i, j] == pytest.approx(b.op_amplitude / b.period_s, rel=5e-3)


def test_map_of_the_level_loop_agrees_with_the_study():
    """Travel decreases with longer Ti until the loop rests; the loop rests at the same Ti for both gains
    (Figure 5)."""
    m = travel_map(LEVEL, np.array([0.5, 1.0]), np.array([5.0, 10.0, 50.0, 100.0, 190.0]))
    assert np.all(np.diff(m.travel, axis=0) <= 0)
    assert m.at_rest[-1].all()
    assert not m.at_rest[:4].any()


def test_map_of_the_flow_loop_with_stick_slip_agrees_with_the_study():
    """A smaller gain and a longer Ti reduce the travel, and no cell is at rest (Figure 7)."""
    loop = Loop(Fopdt(1, 2, 1), Pid(0.8, 2, scan_s=0), Stiction(1, 1))
    m = travel_map(loop, np.array([0.2, 0.4, 0.8]), np.array([0.8, 1.2, 2.0]))
    assert not travel_map(loop, np.array([0.2, 0.8]), np.array([2.0, 8.0])).at_rest.any()
    assert np.all(np.diff(m.travel, axis=1) > 0)
    assert np.all(np.diff(m.travel, axis=0) < 0)


@pytest.mark.parametrize("ti", [1.0, 2.0, 4.0, 8.0])
def test_stick_slip_cycles_in_simulation_even_without_a_balance(ti):
    """On the flow loop, stick-slip has a limit cycle at every integral time, also where the balance has no
    solution."""
    loop = Loop(Fopdt(1, 2, 1), Pid(0.2, ti, scan_s=0), Stiction(1, 1))
    assert confirm(loop).cycle is not None


@settings(max_examples=40, deadline=None)
@given(st.floats(1, 300), st.floats(0.2, 1.5), st.floats(0.02, 2.0), st.integers(0, 2), st.booleans())
def test_loeb_and_the_slope_of_the_gain_agree(ratio, gain, ti, which, integrating):
    """A solution is stable by Loeb's criterion exactly where the gain that solves the balance rises."""
    process = Integrator(1 / ratio, 1) if integrating else Fopdt(1, ratio, 1)
    valve = (Backlash(1.0), Stiction(1.0, 1.0), Stiction(1.0, 0.4))[which]
    loop = Loop(process, Pid(gain * ratio / 2.5, ti * ratio, scan_s=0.5), valve)
    m = travel_map(loop, np.array([loop.controller.kp]), np.array([loop.controller.ti_s]))
    found = harmonic_balance(loop)
    assert (m.travel[0, 0] > 0) == any(b.stable for b in found)
    assert [b.stable for b in found] == [by_loeb(loop, b) for b in found]


def by_loeb(loop: Loop, b: Balance) -> bool:
    """Whether the oscillation decays if A is slightly larger. From 1 + N(A) L(s) = 0 follows ds/dA = -i
    (dlnN/dA) / (dlnL/dw); its real part must be negative (Atherton 1982)."""
    near = np.array([1 - 1e-6, 1 + 1e-6])
    linear = loop_response(loop, 2 * np.pi / b.period_s * near)
    valve = describing_function(loop.valve, b.op_amplitude * near, max(b.jumps, 1))
    along_w, along_a = np.log(linear[1] / linear[0]), np.log(valve[1] / valve[0])
    return bool((-1j * along_a / along_w).real < 0)


def test_curves_meet_at_the_crossing():
    """N(A) and -1/(G C) have the same value at the crossing (Figure 3)."""
    c = curves(LEVEL)
    b = c.crossings[0]
    n = np.interp(b.op_amplitude, c.amplitude, c.valve)
    g = np.interp(2 * np.pi / b.period_s, c.omega, c.linear)
    assert n == pytest.approx(g, rel=1e-2)


def test_negative_gains_give_the_same_map():
    """A process of negative gain with a direct-acting controller has the map of its mirror image."""
    kp, ti = np.array([0.5, 1.0]), np.array([10.0, 300.0])
    mirror = Loop(Fopdt(-80, 200, 1), Pid(-1, 10, scan_s=0), Backlash(1.0))
    assert np.array_equal(travel_map(mirror, -kp, ti).travel, travel_map(LEVEL, kp, ti).travel)


def test_rest_of_the_map_is_rest_in_simulation():
    """Where the map has no limit cycle, far from the border, the simulation has none either."""
    for kp in (0.5, 1.0, 1.5):
        assert confirm(replace(LEVEL, controller=Pid(kp, 220, scan_s=1))).cycle is None
