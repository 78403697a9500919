"""Limit cycles: the recomputed figures of the source study, and prediction against simulation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.models import Backlash, Fopdt, Integrator, Loop, Pid, Stiction
from tuning.describing import stick_slip
from tuning.frequency_response import loop_response
from tuning.harmonic_balance import harmonic_balance, predicted_cycle
from tuning.limit_cycle import confirm

LEVEL = Loop(Fopdt(80, 200, 1), Pid(1, 10, scan_s=0), Backlash(1.0))
SCANNED = replace(LEVEL, controller=Pid(1, 10, scan_s=1))


def at_gain(loop: Loop, kp: float) -> Loop:
    return replace(loop, controller=replace(loop.controller, kp=kp))


def test_continuous_harmonic_balance_of_the_study():
    """By describing function: 41.14 s, PV 0.565, OP 0.675, and at half gain 57.1 s, 1.112."""
    b = predicted_cycle(LEVEL)
    assert b.period_s == pytest.approx(41.14, abs=0.01)
    assert b.pv_amplitude == pytest.approx(0.565, abs=5e-4)
    assert b.op_amplitude == pytest.approx(0.675, abs=5e-4)
    half = predicted_cycle(at_gain(LEVEL, 0.5))
    assert half.period_s == pytest.approx(57.1, abs=0.05)
    assert half.pv_amplitude == pytest.approx(1.112, abs=5e-4)


def test_half_a_scan_as_dead_time():
    """With L + 0.5 s the figures are 36.84 s, 0.617, OP 0.715, and 53.9 s, 1.195 at half gain."""
    loop = replace(LEVEL, process=Fopdt(80, 200, 1.5))
    b, half = predicted_cycle(loop), predicted_cycle(at_gain(loop, 0.5))
    assert b.period_s == pytest.approx(36.84, abs=0.005)
    assert b.pv_amplitude == pytest.approx(0.617, abs=1e-3)
    assert b.op_amplitude == pytest.approx(0.715, abs=5e-4)
    assert half.period_s == pytest.approx(53.9, abs=0.05)
    assert half.pv_amplitude == pytest.approx(1.195, abs=6e-4)


def test_exact_scan_is_nearer_to_simulation_than_half_a_scan_of_dead_time():
    """With the scan exact the predicted period is nearer to the simulated 38.0 s than with L + 0.5 s."""
    exact = predicted_cycle(SCANNED).period_s
    rough = predicted_cycle(replace(LEVEL, process=Fopdt(80, 200, 1.5))).period_s
    assert abs(exact - 38.0) < abs(rough - 38.0)
    assert exact == pytest.approx(37.19, abs=0.01)


def test_second_solution_is_no_limit_cycle():
    """The solution near 1.3e6 s with A close to d is found and told to be unstable."""
    fast, slow = harmonic_balance(LEVEL)
    assert fast.stable
    assert not slow.stable
    assert slow.period_s == pytest.approx(1.3e6, rel=0.02)
    assert slow.op_amplitude == pytest.approx(0.5, abs=1e-5)


def test_simulation_confirms_figure_1():
    """Simulated at 1 s scan the loop cycles with 38.0 s and 0.600, and 88.5 % more at half gain."""
    c = confirm(SCANNED)
    assert c.settled
    assert c.cycle.period_s == pytest.approx(38.0, abs=0.05)
    assert c.cycle.pv_amplitude == pytest.approx(0.600, abs=1e-3)
    half = confirm(at_gain(SCANNED, 0.5)).cycle
    assert half.pv_amplitude / c.cycle.pv_amplitude - 1 == pytest.approx(0.885, abs=2e-3)


def test_simulated_continuous_controller():
    """With a nearly continuous controller the simulated cycle has 48.9 s and 0.57."""
    c = confirm(LEVEL).cycle
    assert c.period_s == pytest.approx(48.9, abs=0.05)
    assert c.pv_amplitude == pytest.approx(0.569, abs=3e-3)


def test_long_integral_time_ends_the_cycle():
    """At Ti = T = 200 s neither prediction nor simulation finds a cycle, and at 10 s both do."""
    long = replace(SCANNED, controller=Pid(1, 200))
    assert harmonic_balance(long) == ()
    assert confirm(long).cycle is None
    assert confirm(long).settled


def test_nominal_flow_loop_does_not_cycle_with_play():
    """The study's flow loop (T/L = 2) at nominal tuning rests with play and cycles with stick-slip."""
    flow = Loop(Fopdt(1, 10, 5), Pid(0.8, 10, scan_s=0), Backlash(1.0))
    assert predicted_cycle(flow) is None
    assert confirm(flow).cycle is None
    stuck = replace(flow, valve=Stiction(1.0, 1.0))
    assert predicted_cycle(stuck) is not None
    assert confirm(stuck).cycle is not None


def test_healthy_valve_has_no_limit_cycle():
    """Without play or stick-slip there is nothing to balance."""
    for valve in (None, Backlash(0.0)):
        assert harmonic_balance(replace(LEVEL, valve=valve)) == ()
        assert confirm(replace(LEVEL, valve=valve)).cycle is None


@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 2.0), st.floats(5, 60), st.floats(0.2, 5.0))
def test_integrator_with_play_always_cycles_under_pi(gain, ti, width):
    """On an integrating process play cycles at whatever gain and integral time, as simulated."""
    loop = Loop(Integrator(0.05, 2.0), Pid(gain * 3, ti + 10 / gain), Backlash(width))
    assert predicted_cycle(loop) is not None
    assert confirm(loop).cycle is not None


@settings(max_examples=25, deadline=None)
@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.sampled_from([1, -1]))
def test_amplitude_scales_with_play_and_not_with_sign_or_span(width, span, sign):
    """Twice the play is twice the cycle at the same period; PV's scale and the sign change nothing."""
    base = predicted_cycle(SCANNED)
    loop = Loop(Fopdt(sign * span * 80, 200, 1), Pid(sign / span, 10), Backlash(width))
    b = predicted_cycle(loop)
    assert b.period_s == pytest.approx(base.period_s, rel=1e-6)
    assert b.op_amplitude == pytest.approx(width * base.op_amplitude, rel=1e-6)
    assert b.pv_amplitude == pytest.approx(width * span * base.pv_amplitude, rel=1e-6)


@settings(max_examples=25, deadline=None)
@given(st.floats(20, 200), st.floats(0.5, 1.5), st.floats(0.05, 0.3))
def test_prediction_is_near_simulation_on_lag_loops(time_constant, gain, share):
    """Where play cycles clearly, period and amplitude are predicted within 35 %."""
    process = Fopdt(1.0, time_constant, time_constant / 50)
    delay = process.dead_time_s + 0.5
    loop = Loop(process, Pid(gain * time_constant / (2.5 * delay), share * time_constant), Backlash(1.0))
    found, guess = confirm(loop).cycle, predicted_cycle(loop)
    if guess is not None and guess.op_amplitude > 0.6:
        assert found is not None
        assert guess.period_s == pytest.approx(found.period_s, rel=0.35)
        assert guess.pv_amplitude == pytest.approx(found.pv_amplitude, rel=0.35)


def test_stick_slip_cycle_balances():
    """Each solution satisfies G C N(A) = -1 with the describing function of its own number of jumps."""
    loop = replace(SCANNED, valve=Stiction(1.0, 0.3))
    for b in harmonic_balance(loop):
        n = complex(stick_slip(b.op_amplitude, 1.0, 0.3, b.jumps))
        g = complex(loop_response(loop, np.array([2 * math.pi / b.period_s]))[0])
        assert g * n == pytest.approx(-1, abs=1e-5)
