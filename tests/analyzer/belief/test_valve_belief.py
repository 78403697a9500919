"""A worn valve is found by several nights together, if they agree on its width."""

from __future__ import annotations

import json

import numpy as np
import pytest

from analyzer.belief.belief import CONSTANTS
from analyzer.words.belief import news
from identification.estimation.backlash_stiction import WIDTHS
from tests.analyzer.belief.nights_of_a_loop import (
    CALM,
    DAY_S,
    LIMITS,
    LOAD,
    WORN,
    followed,
    no_fault,
    row,
    witness,
)


def test_a_fault_too_small_for_one_night_is_found_by_several() -> None:
    """With 60 % of the required evidence in each night, at one width, the fault is found by the fourth night and not
    by the first.
    """
    found = followed([row(k, CALM, witness=witness(0.8, 6.0)) for k in range(5)])
    assert found[0].valve.certain == ""
    assert found[3].told.fault == "backlash"
    assert found[3].told.due == "next shutdown"
    assert found[3].valve.width == pytest.approx(0.8, rel=0.13)


def test_nights_that_differ_in_width_give_no_valve_fault() -> None:
    """If each night finds another width, and evidence against wider ones, no valve fault is reported although each
    night has the same evidence.
    """
    widths = [2.4, 0.4, 1.1, 0.3, 4.0, 0.6, 0.25]
    found = followed([row(k, CALM, witness=witness(w, 6.0, against=30.0)) for k, w in enumerate(widths)])
    assert all(b.told.fault == "none" for b in found)


def test_one_night_of_high_evidence_among_others_without_is_not_enough() -> None:
    """The best night is left out: a backlash that only one of seven nights shows is not reported.

    Its width is small compared with the range of OP in that night.
    """
    odd = witness(0.8, 15.0).replace('"op_range": 1.6', '"op_range": 8.0')
    found = followed([row(k, CALM, witness=odd if k == 3 else witness(0.8, 0.0, 0.0)) for k in range(7)])
    assert all(b.told.fault == "none" for b in found)


def test_a_load_that_looks_like_backlash_every_night_gives_no_valve_fault() -> None:
    """Eight nights of a load cycle with five times the evidence of a verdict give no valve fault. With twenty times
    the evidence they do, and the cause stays the load.
    """
    assert followed([row(k, LOAD, witness=witness(1.5, 50.0)) for k in range(8)])[-1].told.fault == "none"
    reported = followed([row(k, LOAD, witness=witness(1.5, 200.0)) for k in range(8)])[-1].told
    assert (reported.cause, reported.fault, reported.action, reported.due) == (
        "load",
        "backlash",
        "repair valve",
        "next shutdown",
    )


def test_another_valve_starts_the_belief_again() -> None:
    """After nights that find 2 %, nights without backlash clear the valve within three nights; one single such night
    does not.
    """
    worn = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(6)]
    repaired = [row(k, CALM, witness=no_fault()) for k in range(6, 9)]
    found = followed([*worn, *repaired])
    assert found[5].valve.certain == "2026-03-02"
    assert found[6].valve.certain == "2026-03-02"
    assert found[8].valve.certain == ""
    assert found[8].valve.since == "2026-03-08"
    assert (
        followed([*worn, repaired[0], row(7, WORN, witness=witness(2.0, 60.0))])[-1].valve.certain
        == "2026-03-02"
    )


def test_a_noted_repair_starts_the_belief_again_at_once() -> None:
    """A note on a repair between two nights ends the belief of the valve at once, without further nights."""
    worn = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(4)]
    calm = row(4, CALM, witness=no_fault())
    at_s = calm["start_s"] - 3600.0
    assert followed([*worn, calm], (at_s,))[-1].valve.certain == ""
    assert followed([*worn, calm])[-1].valve.certain == "2026-03-02"
    within = followed([*worn, calm], (calm["start_s"] + 0.5 * DAY_S,))[-1]
    assert within.valve.nights == 0  # this night belongs to two valves and is evidence for neither


def test_a_change_of_settings_does_not_change_the_belief_in_the_valve() -> None:
    """Settings that end the oscillation do not repair the valve: it stays in the list for the next shutdown."""
    worn = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(4)]
    calm = [row(k, CALM, ti=800.0, witness=witness(2.0, 0.0, 0.0)) for k in range(4, 8)]
    found = followed([*worn, *calm])[-1]
    assert (found.told.cause, found.told.fault, found.told.action) == ("valve", "backlash", "repair valve")
    assert found.cycle.since == "2026-03-06"
    assert found.valve.certain == "2026-03-02"


def test_evidence_fades_with_its_half_life() -> None:
    """The evidence of a night counts half after the half life, with or without nights in between."""
    first = row(0, CALM, witness=witness(0.8, 6.0))
    late = row(int(LIMITS.half_life), CALM, witness=witness(0.8, 0.0, 0.0))
    found = followed([first, late])
    whole, half = np.array(found[0].valve.summed), np.array(found[1].valve.summed)
    at = int(np.argmax(whole))
    assert half[at] == pytest.approx(0.5 * whole[at], abs=2e-3)


def test_the_probability_is_bayes_rule_over_widths() -> None:
    """The probability of a worn valve equals the prior odds, spread over the widths, times the likelihood of each
    width.
    """
    found = followed([row(k, CALM, witness=witness(0.8, 6.0)) for k in range(3)])[-1].valve
    prior = LIMITS.worn_before / WIDTHS.size
    worn = sum(prior * np.exp(x) for x in found.profile)
    assert found.worn_pct(LIMITS) == pytest.approx(100 * worn / (worn + 1 - LIMITS.worn_before))


def test_another_recorder_does_not_change_the_belief_in_the_valve() -> None:
    """If the historian begins to compress, the pools of widths and sizes start again and the belief in the valve does
    not. Neither the missing cycle nor the other width is reported as a change.
    """
    whole = [row(k, WORN, witness=witness(2.0, 60.0), straight_pct=0.5) for k in range(6)]
    cut = [row(6 + k, CALM, witness=witness(2.4, 60.0), straight_pct=35.0) for k in range(4)]
    beliefs = followed([*whole, *cut])
    assert {b.valve.since for b in beliefs} == {"2026-03-02"}
    assert all(b.told.fault == "backlash" for b in beliefs[1:])
    assert beliefs[5].constants["width"].pooled.value == pytest.approx(2.0, rel=0.02)  # type: ignore[union-attr]
    assert beliefs[-1].constants["width"].pooled.value == pytest.approx(2.4, rel=0.02)  # type: ignore[union-attr]
    assert [w for _, w, _ in beliefs[-1].widths] == [2.4] * 4
    changes = [news(a, b, r) for a, b, r in zip(beliefs[5:], beliefs[6:], cut, strict=False)]
    assert changes == [("", "")] * 4


def test_constants_of_experiments_are_stored_in_one_order() -> None:
    """The constants of a night with an experiment alone have the order of CONSTANTS, in every process."""
    given = {name: [2.0, 0.1] for name in reversed(CONSTANTS)}
    experiment = {"oscillating_pct": None, "experiment": "[]", "witness": json.dumps(given)}
    assert tuple(followed([row(0, experiment)])[-1].constants) == CONSTANTS
