"""Trials between turns of OP, on loops whose valve is known."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimation.backlash_stiction import fit_linear, fit_play
from identification.estimation.evidence import (
    Trials,
    gains,
    trials,
    trials_between_moves,
)
from identification.estimation.problem import in_blocks
from identification.models import Backlash, Fopdt
from identification.signals.turns import turning_points, turns_of
from identification.simulation.valve import RESTS, StemLaw
from tests.identification.slow_responses import pv_of

N = 4000
PERIOD = 200.0


def swinging(seed: int) -> np.ndarray:
    """OP of a cycle whose size changes from half to half [% OP], shape (n,)."""
    sizes = np.random.default_rng(seed).uniform(3, 7, int(2 * N / PERIOD) + 2)
    corners = 50 + sizes * np.where(np.arange(sizes.size) % 2, 1.0, -1.0)
    return np.interp(np.arange(N), np.arange(sizes.size) * PERIOD / 2, corners)


def judged(valve: Backlash | None, seed: int) -> Trials:
    """The trials of a play against an ideal valve behind such an OP."""
    op = swinging(seed)
    noise = 0.2 * np.random.default_rng(seed + 100).standard_normal(N)
    pv = pv_of(Fopdt(1.5, 30.0, 5.0), valve, op, 1.0) + noise
    window = in_blocks(pv, op, np.ones(N, dtype=bool), 1.0)
    linear = fit_linear(window, PERIOD)
    found = trials(fit_play(linear, PERIOD), linear, PERIOD)
    assert found is not None
    return found


def test_turning_points_are_those_of_a_triangle():
    """A triangle under noise smaller than the size asked turns at its corners, and nowhere else."""
    x = 5 * np.abs((np.arange(1000) / 50) % 2 - 1) + 0.3 * np.random.default_rng(1).uniform(-1, 1, 1000)
    found = turning_points(x, 2.0)
    corners = np.arange(50, 950, 50)
    assert all(np.abs(found - c).min() <= 5 for c in corners)
    assert found.size == pytest.approx(corners.size, abs=2)


def test_op_turns_twice_a_period():
    """OP that cycles forty halves long turns about forty times, whatever the size of each half."""
    assert turns_of(swinging(3), PERIOD).size == pytest.approx(2 * N / PERIOD, abs=4)


@pytest.mark.parametrize("seed", range(4))
def test_trials_agree_on_a_play(seed):
    """Behind a play of 3 % nine in ten stretches show it."""
    found = judged(Backlash(3.0), seed)
    assert found.count > 25
    assert found.agreeing > 0.9
    assert found.steadiness > 6


@pytest.mark.parametrize("seed", range(4))
def test_trials_do_not_agree_behind_an_ideal_valve(seed):
    """Behind an ideal valve no more than two in three stretches happen to show a play."""
    found = judged(None, seed)
    assert found.agreeing < 0.67
    assert found.steadiness < 2.5


def test_gains_add_up_to_the_evidence_of_the_same_scale():
    """A fit has no gain over itself."""
    op = swinging(1)
    window = in_blocks(pv_of(Fopdt(1.5, 30.0, 5.0), None, op, 1.0), op, np.ones(N, dtype=bool), 1.0)
    rival = fit_linear(window, PERIOD)
    assert not gains(rival, rival).any()


def test_too_few_turns_are_no_trials():
    """A record with two turns of OP has none."""
    op = swinging(1)[:300]
    window = in_blocks(op.copy(), op, np.ones(300, dtype=bool), 1.0)
    rival = fit_linear(window, PERIOD)
    assert trials(rival, rival, PERIOD) is None


@pytest.mark.parametrize("seed", range(4))
def test_moves_of_a_stem_are_trials_where_nothing_cycles(seed):
    """Behind a play of 3 % nine in ten stretches between moves of the stem show it; OP turns as often as it moves."""
    op = swinging(seed)
    noise = 0.2 * np.random.default_rng(seed + 100).standard_normal(N)
    window = in_blocks(
        pv_of(Fopdt(1.5, 30.0, 5.0), Backlash(3.0), op, 1.0) + noise, op, np.ones(N, dtype=bool), 1.0
    )
    linear = fit_linear(window, PERIOD)
    play = fit_play(linear, PERIOD)
    found = trials_between_moves(play, linear)
    assert found is not None
    assert found.count == pytest.approx(2 * N / PERIOD, abs=3)
    assert found.agreeing > 0.9


def test_a_stem_that_never_moves_is_no_trial():
    """A play wider than OP's range leaves no move, and so no trial."""
    op = 50 + np.sin(np.arange(N) / 50.0)
    window = in_blocks(0.1 * np.random.default_rng(1).standard_normal(N), op, np.ones(N, dtype=bool), 1.0)
    plain = fit_linear(window, PERIOD)
    still = plain.moved(valve=StemLaw(5.0, 5.0, RESTS))
    assert trials_between_moves(still, plain) is None
