"""Trials between OP reversals, on loops whose valve is known."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimation.backlash_stiction import fit_backlash, fit_linear
from identification.estimation.evidence import (
    Trials,
    gains,
    trials,
    trials_between_moves,
)
from identification.estimation.problem import in_blocks
from identification.models import Backlash, Fopdt
from identification.signals.reversals import op_reversals, turning_points
from identification.simulation.valve import RESTS, StemLaw
from tests.identification.slow_responses import pv_of

N = 4000
PERIOD = 200.0


def oscillating(seed: int) -> np.ndarray:
    """OP of an oscillation whose size changes from half period to half period [% OP], shape (n,)."""
    sizes = np.random.default_rng(seed).uniform(3, 7, int(2 * N / PERIOD) + 2)
    corners = 50 + sizes * np.where(np.arange(sizes.size) % 2, 1.0, -1.0)
    return np.interp(np.arange(N), np.arange(sizes.size) * PERIOD / 2, corners)


def judged(valve: Backlash | None, seed: int) -> Trials:
    """The trials of backlash against an ideal valve under such an OP."""
    op = oscillating(seed)
    noise = 0.2 * np.random.default_rng(seed + 100).standard_normal(N)
    pv = pv_of(Fopdt(1.5, 30.0, 5.0), valve, op, 1.0) + noise
    problem = in_blocks(pv, op, np.ones(N, dtype=bool), 1.0)
    linear = fit_linear(problem, PERIOD)
    found = trials(fit_backlash(linear, PERIOD), linear, PERIOD)
    assert found is not None
    return found


def test_turning_points_are_those_of_a_triangle():
    """A triangle under noise smaller than the given size reverses at its corners, and nowhere else."""
    x = 5 * np.abs((np.arange(1000) / 50) % 2 - 1) + 0.3 * np.random.default_rng(1).uniform(-1, 1, 1000)
    found = turning_points(x, 2.0)
    corners = np.arange(50, 950, 50)
    assert all(np.abs(found - c).min() <= 5 for c in corners)
    assert found.size == pytest.approx(corners.size, abs=2)


def test_op_reverses_twice_a_period():
    """OP with half periods of any size reverses about twice per period."""
    assert op_reversals(oscillating(3), PERIOD).size == pytest.approx(2 * N / PERIOD, abs=4)


@pytest.mark.parametrize("seed", range(4))
def test_trials_agree_on_backlash(seed):
    """With a backlash of 3 %, more than 90 % of the stretches show it."""
    found = judged(Backlash(3.0), seed)
    assert found.count > 25
    assert found.agreeing > 0.9
    assert found.steadiness > 6


@pytest.mark.parametrize("seed", range(4))
def test_trials_do_not_agree_behind_an_ideal_valve(seed):
    """With an ideal valve, less than two thirds of the stretches show backlash by chance."""
    found = judged(None, seed)
    assert found.agreeing < 0.67
    assert found.steadiness < 2.5


def test_a_fit_has_no_gain_over_itself():
    """A fit has no gain over itself."""
    op = oscillating(1)
    problem = in_blocks(pv_of(Fopdt(1.5, 30.0, 5.0), None, op, 1.0), op, np.ones(N, dtype=bool), 1.0)
    candidate = fit_linear(problem, PERIOD)
    assert not gains(candidate, candidate).any()


def test_too_few_reversals_are_no_trials():
    """A record with two OP reversals has no trials."""
    op = oscillating(1)[:300]
    problem = in_blocks(op.copy(), op, np.ones(300, dtype=bool), 1.0)
    candidate = fit_linear(problem, PERIOD)
    assert trials(candidate, candidate, PERIOD) is None


@pytest.mark.parametrize("seed", range(4))
def test_moves_of_a_stem_are_trials_without_an_oscillation(seed):
    """With a backlash of 3 %, more than 90 % of the stretches between moves of the stem show it. The stem moves
    as often as OP reverses."""
    op = oscillating(seed)
    noise = 0.2 * np.random.default_rng(seed + 100).standard_normal(N)
    problem = in_blocks(
        pv_of(Fopdt(1.5, 30.0, 5.0), Backlash(3.0), op, 1.0) + noise, op, np.ones(N, dtype=bool), 1.0
    )
    linear = fit_linear(problem, PERIOD)
    backlash = fit_backlash(linear, PERIOD)
    found = trials_between_moves(backlash, linear)
    assert found is not None
    assert found.count == pytest.approx(2 * N / PERIOD, abs=3)
    assert found.agreeing > 0.9


def test_a_stem_that_never_moves_is_no_trial():
    """Backlash wider than OP's range gives no move of the stem, and so no trial."""
    op = 50 + np.sin(np.arange(N) / 50.0)
    problem = in_blocks(0.1 * np.random.default_rng(1).standard_normal(N), op, np.ones(N, dtype=bool), 1.0)
    linear = fit_linear(problem, PERIOD)
    still = linear.moved(valve=StemLaw(5.0, 5.0, RESTS))
    assert trials_between_moves(still, linear) is None
