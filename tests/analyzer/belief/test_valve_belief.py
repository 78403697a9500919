"""A worn valve is found by nights together, and only where they agree on its width."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.words.belief import news
from identification.estimation.backlash_stiction import WIDTHS
from tests.analyzer.belief.nights_of_a_loop import (
    CALM,
    DAY_S,
    LIMITS,
    LOAD,
    WORN,
    followed,
    row,
    sound,
    witness,
)


def test_a_fault_too_small_for_one_night_is_found_by_several() -> None:
    """Six tenths of the evidence that one night needs, at one width, is certain by the fourth night and not by the
    first."""
    found = followed([row(k, CALM, witness=witness(0.8, 6.0)) for k in range(5)])
    assert found[0].valve.certain == ""
    assert found[3].told.fault == "backlash"
    assert found[3].told.due == "next shutdown"
    assert found[3].valve.width == pytest.approx(0.8, rel=0.13)


def test_nights_that_differ_in_width_convict_nobody() -> None:
    """Each night has its own width, and speaks against wider ones: no valve is told, though each says as much."""
    widths = [2.4, 0.4, 1.1, 0.3, 4.0, 0.6, 0.25]
    found = followed([row(k, CALM, witness=witness(w, 6.0, against=30.0)) for k, w in enumerate(widths)])
    assert all(b.told.fault == "none" for b in found)


def test_one_great_night_among_calm_ones_is_not_believed() -> None:
    """The best night is left out: a play narrow beside OP's range that one night sees and six do not is none."""
    odd = witness(0.8, 15.0).replace('"op_range": 1.6', '"op_range": 8.0')
    found = followed([row(k, CALM, witness=odd if k == 3 else witness(0.8, 0.0, 0.0)) for k in range(7)])
    assert all(b.told.fault == "none" for b in found)


def test_a_load_that_looks_like_a_play_every_night_convicts_no_valve() -> None:
    """Five times the evidence of a verdict, in eight nights of a cycle that a load makes, tells no worn valve; twenty
    times does, and the cause stays the load's."""
    assert followed([row(k, LOAD, witness=witness(1.5, 50.0)) for k in range(8)])[-1].told.fault == "none"
    told = followed([row(k, LOAD, witness=witness(1.5, 200.0)) for k in range(8)])[-1].told
    assert (told.cause, told.fault, told.action, told.due) == (
        "load",
        "backlash",
        "repair valve",
        "next shutdown",
    )


def test_another_valve_begins_the_belief_anew() -> None:
    """After nights that say 2 %, nights that say nothing at all make the valve sound within three; a single odd one
    does not."""
    worn = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(6)]
    mended = [row(k, CALM, witness=sound()) for k in range(6, 9)]
    found = followed([*worn, *mended])
    assert found[5].valve.certain == "2026-03-02"
    assert found[6].valve.certain == "2026-03-02"
    assert found[8].valve.certain == ""
    assert found[8].valve.since == "2026-03-08"
    assert (
        followed([*worn, mended[0], row(7, WORN, witness=witness(2.0, 60.0))])[-1].valve.certain
        == "2026-03-02"
    )


def test_a_repair_that_is_noted_begins_the_belief_anew_at_once() -> None:
    """A note between two nights ends what was believed of the valve, and no other night's row is needed for it."""
    worn = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(4)]
    calm = row(4, CALM, witness=sound())
    at_s = calm["start_s"] - 3600.0
    assert followed([*worn, calm], (at_s,))[-1].valve.certain == ""
    assert followed([*worn, calm])[-1].valve.certain == "2026-03-02"
    within = followed([*worn, calm], (calm["start_s"] + 0.5 * DAY_S,))[-1]
    assert within.valve.nights == 0  # a night of two valves tells of none


def test_a_change_of_settings_leaves_the_valve_as_worn_as_it_was() -> None:
    """Settings that calm the loop do not mend its valve: it stays known, for the next shutdown."""
    worn = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(4)]
    calm = [row(k, CALM, ti=800.0, witness=witness(2.0, 0.0, 0.0)) for k in range(4, 8)]
    found = followed([*worn, *calm])[-1]
    assert (found.told.cause, found.told.fault, found.told.action) == ("valve", "backlash", "repair valve")
    assert found.cycle.since == "2026-03-06"
    assert found.valve.certain == "2026-03-02"


def test_evidence_fades_with_its_half_life() -> None:
    """What a night said counts half after the half life, whether or not there were nights between."""
    first = row(0, CALM, witness=witness(0.8, 6.0))
    late = row(int(LIMITS.half_life), CALM, witness=witness(0.8, 0.0, 0.0))
    found = followed([first, late])
    whole, half = np.array(found[0].valve.summed), np.array(found[1].valve.summed)
    at = int(np.argmax(whole))
    assert half[at] == pytest.approx(0.5 * whole[at], abs=2e-3)


def test_the_probability_is_bayes_rule_over_widths() -> None:
    """The probability of a worn valve equals prior odds spread over the widths times the likelihood of each."""
    found = followed([row(k, CALM, witness=witness(0.8, 6.0)) for k in range(3)])[-1].valve
    prior = LIMITS.worn_before / WIDTHS.size
    worn = sum(prior * np.exp(x) for x in found.profile)
    assert found.worn_pct(LIMITS) == pytest.approx(100 * worn / (worn + 1 - LIMITS.worn_before))


def test_another_recorder_leaves_the_valve_as_worn_as_it_was() -> None:
    """Where the historian begins to compress, widths and sizes begin anew and the valve's belief does not; nothing of
    it is news, though the cycle is not seen any more and the width seems to be another."""
    whole = [row(k, WORN, witness=witness(2.0, 60.0), straight_pct=0.5) for k in range(6)]
    cut = [row(6 + k, CALM, witness=witness(2.4, 60.0), straight_pct=35.0) for k in range(4)]
    beliefs = followed([*whole, *cut])
    assert {b.valve.since for b in beliefs} == {"2026-03-02"}
    assert all(b.told.fault == "backlash" for b in beliefs[1:])
    assert beliefs[5].constants["width"].pooled.value == pytest.approx(2.0, rel=0.02)  # type: ignore[union-attr]
    assert beliefs[-1].constants["width"].pooled.value == pytest.approx(2.4, rel=0.02)  # type: ignore[union-attr]
    assert [w for _, w, _ in beliefs[-1].widths] == [2.4] * 4
    said = [news(a, b, r) for a, b, r in zip(beliefs[5:], beliefs[6:], cut, strict=False)]
    assert said == [("", "")] * 4
