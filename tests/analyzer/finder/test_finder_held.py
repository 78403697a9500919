"""Set points show which of two tags is PV and which is OP if the control law between them does not show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.finder.held import (
    answers,
    closeness,
    deviation_of_mean,
    long_blocks,
    nearness,
    nearness_margin,
    resting_level,
)
from analyzer.finder.pair import SURE_PCT, FoundPair
from analyzer.finder.pairs import found_pairs
from analyzer.finder.tag_set import ANSWERS, HELD_ALONE
from tests.analyzer.finder.test_finder_pairs import pi_loop, unrelated_tags


def p_loop(moves: int, n: int = 20000, seed: int = 1) -> np.ndarray:
    """SP, PV and OP of a P controller on a fast flow; the recorded noise of PV differs from the noise in the
    controller.
    """
    rng = np.random.default_rng(seed)
    steps = np.zeros(n)
    steps[rng.choice(np.arange(100, n), moves, replace=False)] = 3.0 * rng.normal(size=moves)
    sp, out, flow = 300.0 + np.cumsum(steps), np.empty((n, 3)), 300.0
    for k in range(n):
        op = 40.0 + 0.3 * (sp[k] - flow - rng.normal())
        out[k] = sp[k], flow + rng.normal(), op
        flow += 0.4 * (sp[k] + 1.0 * (op - 40.0) - flow)
    return out


def test_a_controller_whose_noise_is_not_recorded_is_found_by_its_set_point() -> None:
    """PV and OP share no noise, and OP leads PV: the loop is found because OP moves at once with the set point of
    PV.
    """
    values = np.column_stack([unrelated_tags(20000, 10, 3), p_loop(60), p_loop(60, seed=2)])
    sure = {(p.sp, p.pv, p.op) for p in found_pairs(values) if p.sure_pct >= SURE_PCT}
    assert sure == {(10, 11, 12), (13, 14, 15)}


def test_the_level_at_which_op_is_constant_is_the_set_point_despite_limits_of_op() -> None:
    """If OP is at a limit for hours, the mean of PV is wrong as SP; the control law between the limits still gives
    SP.
    """
    rng = np.random.default_rng(4)
    n, kp, ti = 8000, 2.0, 50.0
    pv = (
        50.0
        + 2.0 * np.sin(np.arange(n) / 40.0)
        + 1.5 * (np.arange(n) % 2000 < 500)
        + 0.05 * rng.normal(size=n)
    )
    op, last, before = np.empty(n), 40.0, pv[0]
    for k in range(n):
        last = min(max(last - kp * (pv[k] - before + (pv[k] - 50.0) / ti), 0.0), 100.0)
        op[k], before = last, pv[k]
    level, error = resting_level(pv, op, 1)
    assert abs(pv.mean() - 50.0) > 0.2
    assert level == pytest.approx(50.0, abs=0.02)
    assert error < 0.02


def test_op_responds_to_a_set_point_at_once_and_pv_does_not() -> None:
    """In a PI loop that is sampled faster than its process, only OP moves at once with SP, and PV is nearer to SP."""
    sp, pv, op = pi_loop(2.0, 60.0, 0.5).T
    values = np.column_stack([pv, op, sp])
    size = answers(values, (0, 1), (2,))[:, 0]
    assert size[1] > ANSWERS > size[0]
    near = nearness(values, (0, 1), (2,))[:, 0]
    assert near[0] > near[1] + HELD_ALONE


def test_a_tag_that_repeats_a_set_point_does_not_respond_to_it() -> None:
    """The output of a master in another unit is the set point of its slave, and not an output of the slave."""
    op = np.cumsum(np.random.default_rng(5).normal(size=3000))
    assert answers(np.column_stack([0.5 * op + 3.0, op]), (0,), (1,))[0, 0] < ANSWERS


def test_a_response_of_op_is_no_proof_of_pv() -> None:
    """A pair whose OP responds to the set point is not sure if another tag explains more of OP with that set
    point.
    """
    answering = FoundPair(0, 1, 2, 0.4, 0.6, 1, 0.04, 0.0, output_evidence=4.0, answers=True, other=0.43)
    assert answering.sure_pct >= SURE_PCT
    assert replace(answering, other=0.46).sure_pct < SURE_PCT


def test_a_sensor_that_follows_pv_is_not_chosen_as_pv() -> None:
    """A pair whose law leaves a residual of 18 % is not sure if another tag with its set point leaves 0.3 %."""
    follower = FoundPair(0, 1, 2, 0.82, 0.4, 4, 0.5, 0.04, direction_evidence=2.0, nearer=1.0, other=0.997)
    assert follower.sure_pct < SURE_PCT
    assert replace(follower, other=0.5).sure_pct >= SURE_PCT


def test_a_mean_that_drifts_is_known_to_its_standard_error() -> None:
    """The standard error of the mean of a first-order process agrees with theory within a third."""
    rng = np.random.default_rng(6)
    n, a = 20000, 0.95
    x = np.empty(n)
    x[0] = 0.0
    for k in range(1, n):
        x[k] = a * x[k - 1] + rng.normal()
    assert deviation_of_mean(long_blocks(x[:, None]))[0] == pytest.approx(
        1.0 / (1.0 - a) / np.sqrt(n), rel=1 / 3
    )


@pytest.mark.parametrize(("spread", "exact"), [(0.5, False), (5.0, True), (50.0, False)])
def test_a_random_set_point_is_separate_as_rarely_as_theory_predicts(spread: float, exact: bool) -> None:
    """Of random levels, a share of e^-k is nearer than the next one by a factor e^k; the share is never larger, for
    any spread.
    """
    rng = np.random.default_rng(7)
    x = 50.0 + spread * np.resize([-1.0, 1.0], 1000)
    found = []
    for level in rng.uniform(0.0, 100.0, (6000, 40)):
        near = closeness(np.abs(level - x.mean()), x.std())
        found.append(nearness_margin(x, level, near))
    share = (np.array(found)[:, None] > (1.0, 2.0, 3.0)).mean(axis=0)
    assert (share < 1.15 * np.exp([-1.0, -2.0, -3.0])).all()
    assert not exact or share == pytest.approx(np.exp([-1.0, -2.0, -3.0]), rel=0.15)


def test_a_set_point_as_near_as_others_is_not_separate() -> None:
    """If several set points lie at similar distances from the middle of a wide OP, none of them is chosen, although
    all are near.
    """
    x = np.linspace(0.0, 100.0, 101)
    level = np.array([51.0, 49.0, 49.0])
    near = closeness(np.abs(level - x.mean()), x.std())
    assert nearness_margin(x, level, near) == pytest.approx(0.0, abs=1e-9)


def test_a_single_set_point_near_a_quiet_pv_is_separate_by_the_distance_of_the_next() -> None:
    """The next set point counts by its distance, also if it lies far outside the spread of PV."""
    x = 36.24 + 0.04 * np.resize([-1.0, 1.0], 1000)
    level = np.array([36.25, 37.24, 30.0])
    near = closeness(np.abs(level - x.mean()), x.std())
    assert nearness_margin(x, level, near) == pytest.approx(np.log(100.0), rel=1e-6)
