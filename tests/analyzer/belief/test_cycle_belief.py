"""The cause and the reported changes are based on all nights with the same settings."""

from __future__ import annotations

import pytest

from analyzer.words.belief import news, reported_columns, reports_repair
from tests.analyzer.belief.nights_of_a_loop import CALM, LOAD, WORN, followed, row, witness

TUNING = {
    **{"cause": "tuning", "valve_fault": "none", "action": "retune", "kp_new": 0.5, "ti_new": 200.0},
    **{"osc_valve_pct": 5.0, "osc_tuning_pct": 90.0, "osc_load_pct": 5.0},
}
FOLLOWS = {**LOAD, "action": "see source loop", "source_loop": "S"}


def headlines(rows: list[dict[str, object]]) -> list[str]:
    """The headline of each night after the first; '' if nothing is reported."""
    found = followed(rows)
    return [news(found[k - 1], found[k], rows[k])[0] for k in range(1, len(rows))]


def test_one_night_with_another_verdict_changes_no_cause() -> None:
    """One load verdict among eight nights is not reported: the tight tuning that the first night found stays the
    cause.
    """
    rows = [row(k, LOAD if k == 4 else TUNING) for k in range(8)]
    assert {b.told.cause for b in followed(rows)} == {"tuning"}
    assert headlines(rows) == [""] * 7


def test_a_follower_stays_one_on_a_night_that_does_not_show_it() -> None:
    """A loop that follows another loop in most nights is reported as a follower on a night whose own verdict is its
    valve.
    """
    rows = [row(k, FOLLOWS) for k in range(5)] + [row(5, WORN, witness=witness(1.0, 20.0))]
    last = followed(rows)[-1].told
    assert (last.cause, last.fault, last.source, last.action) == ("load", "none", "S", "see source loop")
    assert "follows S in most of 6 nights" in reported_columns(followed(rows)[-1], rows[-1])["reason"]


def test_undecided_nights_with_the_same_tendency_decide_together() -> None:
    """Six undecided nights with 48 % against 30 % name the cause together; if the nights lack data, they name
    none.
    """
    leaning = {"cause": "undecided", "valve_fault": "none", "action": "undecided"}
    shares = {"osc_valve_pct": 22.0, "osc_tuning_pct": 48.0, "osc_load_pct": 30.0}
    assert followed([row(k, leaning, shares) for k in range(6)])[-1].told.cause == "tuning"
    lacking = [row(k, leaning, shares, lack="faster samples") for k in range(6)]
    assert followed(lacking)[-1].told.cause == "undecided"


LESS = "oscillates less: ±0.2 % of span"


def sizes_of(significance: float) -> dict[str, float]:
    """A cycle of a given significance; its amplitude is a tenth and its error a twentieth of the significance."""
    sizes = {"pv_amplitude_pct": significance / 10, "average_absolute_error_pct": significance / 20}
    return {"oscillation_significance": float(significance), **sizes}


def test_a_smaller_cycle_is_reported_by_amplitude_and_error() -> None:
    """For a cycle that became smaller, both amplitudes and both errors are reported, and no ratio of scores."""
    rows = [row(k, LOAD, sizes_of(s)) for k, s in enumerate((20, 21, 2))]
    before = "it was ±2.1 % of span, average absolute error 1.05 %"
    assert headlines(rows)[-1] == f"{LESS}, average absolute error 0.1 %; {before}"


@pytest.mark.parametrize(
    ("nights", "expected"),
    [
        ([20, 21, 0, 0, 0], ["", "stopped oscillating", "", ""]),
        ([20, 21, 2, 0, 3, 0, 2], ["", LESS, "", "", "", ""]),
        ([20, 20, 0, 20], ["", "stopped oscillating", "began to oscillate"]),
        ([20, 8, 20, 8, 20], ["", "", "", ""]),
        ([20, 20, 8, 8, 8], ["", "", "oscillates less than before: ±0.8 % of span", ""]),
        ([20, 20, 60, 60, 60], ["", "", "oscillates more than before: ±6 % of span", ""]),
    ],
)
def test_reported_changes_of_amplitude_depend_on_earlier_nights(
    nights: list[float], expected: list[str]
) -> None:
    """A cycle that is small compared with the earlier one neither starts nor stops again, and a new size needs two
    nights.
    """
    rows = [
        row(k, LOAD if s else CALM, sizes_of(s), oscillating_pct=95.0 if s else 0.0)
        for k, s in enumerate(nights)
    ]
    assert [text.split(", average")[0] for text in headlines(rows)] == expected


def test_a_loop_that_cycles_for_a_part_of_the_night_has_not_stopped() -> None:
    """A decrease from 95 % to 40 % of the time does not end an oscillation; a decrease to 10 % does."""
    part = [row(0, LOAD), row(1, CALM, oscillating_pct=40.0, oscillation_significance=12.0), row(2, LOAD)]
    assert headlines(part) == ["", ""]
    few = [row(0, LOAD), row(1, CALM, oscillating_pct=10.0, oscillation_significance=12.0)]
    assert headlines(few) == ["stopped oscillating"]


def test_a_cycle_of_a_slave_on_some_nights_is_not_reported_as_a_change() -> None:
    """A slave whose set point its master moves oscillates on every second night; nothing is reported for the
    slave.
    """
    rows = [row(k, LOAD if k % 2 else CALM) for k in range(6)]
    assert any("oscillat" in h for h in headlines(rows))
    assert headlines([r | {"master": "TIC1"} for r in rows]) == [""] * 5


def test_a_worn_valve_is_reported_as_a_change_once() -> None:
    """The first night on which a valve is believed worn reports it with its width; no later night does."""
    rows = [row(k, CALM, witness=witness(0.8, 6.0)) for k in range(6)]
    headlines_found = headlines(rows)
    assert sum("valve backlash" in text for text in headlines_found) == 1
    assert [text for text in headlines_found if text and "confirmed by" not in text] == []


@pytest.mark.parametrize(
    ("text", "is_done"),
    [
        ("Valve repaired, packing renewed", True),
        ("replaced positioner on 4 March", True),
        ("new actuator", True),
        ("to be repaired at the next shutdown", False),
        ("repair ordered", False),
        ("must be replaced", False),
        ("stroked, packing tight", False),
    ],
)
def test_notes_that_say_a_repair_is_done(text: str, is_done: bool) -> None:
    """A repair counts if the note says that it is done, and does not count if the note says that it is planned."""
    assert reports_repair(text) is is_done
