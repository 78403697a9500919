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
    """The describing function gives a period of 41.14 s and amplitudes of PV 0.565 and OP 0.675. At half the
    gain it gives 57.1 s and PV 1.112."""
    b = predicted_cycle(LEVEL)
    assert b.period_s == pytest.approx(41.14, abs=0.01)
    assert b.pv_amplitude == pytest.approx(0.565, abs=5e-4)
    assert b.op_amplitude == pytest.approx(0.675, abs=5e-4)
    half = predicted_cycle(at_gain(LEVEL, 0.5))
    assert half.period_s == pytest.approx(57.1, abs=0.05)
    assert half.pv_amplitude == pytest.approx(1.112, abs=5e-4)


def test_half_a_scan_as_dead_time():
    """With L + 0.5 s the figures are 36.84 s, PV 0.617 and OP 0.715; at half the gain they are 53.9 s and PV
    1.195."""
    loop = replace(LEVEL, process=Fopdt(80, 200, 1.5))
    b, half = predicted_cycle(loop), predicted_cycle(at_gain(loop, 0.5))
    assert b.period_s == pytest.approx(36.84, abs=0.005)
    assert b.pv_amplitude == pytest.approx(0.617, abs=1e-3)
    assert b.op_amplitude == pytest.approx(0.715, abs=5e-4)
    assert half.period_s == pytest.approx(53.9, abs=0.05)
    assert half.pv_amplitude == pytest.approx(1.195, abs=6e-4)


def test_exact_scan_is_nearer_to_simulation_than_half_a_scan_of_dead_time():
    """With the exact scan the predicted period is nearer to the simulated 38.0 s than with L + 0.5 s."""
    exact = predicted_cycle(SCANNED).period_s
    rough = predicted_cycle(replace(LEVEL, process=Fopdt(80, 200, 1.5))).period_s
    assert abs(exact - 38.0) < abs(rough - 38.0)
    assert exact == pytest.approx(37.19, abs=0.01)


def test_second_solution_is_no_limit_cycle():
    """The solution near 1.3e6 s with A close to d is found and reported as unstable."""
    fast, slow = harmonic_balance(LEVEL)
    assert fast.stable
    assert not slow.stable
    assert slow.period_s == pytest.approx(1.3e6, rel=0.02)
    assert slow.op_amplitude == pytest.approx(0.5, abs=1e-5)


def test_simulation_confirms_figure_1():
    """Simulated at a scan of 1 s, the loop oscillates with 38.0 s and PV 0.600; at half the gain the amplitude
    is 88.5 % larger."""
    c = confirm(SCANNED)
    assert c.settled
    assert c.cycle.period_s == pytest.approx(38.0, abs=0.05)
    assert c.cycle.pv_amplitude == pytest.approx(0.600, abs=1e-3)
    half = confirm(at_gain(SCANNED, 0.5)).cycle
    assert half.pv_amplitude / c.cycle.pv_amplitude - 1 == pytest.approx(0.885, abs=2e-3)


def test_simulated_continuous_controller():
    """With a nearly continuous controller the simulated limit cycle has a period of 48.9 s and PV 0.57."""
    c = confirm(LEVEL).cycle
    assert c.period_s == pytest.approx(48.9, abs=0.05)
    assert c.pv_amplitude == pytest.approx(0.569, abs=3e-3)


def test_long_integral_time_ends_the_limit_cycle():
    """At Ti = T = 200 s neither prediction nor simulation has a limit cycle."""
    long = replace(SCANNED, controller=Pid(1, 200))
    assert harmonic_balance(long) == ()
    assert confirm(long).cycle is None
    assert confirm(long).settled


def test_nominal_flow_loop_has_no_limit_cycle_with_backlash():
    """The study's flow loop (T/L = 2) at nominal tuning rests with backlash and has a limit cycle with
    stick-slip."""
    flow = Loop(Fopdt(1, 10, 5), Pid(0.8, 10, scan_s=0), Backlash(1.0))
    assert predicted_cycle(flow) is None
    assert confirm(flow).cycle is None
    sticking = replace(flow, valve=Stiction(1.0, 1.0))
    assert predicted_cycle(sticking) is not None
    assert confirm(sticking).cycle is not None


def test_ideal_valve_has_no_limit_cycle():
    """Without backlash or stick-slip the harmonic balance has no solution and the simulation no limit cycle."""
    for valve in (None, Backlash(0.0)):
        assert harmonic_balance(replace(LEVEL, valve=valve)) == ()
        assert confirm(replace(LEVEL, valve=valve)).cycle is None


@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 2.0), st.floats(5, 60), st.floats(0.2, 5.0))
def test_integrator_with_backlash_always_has_a_limit_cycle_under_pi(gain, ti, width):
    """On an integrating process, backlash has a limit cycle at every gain and integral time, also in
    simulation."""
    loop = Loop(Integrator(0.05, 2.0), Pid(gain * 3, ti + 10 / gain), Backlash(width))
    assert predicted_cycle(loop) is not None
    assert confirm(loop).cycle is not None


@settings(max_examples=25, deadline=None)
@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.sampled_from([1, -1]))
def test_amplitude_scales_with_backlash_and_not_with_sign_or_span(width, span, sign):
    """Twice the backlash gives twice the amplitude at the same period. The scale of PV and the sign do not
    change the limit cycle."""
    base = predicted_cycle(SCANNED)
    loop = Loop(Fopdt(sign * span * 80, 200, 1), Pid(sign / span, 10), Backlash(width))
    b = predicted_cycle(loop)
    assert b.period_s == pytest.approx(base.period_s, rel=1e-6)
    assert b.op_amplitude == pytest.approx(width * base.op_amplitude, rel=1e-6)
    assert b.pv_amplitude == pytest.approx(width * span * base.pv_amplitude, rel=1e-6)


@settings(max_examples=25, deadline=None)
@given(st.floats(20, 200), st.floats(0.5, 1.5), st.floats(0.05, 0.3))
def test_prediction_is_near_simulation_on_lag_loops(time_constant, gain, share):
    """If backlash causes a clear limit cycle, period and amplitude are predicted within 35 %."""
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
