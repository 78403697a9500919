"""The advice stays the same until something changes, and its pair of settings comes from one night."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analyzer.words.belief import news, reported_columns
from tests.analyzer.belief.nights_of_a_loop import CALM, WORN, followed, row, witness


def advised(ti: list[float], **more: object) -> list[float | None]:
    """The reported integral time of each night, if each night by itself advises another one."""
    rows = [row(k, WORN, ti_new=x, witness=witness(2.0, 60.0), **more) for k, x in enumerate(ti)]
    return [None if b.told.pair is None else b.told.pair.ti for b in followed(rows)]


def test_settings_settle_on_the_third_night_and_stay() -> None:
    """If the advice of single nights scatters around one value, the first pair is kept until the third night. Then a
    pair from the middle of the scatter is kept, which one of the nights advised.
    """
    rng = np.random.default_rng(3)
    own = (400.0 * np.exp(0.25 * rng.standard_normal(12))).round(1).tolist()
    found = advised(own)
    assert found[:2] == [own[0]] * 2
    settled = found[2:5]
    assert len(set(settled)) == 1
    assert found[2] in own
    late = [x for x in found[2:] if x is not None]
    assert max(late) / min(late) < 1.3


def test_the_spread_between_nights_is_shown_with_the_settings() -> None:
    """The advice states the range that the nights advise and the night whose pair is kept."""
    rows = [row(k, WORN, ti_new=x, witness=witness(2.0, 60.0)) for k, x in enumerate((400.0, 500.0, 450.0))]
    advice = reported_columns(followed(rows)[-1], rows[-1])["advice"]
    assert advice == "slower 3 nights advise Kp 0.8 to 0.8 and Ti 400 to 500 s; that of 2026-03-04 is kept."


def test_advice_follows_a_lasting_change_of_the_nights() -> None:
    """If twelve nights advise three times the integral time of the first three nights, the reported settings
    change.
    """
    found = advised([100.0, 103.0, 98.0, *[300.0, 305.0, 298.0] * 4])
    assert found[2] == pytest.approx(100.0, abs=3)
    assert found[-1] == pytest.approx(300.0, abs=5)


def test_an_action_takes_more_than_one_night_to_change() -> None:
    """Retune on most nights stays retune on a night that advises a repair."""
    repair = {"action": "repair valve", "due": "now", "kp_new": None, "ti_new": None}
    rows = [row(k, WORN, {} if k in (0, 1, 3) else repair, witness=witness(2.0, 60.0)) for k in range(6)]
    assert {b.told.action for b in followed(rows)} == {"retune"}


def test_new_settings_in_force_start_the_advice_again() -> None:
    """New settings end the earlier advised pair; if they reduced the oscillation, no new pair is advised."""
    before = [row(k, WORN, witness=witness(2.0, 60.0), oscillation_significance=50.0) for k in range(4)]
    after = row(4, WORN, ti=400.0, ti_new=900.0, witness=witness(2.0, 60.0), oscillation_significance=40.0)
    assert followed([*before, after])[-1].told.pair.ti == 900.0  # type: ignore[union-attr]
    smaller = followed([*before, {**after, "oscillation_significance": 5.0}])[-1].told
    assert (smaller.action, smaller.due, smaller.pair) == ("repair valve", "next shutdown", None)


def test_a_night_without_a_cycle_of_a_worn_valve_advises_no_settings() -> None:
    """A night without a cycle keeps the worn valve in the list and advises no settings."""
    rows = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(3)]
    last = followed([*rows, row(3, CALM, witness=witness(2.0, 0.0, 0.0))])[-1].told
    assert (last.cause, last.action, last.due, last.pair) == (
        "valve",
        "repair valve",
        "next shutdown",
        None,
    )


CHECK: dict[str, Any] = {"action": "check settings", "kp_new": None, "ti_new": None}


def test_no_pair_is_kept_if_other_settings_are_in_force() -> None:
    """A night that finds other settings in OP than loops.csv states ends the earlier advice. A later night that
    cannot find them does not restore it.
    """
    rows = [row(k, WORN, witness=witness(2.0, 60.0)) for k in range(7)]
    rows += [row(7, WORN, CHECK, witness=witness(2.0, 60.0)), row(8, WORN, witness=witness(2.0, 60.0))]
    assert [b.told.action for b in followed(rows)] == ["retune"] * 7 + ["check settings"] * 2
    assert all(b.told.pair is None for b in followed(rows)[7:])


def test_a_corrected_loops_csv_is_no_change_of_the_loop() -> None:
    """If loops.csv is corrected to the settings in force, the count of nights continues and no new pair is
    advised.
    """
    loud = [row(k, WORN, witness=witness(2.0, 60.0), oscillation_significance=50.0) for k in range(4)]
    small = {"oscillation_significance": 5.0, "witness": witness(2.0, 60.0)}
    stale = [row(k, WORN, CHECK, **small) for k in (4, 5, 6)]
    now = followed([*loud, *stale, row(7, WORN, ti=400.0, **small)])[-1]
    assert now.cycle.nights == 4
    assert (now.told.action, now.told.due) == ("repair valve", "next shutdown")


def test_the_end_of_a_cycle_ends_its_pair() -> None:
    """A pair holds for the cycle that it was to end: if that cycle is gone, a small cycle gets new settings."""
    loud = [row(k, WORN, witness=witness(2.0, 60.0), oscillation_significance=50.0) for k in range(4)]
    small = row(4, WORN, ti_new=900.0, oscillation_significance=0.5, witness=witness(2.0, 60.0))
    reported = followed([*loud, small])[-1].told
    assert reported.pair is not None
    assert reported.pair.ti == 900.0


def test_settings_that_settle_are_not_reported_as_a_change() -> None:
    """The change from the pair of the first night to the pair of the third night is not reported as a change."""
    rows = [row(k, WORN, ti_new=x, witness=witness(2.0, 60.0)) for k, x in enumerate((400.0, 500.0, 450.0))]
    beliefs = followed(rows)
    assert beliefs[1].told.pair != beliefs[2].told.pair
    assert news(beliefs[1], beliefs[2], rows[2]) == ("", "")


def test_alternating_nights_without_verdict_keep_one_action() -> None:
    """If nights that need data alternate with undecided nights, the action of most nights is reported."""
    vague = {"cause": "undecided", "valve_fault": "undecided", "kp_new": None, "ti_new": None}
    words = ["needs data", "needs data", "undecided", "needs data", "undecided", "needs data"]
    rows = [row(k, WORN, vague, action=word) for k, word in enumerate(words)]
    assert {b.told.action for b in followed(rows)} == {"needs data"}
