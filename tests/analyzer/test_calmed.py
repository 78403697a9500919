"""A loop that a change of settings has calmed is told so, though its valve is as worn as it was."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from analyzer.loop.decisions import Action, Cause, Due, Fault, Status
from analyzer.loop.finding import Finding, Remedy, Root, Swing
from analyzer.night.finish import told_calmed
from analyzer.words.reason import reason

NOW = Finding(
    "L",
    "2026-03-15",
    Status.OK,
    swing=Swing(5.0, 90.0, 2400.0),
    cause=Cause.VALVE,
    fault=Fault.BACKLASH,
    remedy=Remedy(Action.RETUNE, "x", 5.98, 2180.0),
    known={"kp": 6.0, "ti": 1100.0, "backlash_pct": 2.7, "valve_size": 0.8},
)
SINCE: dict[str, Any] = {
    **{"loop": "L", "night": "2026-03-14", "status": "ok", "kp": 6.0, "ti": 1100.0},
    **{"oscillating_pct": 90.0, "oscillation_significance": 5.0, "period_s": 2400.0},
}
BEFORE = {**SINCE, "night": "2026-03-08", "ti": 40.0, "oscillation_significance": 58.0, "period_s": 250.0}


@pytest.mark.parametrize("remedy", [NOW.remedy, Remedy(Action.REPAIR_VALVE, due=Due.NOW)])
def test_a_loop_just_retuned_is_not_retuned_again(remedy: Remedy) -> None:
    """After a retune that left a twelfth of the cycle neither settings nor a repair at once are asked for; the reason
    says what it was, and the valve is for the next shutdown."""
    told = told_calmed(replace(NOW, remedy=remedy), [BEFORE, SINCE])
    assert (told.action, told.remedy.due, told.remedy.kp_new, told.remedy.ti_new) == (
        "repair valve",
        "next shutdown",
        None,
        None,
    )
    text = reason(told)
    assert (
        "slower and 9 % as much as before its settings were changed (every 4.17 min until 2026-03-08)" in text
    )
    assert text.endswith("at the next shutdown stroke it in steps of 0.68 %")


@pytest.mark.parametrize(
    ("now", "earlier"),
    [
        ({}, []),
        ({}, [SINCE]),
        ({}, [BEFORE | {"oscillation_significance": 7.0}]),
        ({}, [BEFORE | {"oscillating_pct": 20.0}]),
        ({}, [BEFORE, SINCE | {"ti": 900.0}]),
        ({"cause": Cause.TUNING}, [BEFORE]),
        ({"remedy": Remedy(Action.SEE_SOURCE_LOOP)}, [BEFORE]),
    ],
)
def test_what_no_change_calmed_stays_as_it_was(now: dict[str, Any], earlier: list[dict[str, Any]]) -> None:
    """Without a change, or where it left two thirds of the cycle, or of another cause, the night's own advice stands;
    the settings that count are those of the last change."""
    found = replace(NOW, **now)
    assert told_calmed(found, earlier) == found


def test_a_calmed_loop_that_moves_others_says_so() -> None:
    """Whom a loop moves is told beside what is left of its cycle."""
    told = told_calmed(replace(NOW, moves=("A", "B")), [BEFORE])
    assert reason(told).endswith("it also moves A, B: fix this one first")


def test_what_contradicts_itself_is_not_made() -> None:
    """No settings without a retune, no time for a repair that is none, no follower that is to do something of its
    own."""
    with pytest.raises(ValueError, match="new settings"):
        Remedy(Action.NONE, kp_new=1.0)
    with pytest.raises(ValueError, match="repair"):
        Remedy(Action.RETUNE, due=Due.NOW)
    with pytest.raises(ValueError, match="follows F"):
        replace(NOW, follows=Root("F", 0.9, None, 90.0))
