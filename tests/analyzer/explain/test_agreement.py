"""Verdict and explanation are told together: agreement, other kind, silence, contradiction, each in a sentence."""

from __future__ import annotations

import pytest

from analyzer.explain.words import TOLD, agreement, beside_night


@pytest.mark.parametrize(
    ("cause", "kind", "verdict", "block", "told"),
    [
        ("valve", "backlash", "backlash", "valve", "agree"),
        ("valve", "undecided", "stiction", "valve", "agree"),
        ("valve", "backlash", "positioner", "valve", TOLD["beside_verdict"]["stroke"]),
        ("valve", "stiction", "none", "none", "does not confirm it"),
        ("valve", "stiction", "second-lag", "process", "does not confirm it"),
        ("valve", "backlash", "quantization", "sensor", "neither confirms nor contradicts"),
        ("load", "none", "backlash", "valve", "does not consider it"),
        ("none", "none", "valve-characteristic", "valve", "does not consider it"),
    ],
)
def test_each_pair_has_its_sentence(cause: str, kind: str, verdict: str, block: str, told: str) -> None:
    """What one names and the other does not is said, with what would settle it."""
    assert told in agreement({"cause": cause, "valve_fault": kind}, verdict, block)


@pytest.mark.parametrize("verdict", ["none", "unexplained", "load-step", "second-lag"])
def test_no_valve_no_sentence(verdict: str) -> None:
    """Where neither speaks of a valve nothing is added."""
    assert agreement({"cause": "tuning", "valve_fault": "none"}, verdict, "process") == ""


def test_words_nobody_knows_do_no_harm() -> None:
    """A store written by another version may hold a name that the catalogue lacks."""
    assert agreement({"cause": "none", "valve_fault": "none"}, "no such effect", "none") == ""


@pytest.mark.parametrize(("block", "told"), [("valve", "calm_valve"), ("process", "calm")])
def test_an_explanation_of_a_calm_loop_says_that_the_night_asks_for_nothing(block: str, told: str) -> None:
    """Of a loop with nothing to do the explanation of a valve says why the night reports none, others that they are
    about the model."""
    night = {"cause": "none", "action": "none", "valve_fault": "none", "lanes": None}
    assert (
        beside_night(night, "backlash" if block == "valve" else "second-lag", block)
        == (TOLD["beside_verdict"][told])
    )
