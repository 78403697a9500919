"""The generator's integrators, stem, controller and recorder against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from proofs.concealed import grade, recorder, stem
from proofs.concealed.plant import Pi, Plant, close_loop, idle, open_loop
from proofs.concealed.scene import Historian

REST = Plant(K=1.5, T=20.0, L=3.7)


def step_response(plant, size=2.0, n=600):
    """Deviation of PV from rest after a step of OP at time 0, and the times of the rows [s]."""
    op = np.full(n, plant.v0 + size)
    return open_loop(plant, op, idle(n, plant), 1.0) - plant.y0, np.arange(n, dtype=float)


def after(t, L):
    return np.maximum(t - L, 0.0)


def test_fopdt_step_matches_the_closed_form():
    """The step response of a FOPDT process is K (1 - exp(-(t - L)/T)) within 1e-6 if L is a multiple of the
    fine step."""
    y, t = step_response(REST)
    assert np.max(np.abs(y - 3.0 * (1 - np.exp(-after(t, 3.7) / 20.0)))) < 1e-6


def test_two_lags_match_the_closed_form():
    """Two lags have the textbook step response of two unequal time constants."""
    y, t = step_response(REST._replace(T2=8.0))
    s = after(t, 3.7)
    assert np.max(np.abs(y - 3.0 * (1 - (20 * np.exp(-s / 20) - 8 * np.exp(-s / 8)) / 12))) < 1e-5


def test_inverse_response_has_its_zero():
    """The opposing part gives the stated zero: the step response is the closed form with this zero, and starts
    in the opposite direction."""
    beta, fast = 6.0, 4.0
    y, t = step_response(REST._replace(L=2.0, oppose=(beta + fast) / 16.0, oppose_s=fast))
    s = after(t, 2.0)
    a, b = (20 + beta) / 16.0, (fast + beta) / 16.0
    assert np.max(np.abs(y - 3.0 * (1 - a * np.exp(-s / 20) + b * np.exp(-s / fast)))) < 1e-5
    assert y.min() < -0.1


def test_integrator_ramps():
    """Without a leak, PV after a step of OP is a ramp of slope K/T times the step."""
    y, t = step_response(REST._replace(leak=0.0))
    assert np.allclose(y, 3.0 / 20.0 * after(t, 3.7), atol=1e-6)


def test_root_outflow_settles_where_inflow_equals_it():
    """With an outflow that is proportional to the root of PV, PV settles at the square of the relative flow."""
    plant = Plant(K=2.0, T=20.0, L=1.0, y0=25.0, root=1.0)
    y, _ = step_response(plant, size=5.0, n=4000)
    assert y[-1] + 25.0 == pytest.approx(25.0 * (1 + 2.0 * 5.0 / 50.0) ** 2, rel=1e-6)


def test_pipe_delay_is_volume_over_flow():
    """Twice the flow in the pipe halves the dead time."""
    plant = REST._replace(L=20.0, pipe=1.0)
    y, t = step_response(plant, size=plant.v0, n=300)
    assert t[np.flatnonzero(y > 1e-6)[0]] == pytest.approx(10.0, abs=1.1)


def test_backlash_follows_its_geometry():
    """The stem stays within half the backlash of its driver, and rests until the driver has crossed the
    backlash."""
    u = 50 + 10 * np.sin(np.arange(2000) / 50.0)
    z = stem.gap_path(u, 4.0)
    exact = [u[0]]
    for x in u[1:]:
        exact.append(min(max(exact[-1], x - 2.0), x + 2.0))
    assert np.max(np.abs(z - exact)) < 1e-6
    assert np.ptp(z) == pytest.approx(16.0, abs=0.02)


def test_friction_holds_then_jumps():
    """On a slow ramp the stem rests up to the static friction, then slips by the difference of static and
    Coulomb friction."""
    z, v, path = 50.0, 0.0, []
    ramp = 50 + np.arange(40_000) * 0.0005
    for u in ramp:
        z, v = stem.stick_slip(z, v, u, 3.0, 1.0, 0.25, 0.1)
        path.append(z)
    moves = np.flatnonzero(np.diff(path) > 0)
    assert ramp[moves[0]] - 50.0 == pytest.approx(3.0, abs=0.05)
    rests = np.unique(np.round(path, 1))
    assert rests[rests > 50.5][0] - 50.0 <= 2.1
    assert max(abs(ramp - path)) < 3.1


def test_controller_is_the_stated_pi():
    """Without filter, limits or rounding, OP follows from SP and PV by Kp and Ti."""
    d = replace(idle(800, REST), sp=50 + 4.0 * (np.arange(800) // 200 % 2))
    pv, op = close_loop(REST, Pi(1.2, 15.0), d, 1.0)
    e = d.sp - pv
    assert np.allclose(op, 50.0 + 1.2 * (e + np.cumsum(e) / 15.0), atol=1e-9)
    assert abs(e[190:199]).max() < 0.01


def test_own_fopdt_agrees_with_the_plant():
    """The baseline model of the grading is exact for dead times that are not multiples of the scan."""
    op = np.random.default_rng(0).normal(0, 2, 400).cumsum() * 0.2
    y = open_loop(REST, op + 50, idle(400, REST), 1.0) - 50.0
    assert np.max(np.abs(1.5 * grade.fopdt(op, 20.0, 3.7, 1.0) - y)) < 1e-6


def test_swinging_door_stays_within_its_bound():
    """Decompressed values differ from the signal by less than twice the deviation of the compression, with far
    fewer points."""
    x = np.cumsum(np.random.default_rng(1).normal(0, 0.1, 3000))
    kept = recorder.swinging_door(x, 0.5)
    assert np.max(np.abs(recorder.compress(x, 0.5) - x)) < 1.0
    assert len(kept) < 600


def test_clock_offset_moves_pv_alone():
    """A late clock delays PV by its offset in seconds and does not change OP."""
    made = np.vstack([np.arange(50.0), np.arange(50.0)])
    at = np.arange(50.0)
    assert np.allclose(recorder.keep_pv(made[0], at, 2.0, Historian(late_s=6.0))[10:], np.arange(7.0, 47.0))
    assert np.allclose(recorder.keep_op(made[1], at, Historian(late_s=6.0)), made[1])
