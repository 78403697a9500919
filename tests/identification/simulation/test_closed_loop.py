"""The simulator against closed forms and the source study's example."""

import math

import numpy as np
import pytest
from scipy.signal import lsim

from identification.models import Backlash, Fopdt, Integrator, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from tests.identification.slow_responses import pv_of


def period_and_amplitude(pv: np.ndarray, dt: float) -> tuple[float, float]:
    """Period [s] and amplitude of a settled oscillation, from the upward crossings of its mean."""
    x = pv[pv.size // 2 :] - np.mean(pv[pv.size // 2 :])
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    return float(np.mean(np.diff(up)) * dt), float(np.ptp(x) / 2)


def study_loop(kp: float, scan: float) -> tuple[float, float]:
    """The study's Figure 1: level loop K = 80, T = 200 s, L = 1 s, backlash 1 %, Ti = 10 s."""
    loop = Loop(Fopdt(80, 200, 1), Pid(kp, 10, scan_s=scan), Backlash(1.0))
    n = int(4000 / scan)
    load = np.where(np.arange(n) * scan < 5, 0.0, 0.5)
    return period_and_amplitude(closed_loop(loop, np.full(n, 50.0), load).pv, scan)


def test_figure_1_of_the_study():
    """At a scan of 1 s the study's loop oscillates with 38.0 s and 0.600 %; at half the gain the amplitude is
    88.5 % larger."""
    period, amplitude = study_loop(1.0, 1.0)
    assert period == pytest.approx(38.0, abs=0.1)
    assert amplitude == pytest.approx(0.600, abs=0.002)
    assert study_loop(0.5, 1.0)[1] / amplitude - 1 == pytest.approx(0.885, abs=0.005)


def test_continuous_controller_of_the_study():
    """At a scan of 0.02 s the same loop oscillates with 48.9 s and 0.569 % (recomputation of the study)."""
    period, amplitude = study_loop(1.0, 0.02)
    assert period == pytest.approx(48.9, abs=0.1)
    assert amplitude == pytest.approx(0.569, abs=0.003)


@pytest.mark.parametrize("dead", [0.0, 0.3, 2.0, 7.65])
@pytest.mark.parametrize("dt", [0.5, 2.0])
def test_step_response_has_the_closed_form(dead, dt):
    """A step gives K(1 - exp(-(t-L)/T)) at every sample, also with a fractional dead time."""
    op = np.where(np.arange(200) < 10, 40.0, 45.0)
    y = pv_of(Fopdt(2.0, 13.0, dead), None, op, dt)
    late = np.maximum((np.arange(200) - 10) * dt - dead, 0.0)
    assert y == pytest.approx(5.0 * 2.0 * (1 - np.exp(-late / 13.0)), abs=1e-9)


def test_integrator_ramps():
    """A step of 1 % on an integrator gives a ramp of its slope after the dead time."""
    op = np.where(np.arange(50) < 5, 40.0, 41.0)
    y = pv_of(Integrator(0.02, 3.4), None, op, 1.0)
    assert y == pytest.approx(0.02 * np.maximum(np.arange(50) - 5 - 3.4, 0.0), abs=1e-9)


def test_agrees_with_continuous_integration():
    """The response of a lag to OP steps agrees with scipy's matrix exponential on a fine grid."""
    rng = np.random.default_rng(0)
    op = np.repeat(rng.normal(size=30), 20)
    fine = np.repeat(op, 50)
    _, y, _ = lsim(([3.0], [9.0, 1.0]), fine - op[0], np.arange(fine.size) * 0.02, interp=False)
    assert pv_of(Fopdt(3.0, 9.0, 0.0), None, op, 1.0) == pytest.approx(np.asarray(y)[::50], abs=1e-6)


def test_unforced_loop_stays_at_rest():
    """Without load, noise and set-point moves, PV and OP of a loop with backlash stay constant."""
    loop = Loop(Integrator(0.05, 3.0), Pid(1.0, 60.0), Backlash(2.0))
    r = closed_loop(loop, np.full(500, 30.0), np.zeros(500), op_start=44.0)
    assert np.ptp(r.pv) == 0.0
    assert np.ptp(r.op) == 0.0
    assert math.isclose(r.op[0], 44.0)
