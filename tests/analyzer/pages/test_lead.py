"""Three sentences for the actions of a shift leader."""

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


def test_a_source_is_named_with_the_loops_that_it_moves() -> None:
    """The source of a group comes first, because it gains most, and its followers have no separate sentence."""
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


def test_only_followers_are_named_as_moved() -> None:
    """A loop that shares the oscillation of a group and keeps its own verdict is not named as moved by the source."""
    rows = [row("FIC1", 60.0, **VALVE), row("TIC2", 20.0, **FOLLOWS), row("LIC3", 30.0, **VALVE)]
    roles = ("source", "follower", "shares")
    members = tuple({"loop": r["loop"], "role": role} for r, role in zip(rows, roles, strict=True))
    group = GroupView("1", members, {r["loop"]: r for r in rows})
    assert first_things(rows, [group]) == (
        "Fix FIC1's valve: it also moves TIC2.",
        "Stroke the valve of LIC3: it has stiction.",
    )


def test_at_most_three_actions_by_their_gain() -> None:
    """Of five kinds of work the three with the largest gain are named; importance counts if it is stated."""
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


def test_a_valve_that_can_wait_is_named_last():
    """A worn valve that can wait has its own sentence, after all work that is due tonight."""
    rows = [row("A", 0.0, **VALVE | {"due": "next shutdown"}), row("B", 0.1, **VALVE | {"due": "now"})]
    assert first_things(rows) == (
        "Stroke the valve of B: it has stiction.",
        "At the next shutdown look at the valve of A: it is worn, and its repair can wait until then.",
    )


def test_unstated_settings_are_not_compared() -> None:
    """Settings that loops.csv does not state are requested, without a sentence about trends that show others."""
    check = {"action": "check settings", "cause": "tuning"}
    rows = [row("A", 9.0, **check), row("B", 5.0, **check, kp=None), row("C", 4.0, **check, ti=None)]
    assert first_things(rows) == (
        "Compare the settings of A with loops.csv: the trends show other settings.",
        "State Kp and Ti of B and C in loops.csv, as their controllers have them: new settings need them.",
    )


def test_one_figure_compares_all_loops() -> None:
    """If one importance is stated, loops without one are also ranked by their error, and not by their
    significance.
    """
    rows = [
        row("A", 90.0, action="retune", cause="tuning", loss=0.2),
        row("B", 1.0, action="repair valve", cause="valve", valve_fault="stiction", loss=3.0, importance=2.0),
    ]
    assert [text.split()[0] for text in first_things(rows)] == ["Stroke", "Type"]


def test_a_night_without_work_says_so() -> None:
    """A night without work gives a sentence too."""
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
    """Three names are listed, and the others are counted."""
    assert listed(names) == text


def test_a_loop_that_oscillates_between_limits_gets_no_check_of_the_valve_size() -> None:
    """For a loop that is too tight and often at a limit, a first step is named, not the size of the valve.

    For a loop without oscillation at its limit, the size of the valve is named.
    """
    tight = row("CH3", 60.0, action="needs data", cause="tuning", lanes="oscillation, at limit")
    still = row("TIC2", 0.0, action="check limit", lanes="at limit")
    lines = first_things([tight, still])
    assert lines[0].startswith("Halve the gain of CH3 or go to manual")
    assert lines[1] == "Find out why OP of TIC2 is at its limit: check the valve's size and supply."
