"""The residual of a loop is predicted on held-out data if physics causes it, and not if noise causes it."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.baseline import inputs_of, prepared
from identification.mismatch.diagnosis import LEAST_RESIDUAL
from identification.mismatch.reference import Prediction, best_prediction, on_above
from proofs.concealed.plant import Plant
from proofs.experiments import drawn
from tests.proofs.concealed.sealed_loop import PLANT, N, recording

CLOCK = np.arange(N)


def residual_prediction(plant: Plant, seed: int, **acting: np.ndarray) -> Prediction:
    """The prediction of the residual of the baseline model, for a loop of the sealed generator."""
    s = recording(plant, seed, **acting)
    p, fit = prepared(inputs_of(s), s.pv - s.pv.mean(), s.usable)
    return best_prediction(p, fit)


def test_load_and_noise_are_not_predicted() -> None:
    """For twelve loops under load and noise without an effect, the prediction gain is below half of the
    reporting limit."""
    assert max(residual_prediction(PLANT, seed).gain for seed in range(12)) < 0.5 * LEAST_RESIDUAL


@pytest.mark.parametrize(
    "changes",
    [
        {"regime": 0.4, "regime_at": 0.0, "regime_band": 3.0},
        {"tired": 0.15, "tired_s": 300.0},
        {"switch": 3.0, "switch_at": 1.0},
        {"foam": 0.6},
    ],
)
def test_physics_without_a_name_is_predicted(changes: dict[str, float]) -> None:
    """Four kinds of physics outside the catalogue have a prediction gain above the reporting limit."""
    assert residual_prediction(PLANT._replace(**changes), 21).gain > LEAST_RESIDUAL


@pytest.mark.parametrize(
    ("changes", "way"),
    [
        ({"recall": 1.2, "recall_s": 200.0}, "history"),
        ({"echo": 0.2, "echo_s": 120.0}, "past"),
        ({"hurry": 2.0}, "size"),
    ],
)
def test_each_kind_of_physics_is_predicted_best_by_its_cause(changes: dict[str, float], way: str) -> None:
    """A gain with history, a recycle and a gain with rate are each predicted best by their own cause."""
    assert residual_prediction(PLANT._replace(**changes), 21).influence == way


@pytest.mark.parametrize("seed", [22, 23, 24])
def test_a_periodic_pump_is_predicted_by_the_clock(seed: int) -> None:
    """A load that is on for 200 s of every 600 s is predicted best by the clock, above the reporting limit. A
    smaller one, which noise hides, is below the limit."""
    for size in (0.7, 1.5):
        prediction = residual_prediction(PLANT, seed, act=size * (CLOCK % 600 < 200))
        assert prediction.influence == "clock"
        assert prediction.gain > LEAST_RESIDUAL
    assert residual_prediction(PLANT, seed, act=0.4 * (CLOCK % 600 < 200)).gain < LEAST_RESIDUAL


def test_the_errors_of_an_experiments_simulation_are_not_predicted() -> None:
    """For processes without an effect, with scripted moves and a lasting load, the prediction gain is below the
    reporting limit. Recorded PV is not used, because it predicts every error that lasts over several samples."""
    for seed in range(6):
        s, _ = drawn("plain", seed)
        p, fit = prepared(inputs_of(s), s.pv - s.pv.mean(), s.usable, experiment=True)
        assert best_prediction(p, fit).gain < LEAST_RESIDUAL


def test_a_switch_keeps_its_last_state() -> None:
    """Between its two limits, a switch keeps its last state."""
    x = np.array([0.0, 2.0, 0.6, -0.4, -2.0, 0.4, 0.9, 1.1])
    assert on_above(x, 0.0, 2.0).tolist() == [0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0]
