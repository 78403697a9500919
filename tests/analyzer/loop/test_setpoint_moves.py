"""The response of PV to set point moves follows the theory of step responses, and is not reported within noise."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from analyzer.config import FigureLimits
from analyzer.loop.oscillation.setpoint_moves import as_row, moves
from identification.record import Floats, LoopRecord

N, AT = 4000, 1000
T = np.arange(N) - AT


def record(pv: Floats, sp: Floats, **more: object) -> LoopRecord:
    """A record at 1 s with a constant OP."""
    still = np.full(pv.size, 50.0)
    return LoopRecord("L", 0.0, 1.0, sp, pv, still, np.zeros(pv.size, dtype=bool), **more)  # type: ignore[arg-type]


def stepped(answer: Floats, size: float = 10.0) -> LoopRecord:
    """A set point move that PV follows with a unit step response, shape (n,)."""
    sp = 50.0 + size * (T >= 0)
    return record(50.0 + size * answer * (T >= 0), sp)


def test_a_lag_rises_in_ln_9_and_settles_in_three_time_constants() -> None:
    """For a first-order response the rise takes 2.197 time constants, settling to 5 % takes three, without
    overshoot.
    """
    (found,) = moves(stepped(1.0 - np.exp(-T / 100.0)), 0.0, FigureLimits())
    assert found.rise_s == pytest.approx(100.0 * math.log(9.0), abs=1.0)
    assert found.settled_s == pytest.approx(-100.0 * math.log(0.05), abs=2.0)
    assert found.overshoot == 0.0
    assert found.start_s == AT
    assert found.size == 10.0


@pytest.mark.parametrize("damping", [0.2, 0.5, 0.7])
def test_a_second_order_response_overshoots_by_its_damping(damping: float) -> None:
    """For a second-order response the overshoot is exp(-pi zeta / sqrt(1 - zeta^2)), in both directions."""
    w, root = 0.05, math.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * w * np.maximum(T, 0))
    answer = 1.0 - decay * (np.cos(root * w * T) + damping / root * np.sin(root * w * T))
    for size in (10.0, -10.0):
        (found,) = moves(stepped(answer, size), 0.0, FigureLimits())
        assert found.overshoot == pytest.approx(math.exp(-math.pi * damping / root), rel=0.02)


def test_noise_a_drifting_set_point_and_an_estimated_one_have_no_moves() -> None:
    """Moves within noise, moves of a slave's set point that always moves, and moves of a set point read from PV do
    not count.
    """
    rng = np.random.default_rng(1)
    noisy = rng.normal(0.0, 1.0, N)
    small = record(50.0 + noisy, 50.0 + 2.0 * (T >= 0))
    slave = record(50.0 + noisy, 50.0 + 30.0 * np.sin(np.arange(N) / 100.0))
    lag = stepped(1.0 - np.exp(-T / 100.0))
    guessed = record(lag.pv, lag.sp, sp_estimated=True)
    limits = FigureLimits()
    assert moves(small, 1.0, limits) == moves(slave, 1.0, limits) == moves(guessed, 0.0, limits) == ()
    assert as_row(())["overshoot_pct"] is None


def test_a_move_that_does_not_settle_has_no_settling_time() -> None:
    """A loop that oscillates after its move has an overshoot but no settling time."""
    found = moves(stepped(1.0 + 0.3 * np.sin(T / 40.0)), 0.0, FigureLimits())
    row = as_row(found)
    assert row["settling_time_s"] is None
    assert row["overshoot_pct"] == pytest.approx(30.0, abs=0.5)
    assert len(json.loads(str(row["moves"]))) == row["sp_moves"] == 1


def test_a_move_with_a_gap_in_its_response_is_left_out() -> None:
    """A move with bad samples in its response is left out."""
    whole = stepped(1.0 - np.exp(-T / 100.0))
    whole.bad[AT + 50] = True
    assert moves(whole, 0.0, FigureLimits()) == ()


def test_a_gap_after_pv_has_settled_changes_no_move() -> None:
    """Bad samples hours after the response, or before the move, do not change the move."""
    whole = stepped(1.0 - np.exp(-T / 100.0))
    (found,) = moves(whole, 0.0, FigureLimits())
    whole.bad[[AT - 500, AT + 2500]] = True
    assert moves(whole, 0.0, FigureLimits()) == (found,)
