"""The stretch of a night that is fitted."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.assess import assess
from analyzer.loop.decisions import Cause
from analyzer.loop.identification.fit_data import fit_stretch, problem_of, whole_problem
from analyzer.loop.record.quality import Prepared, Scale
from benchmarks.world.simulate import Controller, Process, Valve, simulate
from identification.models import Pid
from identification.record import Floats, LoopRecord

CONFIG = Config()
PERIOD_S, DAY_S = 150.0, 86400


def _record(pv: Floats, sp: Floats | None = None, op: Floats | None = None, dt_s: float = 1.0) -> LoopRecord:
    n = pv.size
    at = np.full(n, 50.0)
    return LoopRecord(
        "L", 0.0, dt_s, at if sp is None else sp, pv, at if op is None else op, np.zeros(n, dtype=bool)
    )


@pytest.mark.parametrize("from_end", [0, 30_000, 60_000])
def test_a_burst_is_within_the_fitted_stretch(from_end):
    """A sine of one hour in a day of noise lies within the fitted stretch, at any time of the day."""
    rng, n = np.random.default_rng(5), DAY_S
    pv = 50.0 + 0.1 * rng.standard_normal(n)
    first = n - from_end - 3600
    pv[first : first + 3600] += np.sin(2 * np.pi * np.arange(3600) / PERIOD_S)
    begun = fit_stretch(_record(pv), 9000, PERIOD_S)
    assert begun <= first + 900
    assert begun + 9000 >= first + 2700


def test_a_cycle_of_constant_size_is_fitted_in_its_latest_stretch():
    """For a sine in noise that lasts all day, the latest stretch is fitted."""
    rng = np.random.default_rng(6)
    pv = 50.0 + np.sin(2 * np.pi * np.arange(DAY_S) / PERIOD_S) + 0.1 * rng.standard_normal(DAY_S)
    assert fit_stretch(_record(pv), 9000, PERIOD_S) == DAY_S - 9000


def test_the_whole_window_has_the_complete_record_in_few_blocks():
    """The complete record in at most 1,000 blocks has the block means that numpy computes; no block is shorter than
    in the stretch.
    """
    pv = 50.0 + np.random.default_rng(7).standard_normal(DAY_S)
    record = _record(pv)
    problem = problem_of(record, PERIOD_S, CONFIG.cause)
    whole = whole_problem(record, problem, 1000, PERIOD_S)
    assert whole.blocks.factor == 87
    assert whole.pv == pytest.approx(pv[: DAY_S // 87 * 87].reshape(-1, 87).mean(axis=1))
    assert whole_problem(record, problem, DAY_S, PERIOD_S).blocks.factor == problem.blocks.factor


@pytest.mark.parametrize("every", [1, 10])
def test_a_loop_that_rings_after_two_moves_of_its_set_point_is_tuned_too_tight(every):
    """A loop of Ms 9 that rings for an hour after each of two set point moves in a day is tuned too tight.

    With rows of 1 and 10 s, the tuning is the cause, and the time constant is within 25 %.
    """
    process, law = Process(2.2, 257.0, 0.0, 35.0), Controller(4.15, 257.0)
    rng = np.random.default_rng(8)
    sp = np.full(DAY_S, 50.0)
    sp[20_000:] = 54.0
    sp[50_000:] = 48.0
    noise = 0.03 * rng.standard_normal(DAY_S)
    t = simulate(process, law, Valve(), sp, np.zeros(DAY_S), np.zeros(DAY_S), noise)
    pv, sp_seen, op = (np.ascontiguousarray(x[::every]) for x in (t.pv, t.sp, t.op))
    record = _record(pv, sp_seen, op, float(every))
    stated = Pid(law.kp, law.ti_s, scan_s=1.0)
    found = assess(Prepared(record, Scale(0, 100, 0, 100, False), 0.0, 0.0, ()), stated, CONFIG).verdict
    assert found.cause is Cause.TUNING
    assert found.require_measured.linear.time_constant_s == pytest.approx(257.0, rel=0.25)
