"""The frequency response of the linear part, against the simulator and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.models import Fopdt, Integrator, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from tests.identification.slow_responses import pv_of
from tuning.frequency_response import (
    frequencies,
    is_stable,
    loop_response,
    maximum_sensitivity,
    process_response,
    resonance_s,
    stable_gains,
)


def growth(loop: Loop, steps: int) -> float:
    """Range of PV at the end divided by its range in the middle, after a pulse and without output limits."""
    free = replace(loop, controller=replace(loop.controller, op_lo=-1e12, op_hi=1e12))
    load = np.ones(steps)
    load[0] = 0.0
    pv = closed_loop(free, np.zeros(steps), load, op_start=0.0).pv
    return float(np.ptp(pv[-steps // 4 :]) / (np.ptp(pv[steps // 4 : steps // 2]) + 1e-12))


@settings(max_examples=60, deadline=None)
@given(
    st.floats(2, 100),
    st.floats(0.0, 20.0),
    st.floats(0.1, 3.0),
    st.floats(0.2, 3.0),
    st.booleans(),
    st.sampled_from([1, -1]),
)
def test_stability_agrees_with_simulation(time_constant, delay, gain, ti, integrating, sign):
    """The winding number of the characteristic polynomial and a simulated pulse agree on stability, for both
    signs."""
    process = Integrator(sign / time_constant, delay) if integrating else Fopdt(sign, time_constant, delay)
    loop = Loop(process, Pid(sign * gain * time_constant / (delay + 1), ti * 4 * (delay + 1)))
    grown = growth(loop, int(400 * (delay + 1)))
    if not 0.2 < grown < 5:
        assert is_stable(loop) == (grown < 1)


@pytest.mark.parametrize("process", [Fopdt(2.0, 15.0, 3.3), Integrator(0.1, 2.6)])
def test_sampled_response_is_the_gain_of_a_simulated_sine(process):
    """The response to a sine that is held at each scan has the gain and phase of the sampled frequency
    response."""
    omega = 2 * math.pi / 40
    op = np.sin(omega * np.arange(4000))
    y = pv_of(process, None, op, 1.0)[2000:]
    k = np.arange(2000, 4000)
    fundamental = 2j * np.mean((y - y.mean()) * np.exp(-1j * omega * k))
    assert complex(process_response(process, 1.0, np.array([omega]))[0]) == pytest.approx(
        fundamental, rel=2e-3
    )


def test_fast_scan_tends_to_the_continuous_response():
    """At a scan of a thousandth of the dead time, the sampled and the continuous response agree within 0.5 %."""
    process = Fopdt(80, 200, 1)
    omega = np.geomspace(1e-3, 2.0, 50)
    sampled = loop_response(Loop(process, Pid(1, 10, scan_s=1e-3)), omega)
    continuous = loop_response(Loop(process, Pid(1, 10, scan_s=0)), omega)
    assert np.abs(sampled / continuous - 1).max() < 5e-3


def test_sensitivity_of_simc_is_the_published_one():
    """SIMC with tau_c = L has Ms 1.59 on a cancelled lag and 1.70 on an integrator (Skogestad 2003)."""
    lag = Loop(Fopdt(1, 8, 1), Pid(4, 8, scan_s=0))
    assert maximum_sensitivity(lag) == pytest.approx(1.59, abs=0.01)
    integrating = Loop(Integrator(1, 1), Pid(0.5, 8, scan_s=0))
    assert maximum_sensitivity(integrating) == pytest.approx(1.70, abs=0.01)


def test_wrong_sign_is_unstable():
    """A controller with the wrong sign is unstable and has no finite Ms."""
    assert maximum_sensitivity(Loop(Fopdt(1, 10, 2), Pid(-1, 10))) == math.inf


def test_p_only_has_a_sensitivity():
    """A loop without integral action has a finite maximum sensitivity."""
    assert 1 < maximum_sensitivity(Loop(Integrator(0.1, 2), Pid(1, math.inf))) < 2


def test_stability_of_a_huge_dead_time_needs_a_bounded_grid():
    """With a dead time of 900 million scans the stable and the unstable gain are recognized, as with a thousand
    scans."""
    for delay in (1e3, 9e8):
        process = Fopdt(1.0, delay, delay)
        assert is_stable(Loop(process, Pid(0.5, delay)))
        assert not is_stable(Loop(process, Pid(4.0, delay)))


def test_a_coarser_scan_does_not_change_the_stability_limit():
    """A scan of 1/3999 of the dead time has the same gain limit of stability within 2 % as a finer scan."""
    fine = Loop(Fopdt(1.0, 3e4, 1e4), Pid(1.0, 3e4))
    gains = np.linspace(1.0, 8.0, 400)
    coarse = Loop(fine.process, replace(fine.controller, scan_s=1e4 / 3999))
    ends = [gains[np.flatnonzero(stable_gains(one, gains))[-1]] for one in (fine, coarse)]
    assert ends[0] == pytest.approx(ends[1], rel=0.02)


def test_grid_ends_at_half_the_scan_frequency():
    """The grid has no frequency above half the scan frequency."""
    loop = Loop(Fopdt(1, 10, 0), Pid(1, 10, scan_s=2.0))
    assert frequencies(loop)[-1] <= math.pi / 2.0 + 1e-9


def test_a_loop_near_its_limit_amplifies_most_at_its_ultimate_period():
    """An integrator with dead time under P control near its stability limit oscillates at four dead times
    (Ziegler, Nichols 1942). The phase is -90 degrees from the integrator and -90 degrees from the dead time."""
    loop = Loop(Integrator(0.01, 30.0), Pid(0.95 * 0.5 * math.pi / (0.01 * 30.0), math.inf, scan_s=0.0))
    assert resonance_s(loop) == pytest.approx(120.0, rel=0.03)


def test_the_peak_next_to_an_expected_period_is_preferred() -> None:
    """A gain of 0.9 with a dead time has equal peaks at two dead times and at its odd fractions; the peak near
    the expected period is used. If no peak reaches 100, the largest peak is used."""
    loop = Loop(Fopdt(1.0, 1e-3, 30.0), Pid(0.9, math.inf, scan_s=0.0))
    for period_s in (60.0, 20.0, 12.0):
        assert resonance_s(loop, 1.1 * period_s, 2.0) == pytest.approx(period_s, rel=0.03)
    assert resonance_s(loop, 20.0, 100.0) == resonance_s(loop)
