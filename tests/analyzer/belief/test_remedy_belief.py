"""Advice is the same until something changes, and a pair that some night has proven."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analyzer.words.belief import news, told
from tests.analyzer.belief.nights_of_a_loop import CALM, WORN, followed, row, witness


def advised(ti: list[float], **more: object) -> list[float | None]:
    """Integral times told, night by night, where each night by itself advises another one."""
    rows = [row(k, WORN, ti_new=x, witness=witness(2.0, 60.0), **more) for k, x in enumerate(ti)]
    return [None if b.told.pair is None else b.told.pair.ti for b in followed(rows)]


def test_settings_settle_on_the_third_night_and_stay() -> None:
    """Nights that differ by half around one value: the first stands until the third, then the one amid them for good,
    and it is one of theirs."""
    rng = np.random.default_rng(3)
    own = (400.0 * np.exp(0.25 * rng.standard_normal(12))).round(1).tolist()
    found = advised(own)
    assert found[:2] == [own[0]] * 2
    settled = found[2:5]
    assert len(set(settled)) == 1
    assert found[2] in own
    late = [x for x in found[2:] if x is not None]
    assert max(late) / min(late) < 1.3


def test_the_spread_between_nights_stands_beside_the_settings() -> None:
    """The advice says what nights have advised, and of which the pair is that is held."""
    rows = [row(k, WORN, ti_new=x, witness=witness(2.0, 60.0)) for k, x in enumerate((400.0, 500.0, 450.0))]
    advice = told(followed(rows)[-1], rows[-1])["advice"]
    assert advice == "slower 3 nights advise Kp 0.8 to 0.8 and Ti 400 to 500 s; that of 2026-03-04 is kept."


def test_advice_follows_where_the_nights_have_moved_for_good() -> None:
    """Where nine nights say three times as much as the first three, the settings are told anew."""
    found = advised([100.0, 103.0, 98.0, *[300.0, 305.0, 298.0] * 4])
    assert found[2] == pytest.approx(100.0, abs=3)
    assert found[-1] == pytest.approx(300.0, abs=5)


def test_an_action_takes_more_than_one_night_to_change() -> None:
    """Retune on three nights of four stays retune on the fourth that says repair."""
    repair = {"action": "repair valve", "due": "now", "kp_new": None, "ti_new": None}
    rows = [row(k, WORN, {} if k in (0, 1, 3) else repair, witness=witness(2.0, 60.0)) for k in range(6)]
    assert {b.told.action for b in followed(rows)} == {"retune"}


def test_new_settings_in_force_begin_the_advice_anew() -> None:
    """The pair of the settings before is gone with them; a loop that the change has calmed is left alone."""
    before = [row(k, WORN, witness=witness(2.0, 60.0), oscillation_significance=50.0) for k in range(4)]
    after = row(4, WORN, ti=400.0, ti_new=900.0, witness=witness(2.0, 60.0), oscillation_significance=40.0)
    assert followed([*before, after])[-1].told.pair.ti == 900.0  # type: ignore[union-attr]
    calmed = followed([*before, {**after, "oscillation_significance": 5.0}])[-1].told
    assert (calmed.action, calmed.due, calmed.pair) == ("repair valve", "next shutdown", None)


def test_a_calm_night_of_a_worn_valve_asks_for_no_settings() -> None:
    """A night without a cycle keeps the valve in mind, and advises no settings."""
    rows = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(3)]
    told = followed([*rows, row(3, CALM, witness=witness(2.0, 0.0, 0.0))])[-1].told
    assert (told.cause, told.action, told.due, told.pair) == ("valve", "repair valve", "next shutdown", None)


CHECK: dict[str, Any] = {"action": "check settings", "kp_new": None, "ti_new": None}


def test_no_pair_is_held_where_the_settings_in_force_are_others() -> None:
    """The night that sees other settings in OP than loops.csv states ends what was advised before, and one that
    cannot see them does not bring it back."""
    rows = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(7)]
    rows += [row(7, WORN, CHECK, witness=witness(2.0, 60.0)), row(8, WORN, witness=witness(2.0, 60.0))]
    assert [b.told.action for b in followed(rows)] == ["retune"] * 7 + ["check settings"] * 2
    assert all(b.told.pair is None for b in followed(rows)[7:])


def test_a_list_that_is_put_right_is_no_change_of_the_loop() -> None:
    """Once loops.csv states what was in force, nights count on and what the change had calmed stays calmed."""
    loud = [row(k, WORN, witness=witness(2.0, 60.0), oscillation_significance=50.0) for k in range(4)]
    small = {"oscillation_significance": 5.0, "witness": witness(2.0, 60.0)}
    stale = [row(k, WORN, CHECK, **small) for k in (4, 5, 6)]
    now = followed([*loud, *stale, row(7, WORN, ti=400.0, **small)])[-1]
    assert now.cycle.nights == 4
    assert (now.told.action, now.told.due) == ("repair valve", "next shutdown")


def test_a_cycle_that_has_died_away_takes_its_pair_along() -> None:
    """A pair was proven on the cycle that it was to end: where that is gone, a small one advises anew."""
    loud = [row(k, WORN, witness=witness(2.0, 60.0), oscillation_significance=50.0) for k in range(4)]
    small = row(4, WORN, ti_new=900.0, oscillation_significance=0.5, witness=witness(2.0, 60.0))
    told = followed([*loud, small])[-1].told
    assert told.pair is not None
    assert told.pair.ti == 900.0


def test_settings_that_settle_are_no_news() -> None:
    """The pair amid those of three nights, told in place of the first one's, is not told as a change."""
    rows = [row(k, WORN, ti_new=x, witness=witness(2.0, 60.0)) for k, x in enumerate((400.0, 500.0, 450.0))]
    beliefs = followed(rows)
    assert beliefs[1].told.pair != beliefs[2].told.pair
    assert news(beliefs[1], beliefs[2], rows[2]) == ("", "")


def test_nights_that_abstain_do_not_change_their_word() -> None:
    """Where nights lack something in turn with nights whose signs disagree, what most of them say is told."""
    vague = {"cause": "undecided", "valve_fault": "undecided", "kp_new": None, "ti_new": None}
    words = ["needs data", "needs data", "undecided", "needs data", "undecided", "needs data"]
    rows = [row(k, WORN, vague, action=word) for k, word in enumerate(words)]
    assert {b.told.action for b in followed(rows)} == {"needs data"}
