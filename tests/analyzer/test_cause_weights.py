"""What the signs of a cause weigh: the scorecard's arithmetic, its ways, and the regression that it comes from."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from analyzer.loop.cause_weights import NAMES, chances, parted, pushes, weights
from analyzer.loop.decisions import CAUSES, Cause
from proofs.cause_weights import WAYS, fitted

LOW, HIGH = -3.0, 8.0


def drawn(seed: int) -> np.ndarray:
    """Measures of no loop in particular."""
    return np.random.default_rng(seed).uniform(LOW, HIGH, len(NAMES))


def slow(found: np.ndarray) -> dict[Cause, float]:
    """The same probabilities, the line of every measure walked from zero segment by segment."""
    w = weights()
    total = dict(zip(CAUSES, w.base, strict=True))
    for name, x in zip(NAMES, found, strict=True):
        edges = [-math.inf, *w.knots[name], math.inf]
        for k, (low, high) in enumerate(pairwise(edges)):
            length = min(x, high) if k == 0 else min(max(x - low, 0.0), high - low)
            for c, cause in enumerate(CAUSES):
                total[cause] += length * w.pieces[name][k, c]
    odds = {c: math.exp(v - max(total.values())) for c, v in total.items()}
    return {c: v / sum(odds.values()) for c, v in odds.items()}


@pytest.mark.parametrize("seed", range(5))
def test_probabilities_are_those_of_a_slow_twin_and_sum_to_one(seed):
    """A scorecard is a sum over its broken lines, and its probabilities share one among the causes."""
    found = drawn(seed)
    ours, theirs = chances(found), slow(found)
    assert sum(ours.values()) == pytest.approx(1.0)
    assert [ours[c] for c in CAUSES] == pytest.approx([theirs[c] for c in CAUSES])


def test_parts_of_a_value_sum_to_it():
    """The part below the first knot and those beyond each add up to the value, wherever it lies."""
    x = np.linspace(-5.0, 5.0, 41)
    for knots in (np.array([0.3]), np.array([-1.0, 2.0]), np.array([-1.0, 0.0, 2.0])):
        assert np.allclose(parted(x, knots).sum(axis=-1), x)


def test_pushes_tell_the_causes_apart_and_nothing_else():
    """A push is about the mean over the causes: adding one number to all three odds says nothing."""
    for push in pushes(drawn(1)).values():
        assert push.sum() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_signs_point_the_way_that_physics_gives_them(name):
    """Where more of a measure may only speak for a cause, its odds never fall with it, and the other way round."""
    for k, way in enumerate(WAYS[name]):
        slopes = weights().pieces[name][:, k]
        assert way != "+" or (slopes >= 0.0).all()
        assert way != "-" or (slopes <= 0.0).all()
        assert way != "0" or not slopes.any()


def test_more_evidence_of_a_faulty_valve_never_speaks_against_it():
    """Of any loop, more log likelihood for a play raises the valve's probability or leaves it."""
    for seed in range(20):
        found = drawn(seed)
        before = chances(found)[Cause.VALVE]
        found[NAMES.index("evidence")] += 1.0
        assert chances(found)[Cause.VALVE] >= before - 1e-12


def test_regression_finds_the_weights_that_data_were_drawn_with():
    """Of 20,000 draws from a known logit the odds come back within a tenth, and a way that is barred stays zero."""
    rng = np.random.default_rng(3)
    x = rng.normal(size=(20_000, 2))
    score = np.stack([2.0 * x[:, 0], np.zeros(len(x)), 1.0 * x[:, 1]], axis=1)
    odds = np.exp(score)
    y = (rng.random(len(x))[:, None] > np.cumsum(odds / odds.sum(axis=1, keepdims=True), axis=1)).sum(axis=1)
    w, _ = fitted(x, y, ["f00", "00f"])
    assert w[0, 0] == pytest.approx(2.0, rel=0.1)
    assert w[1, 2] == pytest.approx(1.0, rel=0.1)
    assert not w[0, 1:].any()
    assert not w[1, :2].any()
