"""Verdict and explanation are reported together: agreement, other kind, no statement, contradiction, each in a
sentence.
"""

from __future__ import annotations

import pytest

from analyzer.explain.words import TEXTS, agreement, night_note


@pytest.mark.parametrize(
    ("cause", "kind", "verdict", "block", "text"),
    [
        ("valve", "backlash", "backlash", "valve", "agree"),
        ("valve", "undecided", "stiction", "valve", "agree"),
        ("valve", "backlash", "positioner", "valve", TEXTS["beside_verdict"]["stroke"]),
        ("valve", "stiction", "none", "none", "does not confirm it"),
        ("valve", "stiction", "second-lag", "process", "does not confirm it"),
        ("valve", "backlash", "quantization", "sensor", "neither confirms nor contradicts"),
        ("load", "none", "backlash", "valve", "does not consider it"),
        ("none", "none", "valve-characteristic", "valve", "does not consider it"),
    ],
)
def test_each_pair_has_its_sentence(cause: str, kind: str, verdict: str, block: str, text: str) -> None:
    """If only one of the two names a fault, the text says so, and how to settle it."""
    assert text in agreement({"cause": cause, "valve_fault": kind}, verdict, block)


@pytest.mark.parametrize("verdict", ["none", "unexplained", "load-step", "second-lag"])
def test_no_valve_no_sentence(verdict: str) -> None:
    """If neither the verdict nor the explanation concerns a valve, no sentence is added."""
    assert agreement({"cause": "tuning", "valve_fault": "none"}, verdict, "process") == ""


def test_an_unknown_name_of_an_effect_raises_no_error() -> None:
    """A name that the catalogue does not contain, as from a store of another version, raises no error."""
    assert agreement({"cause": "none", "valve_fault": "none"}, "no such effect", "none") == ""


@pytest.mark.parametrize(("block", "text"), [("valve", "calm_valve"), ("process", "calm")])
def test_an_explanation_of_a_loop_without_action_says_so(block: str, text: str) -> None:
    """If the night has no action for a loop, the text for a valve effect says why the night reports none.

    The text for other effects says that they concern the model.
    """
    night = {"cause": "none", "action": "none", "valve_fault": "none", "lanes": None}
    assert (
        night_note(night, "backlash" if block == "valve" else "second-lag", block)
        == (TEXTS["beside_verdict"][text])
    )
