"""What is left of a loop is foretold on held-out data where a law makes it, and not where noise does."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.diagnosis import LEFT_OVER
from identification.mismatch.plain_loop import inputs_of, prepared
from identification.mismatch.reference import Prediction, best_prediction, on_above
from proofs.concealed.plant import Plant
from proofs.experiments import drawn
from tests.proofs.concealed.sealed_loop import PLANT, N, recording

CLOCK = np.arange(N)


def left_of(plant: Plant, seed: int, **acting: np.ndarray) -> Prediction:
    """What the plain loop leaves of a loop of the sealed generator."""
    s = recording(plant, seed, **acting)
    p, fit = prepared(inputs_of(s), s.pv - s.pv.mean(), s.usable)
    return best_prediction(p, fit)


def test_load_and_noise_are_not_foretold() -> None:
    """Of twelve plain loops under load and noise nothing is left, by less than half of what would be told."""
    assert max(left_of(PLANT, seed).gain for seed in range(12)) < 0.5 * LEFT_OVER


@pytest.mark.parametrize(
    "changes",
    [
        {"regime": 0.4, "regime_at": 0.0, "regime_band": 3.0},
        {"tired": 0.15, "tired_s": 300.0},
        {"switch": 3.0, "switch_at": 1.0},
        {"foam": 0.6},
    ],
)
def test_physics_without_a_name_is_left(changes: dict[str, float]) -> None:
    """Four kinds of physics that no effect has are foretold, past what is told of."""
    assert left_of(PLANT._replace(**changes), 21).gain > LEFT_OVER


@pytest.mark.parametrize(
    ("changes", "way"),
    [
        ({"recall": 1.2, "recall_s": 200.0}, "history"),
        ({"echo": 0.2, "echo_s": 120.0}, "past"),
        ({"hurry": 2.0}, "size"),
    ],
)
def test_what_acts_in_one_way_is_left_to_it(changes: dict[str, float], way: str) -> None:
    """A gain that remembers, a recycle and moves that hurry are each foretold best by what makes them."""
    assert left_of(PLANT._replace(**changes), 21).way == way


@pytest.mark.parametrize("seed", [22, 23, 24])
def test_a_pump_by_the_clock_is_left_to_the_clock(seed: int) -> None:
    """A load that is on for a third of every ten minutes is foretold best by a clock, past what is told of; the half
    of it, which noise hides, is not told of."""
    for size in (0.7, 1.5):
        told = left_of(PLANT, seed, act=size * (CLOCK % 600 < 200))
        assert told.way == "clock"
        assert told.gain > LEFT_OVER
    assert left_of(PLANT, seed, act=0.4 * (CLOCK % 600 < 200)).gain < LEFT_OVER


def test_the_errors_of_an_experiment_s_simulation_are_not_foretold() -> None:
    """Of plain plants moved by a script under a load that lasts nothing is left: recorded PV, which tells errors that
    go on from sample to sample whatever makes them, is not asked."""
    for seed in range(6):
        s, _ = drawn("plain", seed)
        p, fit = prepared(inputs_of(s), s.pv - s.pv.mean(), s.usable, experiment=True)
        assert best_prediction(p, fit).gain < LEFT_OVER


def test_a_switch_remembers_where_it_was_last() -> None:
    """Between its ends a switch stands as it was, by hand."""
    x = np.array([0.0, 2.0, 0.6, -0.4, -2.0, 0.4, 0.9, 1.1])
    assert on_above(x, 0.0, 2.0).tolist() == [0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0]
