"""Whether the loop or its load resonates, on loops of benchmarks/world. Their simulator shares no code with the
packages."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.world.draw import Drawn, run
from benchmarks.world.simulate import Controller, Process, Valve, sensitivity
from identification.estimation.problem import Problem, block_means, in_blocks
from identification.estimation.smooth_load import as_fit, fit_line, fit_smooth, resonant_starts
from identification.models import Loop, Pid
from tuning.frequency_response import controller_response, maximum_sensitivity

TIGHT = Drawn(
    "T", "tight", Process(1.2, 150.0, 0.0, 20.0), Controller(8.5, 120.0), Valve(), 11, 0.0, 0.0, 1.0, 0.0
)
CALM = Drawn(
    "L", "load", Process(1.2, 150.0, 0.0, 20.0), Controller(2.2, 150.0), Valve(), 12, 0.0, 240.0, 1.0, 0.0
)
BLOCK = 4


def _problem(d: Drawn, scale: float = 1.0) -> Problem:
    t = run(d, hours=8)
    n = t.pv.size // BLOCK
    pv, op = scale * block_means(t.pv, BLOCK), np.ascontiguousarray(t.op[: n * BLOCK])
    return in_blocks(pv, op, np.ones(n, dtype=bool), BLOCK * 1.0, BLOCK)


def _law(d: Drawn, period_s: float) -> tuple[Pid, complex]:
    pid = Pid(d.controller.kp, d.controller.ti_s, scan_s=1.0)
    return pid, complex(controller_response(pid, np.array([2 * math.pi / period_s]))[0])


def test_a_tight_loop_is_identified_without_set_point_moves():
    """Under a smooth load, slope and dead time of a ringing loop are recovered within 15 %, and its Ms is above
    3."""
    true_ms, period = sensitivity(TIGHT.process, TIGHT.controller)
    problem, (pid, law) = _problem(TIGHT), _law(TIGHT, period)
    found = fit_smooth(problem, period, resonant_starts(problem, period, law))
    assert found.process.slope == pytest.approx(1.2 / 150.0, rel=0.15)
    assert found.process.dead_time_s == pytest.approx(20.0, rel=0.15)
    assert true_ms > 3.5
    assert maximum_sensitivity(Loop(found.process, pid)) > 3.0
    lined = fit_line(problem, period, [found])
    assert lined.log_likelihood - found.log_likelihood < 15.0


def test_a_sine_is_a_line_of_the_load():
    """In a well tuned loop under a sine, a spectral line of the load explains far more than a smooth load, and
    keeps its phase."""
    problem, (pid, law) = _problem(CALM), _law(CALM, 240.0)
    smooth = fit_smooth(problem, 240.0, resonant_starts(problem, 240.0, law))
    lined = fit_line(problem, 240.0, [smooth], [(72.0, 12.0), (480.0, 12.0)])
    assert lined.log_likelihood - smooth.log_likelihood > 20.0
    assert lined.line is not None
    assert lined.line.kept > 10.0
    assert lined.line.period_s == pytest.approx(240.0, rel=0.05)
    assert maximum_sensitivity(Loop(lined.process, pid)) < 3.0


def test_another_unit_of_pv_scales_the_gain_alone():
    """PV in another unit scales gain and innovations, and does not change time constant, dead time and load."""
    one, other = (fit_smooth(_problem(TIGHT, s), 100.0, [((100.0, 16.0), None)]) for s in (1.0, 3.0))
    assert other.process.gain == pytest.approx(3.0 * one.process.gain, rel=1e-6)
    assert other.sigma2 == pytest.approx(9.0 * one.sigma2, rel=1e-6)
    assert np.allclose(other.theta, one.theta, rtol=1e-6)


def test_missing_blocks_hardly_change_the_process():
    """Missing blocks, one in twenty, change slope and dead time by less than 10 %."""
    whole = _problem(TIGHT)
    missing = np.random.default_rng(3).random(whole.usable.size) < 0.05
    y = np.interp(np.arange(missing.size), np.flatnonzero(~missing), whole.pv[~missing])
    thin = in_blocks(y, whole.blocks.op, ~missing, whole.dt_s, whole.blocks.factor)
    one, other = (fit_smooth(w, 100.0, [((100.0, 16.0), None)]) for w in (whole, thin))
    assert other.process.slope == pytest.approx(one.process.slope, rel=0.1)
    assert other.process.dead_time_s == pytest.approx(one.process.dead_time_s, rel=0.1)


def test_the_load_as_an_autoregression_leaves_the_same_innovations():
    """A fit of the night with eight lags of the noise model has innovations within 5 % of those of the smooth
    load."""
    from identification.estimation.gauss_newton import innovations

    problem = _problem(TIGHT)
    found = fit_smooth(problem, 100.0, [((100.0, 16.0), None)])
    left = innovations(as_fit(found, problem))[200:]
    assert float(np.var(left)) == pytest.approx(found.sigma2, rel=0.05)
