"""Aliased periods are distinguished from the loop's own periods by its control law."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.loop.oscillation.aliasing import is_own_period
from identification.models import Pid
from identification.record import LoopRecord

EVERY = 10
PID = Pid(0.5, 4.0, scan_s=1.0)


def sampled(period_s: float, pid: Pid = PID, noise: float = 0.05, seed: int = 1) -> LoopRecord:
    """Each tenth row of a day in which the error is a sine, and OP follows it by a PI law at each second."""
    rng, k = np.random.default_rng(seed), np.arange(86_400)
    error = np.sin(2.0 * np.pi * k / period_s) + noise * rng.normal(size=k.size)
    op = 50.0 + pid.kp * (error + np.cumsum(error - error.mean()) / pid.ti_s)
    rows = slice(0, None, EVERY)
    none = np.zeros(k[rows].size, dtype=bool)
    return LoopRecord("L", 0.0, float(EVERY), np.full(none.size, 50.0), (50.0 - error)[rows], op[rows], none)


def test_a_loop_s_own_period_is_identified_by_the_control_law() -> None:
    """A cycle of 69 s sampled every 10 s is the loop's own, although its integral time is 4 s."""
    assert is_own_period(sampled(69.0), 69.0, PID)


@pytest.mark.parametrize("fold", [1, 2, 3])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_aliased_period_is_not_the_loop_s_own(fold: int, side: float) -> None:
    """Cycles of 1/(k/10 s ± 1/69 s), which rows of 10 s show as 69 s, are not taken for 69 s."""
    true_s = 1.0 / (fold / EVERY + side / 69.0)
    assert not is_own_period(sampled(true_s), 69.0, PID)


def test_a_law_that_is_equal_at_all_periods_identifies_no_period() -> None:
    """Proportional action alone cannot identify an aliased period."""
    alone = Pid(0.5, np.inf, scan_s=1.0)
    assert not is_own_period(sampled(69.0, alone), 69.0, alone)


@pytest.mark.parametrize("pid", [Pid(0.5, 4.0, scan_s=0.0), Pid(0.0, 4.0), Pid(-0.5, 4.0)])
def test_any_stated_controller_gives_a_result(pid: Pid) -> None:
    """A continuous controller, one without a gain and one of the other direction give a result."""
    assert is_own_period(sampled(69.0), 69.0, pid) is (pid.kp > 0.0)


def test_an_independent_op_identifies_no_period() -> None:
    """An OP that does not follow the error shows no period of a control law."""
    record, other = sampled(69.0, seed=2), sampled(55.0, seed=3)
    apart = LoopRecord("L", 0.0, float(EVERY), record.sp, record.pv, other.op, record.bad)
    assert not is_own_period(apart, 69.0, PID)
