"""Physics outside the catalogue, of plants that share no code with the estimator, is told in words, not by name."""

import numpy as np
import pytest

from identification.mismatch.answer import Answer, answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.words import check, reason
from proofs.concealed.plant import Plant
from tests.proofs.concealed.sealed_loop import PLANT, N, recording


def asked(plant: Plant, seed: int, **acting: np.ndarray) -> Answer:
    """The answer for a loop of the sealed generator."""
    s = recording(plant, seed, **acting)
    return answer(explain(s), s)


def test_gain_that_remembers_is_told_in_words() -> None:
    """A gain that goes with PV's mean over a quarter of an hour gets no name, and its figures are within a fifth."""
    said = asked(PLANT._replace(recall=1.2, recall_s=900.0), 1)
    assert said.verdict == "unexplained"
    assert said.block == "process"
    assert said.outside is not None
    assert said.outside.name == "gain-with-history"
    assert said.outside.parameters["recall"].value == pytest.approx(1.2, rel=0.2)
    assert said.outside.parameters["recall_s"].value == pytest.approx(900.0, rel=0.2)
    assert "depends on PV's past over the last" in reason(said)


def test_load_that_pv_switches_is_told_in_words() -> None:
    """A load of 3 % that PV switches on at 53 % gets no name; its size and place are found."""
    said = asked(PLANT._replace(switch=3.0, switch_at=1.0, switch_band=1.0), 2)
    assert said.verdict == "unexplained"
    assert said.block == "load"
    assert said.outside is not None
    assert said.outside.name == "switched-load"
    assert said.outside.parameters["switched_load_pct"].value == pytest.approx(3.0, rel=0.1)
    assert said.outside.parameters["switches_at_pct"].value == pytest.approx(53.0, abs=0.5)
    assert "a switch on PV" in check({"verdict": "unexplained", "outside": {"name": said.outside.name}})


def test_moves_that_count_for_more_when_fast_are_told_in_words() -> None:
    """A flow that goes beyond fast moves gets no name; by how much and for how long are found within a fifth."""
    said = asked(PLANT._replace(hurry=2.0), 6)
    assert (said.verdict, said.block) == ("unexplained", "valve")
    assert said.outside is not None
    assert said.outside.name == "gain-with-rate"
    assert said.outside.parameters["hurry"].value == pytest.approx(2.0, rel=0.2)
    assert said.outside.parameters["hurry_s"].value == pytest.approx(0.5 * PLANT.T, rel=0.2)


def test_recycle_is_told_in_words() -> None:
    """A fifth that comes back after two minutes gets no name; share and way are found within a tenth."""
    said = asked(PLANT._replace(echo=0.2, echo_s=120.0), 7)
    assert (said.verdict, said.block) == ("unexplained", "process")
    assert said.outside is not None
    assert said.outside.name == "recycle"
    assert said.outside.parameters["returned"].value == pytest.approx(0.2, rel=0.1)
    assert said.outside.parameters["returns_s"].value == pytest.approx(120.0, rel=0.1)


def test_plain_loop_is_not_given_physics_of_no_name() -> None:
    """Where set points move a plain loop under load and noise, nothing is left to explain."""
    for seed in (3, 4):
        said = asked(PLANT, seed)
        assert (said.verdict, said.outside) == ("none", None)


def test_supply_that_wanders_keeps_its_name() -> None:
    """A supply that sways twice in the record by itself is a supply, though a gain that remembers sways as well."""
    sway = 1.0 + 0.15 * np.sin(4.0 * np.pi * np.arange(N) / N)
    said = asked(PLANT, 5, supply=sway)
    assert (said.verdict, said.outside) == ("supply-variation", None)
