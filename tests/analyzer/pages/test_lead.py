"""Three sentences that a shift leader can act on."""

from __future__ import annotations

from typing import Any

import pytest

from analyzer.pages.summary import CALM, first_things, listed
from analyzer.plantwide.view import GroupView

ROW: dict[str, Any] = {
    **{"loss": None, "oscillation_significance": 0.0, "action": "none", "cause": "none", "lanes": None},
    **{"valve_fault": "none", "period_s": 600.0, "importance": None, "kp": 1.0, "ti": 60.0, "due": None},
    **{"stickband_pct": None, "backlash_pct": None, "lack": None},
}


def row(loop: str, significance: float, **values: Any) -> dict[str, Any]:
    """A row of the night."""
    return {**ROW, "loop": loop, "oscillation_significance": significance, **values}


VALVE = {"action": "repair valve", "cause": "valve", "valve_fault": "stiction"}
FOLLOWS = {"action": "see source loop", "cause": "load"}


def test_a_source_is_named_with_whom_it_moves() -> None:
    """The source of a group comes first, for it gains most, and its followers have no sentence of their own."""
    rows = [row("FIC2110", 60.0, **VALVE), row("LIC2103", 75.0, **FOLLOWS), row("TIC2111", 20.0, **FOLLOWS)]
    rows.append(row("LIC1", 90.0, **VALVE))
    members = tuple(
        {"loop": r["loop"], "role": "source" if i == 0 else "follower"} for i, r in enumerate(rows[:3])
    )
    group = GroupView("1", members, {r["loop"]: r for r in rows[:3]})
    assert first_things(rows, [group]) == (
        "Fix FIC2110's valve: it also moves LIC2103 and TIC2111.",
        "Stroke the valve of LIC1: it has stiction.",
    )


def test_only_followers_are_said_to_be_moved() -> None:
    """A loop that shares a group's wave and keeps a verdict of its own is not said to be moved by the source."""
    rows = [row("FIC1", 60.0, **VALVE), row("TIC2", 20.0, **FOLLOWS), row("LIC3", 30.0, **VALVE)]
    roles = ("source", "follower", "shares")
    members = tuple({"loop": r["loop"], "role": role} for r, role in zip(rows, roles, strict=True))
    group = GroupView("1", members, {r["loop"]: r for r in rows})
    assert first_things(rows, [group]) == (
        "Fix FIC1's valve: it also moves TIC2.",
        "Stroke the valve of LIC3: it has stiction.",
    )


def test_three_at_most_by_what_they_gain() -> None:
    """Of five kinds of work the three that gain most are told; importance counts where it is stated."""
    rows = [
        row("A", 1.0, action="retune", cause="valve", valve_fault="backlash", loss=9.0, importance=3.0),
        row("B", 50.0, action="retune", cause="tuning", loss=1.0),
        row("C", 2.0, action="check measurement", lanes="lasting error", loss=8.0),
        row("D", 0.0, action="check limit", lanes="at limit", loss=20.0),
        row("E", 99.0, action="check settings", loss=0.5),
    ]
    found = first_things(rows)
    assert [text.split(":")[0] for text in found] == [
        "Find out why OP of D is at its limit",
        "Type new settings into A",
        "Check the measurement of C",
    ]


def test_a_valve_that_can_wait_is_told_last():
    """A worn valve that can wait has a sentence of its own, behind all that costs something tonight."""
    rows = [row("A", 0.0, **VALVE | {"due": "next shutdown"}), row("B", 0.1, **VALVE | {"due": "now"})]
    assert first_things(rows) == (
        "Stroke the valve of B: it has stiction.",
        "At the next shutdown look at the valve of A: it is worn, and its repair can wait until then.",
    )


def test_what_is_not_stated_is_not_compared() -> None:
    """Settings that loops.csv does not state are asked for; nothing is said of trends that show others."""
    ask = {"action": "check settings", "cause": "tuning"}
    rows = [row("A", 9.0, **ask), row("B", 5.0, **ask, kp=None), row("C", 4.0, **ask, ti=None)]
    assert first_things(rows) == (
        "Compare the settings of A with loops.csv: the trends show other settings.",
        "State Kp and Ti of B and C in loops.csv, as their controllers have them: new settings need them.",
    )


def test_one_figure_compares_all_loops() -> None:
    """Where one importance is stated, loops without one count by their error too, and not by their significance."""
    rows = [
        row("A", 90.0, action="retune", cause="tuning", loss=0.2),
        row("B", 1.0, action="repair valve", cause="valve", valve_fault="stiction", loss=3.0, importance=2.0),
    ]
    assert [text.split()[0] for text in first_things(rows)] == ["Stroke", "Type"]


def test_a_calm_night_says_so() -> None:
    """Nothing to do is a sentence too."""
    assert first_things([row("A", 0.0)]) == (CALM,)
    assert first_things([]) == (CALM,)


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["A"], "A"),
        (["A", "B"], "A and B"),
        (["A", "B", "C"], "A, B and C"),
        (list("ABCDE"), "A, B, C and 2 more"),
    ],
)
def test_names_read_as_a_list(names: list[str], text: str) -> None:
    """A few names are told, the rest counted."""
    assert listed(names) == text


def test_a_loop_that_swings_from_limit_to_limit_is_not_sent_to_the_valves_size() -> None:
    """Of a loop too tight for its process that rests at a limit half of the time, an interim step is told, not the
    valve's size; of a calm loop at its limit the valve's size is."""
    tight = row("CH3", 60.0, action="needs data", cause="tuning", lanes="oscillation, at limit")
    still = row("TIC2", 0.0, action="check limit", lanes="at limit")
    said = first_things([tight, still])
    assert said[0].startswith("Halve the gain of CH3 or go to manual")
    assert said[1] == "Find out why OP of TIC2 is at its limit: check the valve's size and supply."
