"""A loop that a change of settings has calmed is told so, though its valve is as worn as it was."""

from __future__ import annotations

from typing import Any

import pytest

from analyzer.night.calmed import calmed

NOW: dict[str, Any] = {
    **{"loop": "L", "night": "2026-03-15", "status": "ok", "kp": 6.0, "ti": 1100.0, "cause": "valve"},
    **{"oscillating_pct": 90.0, "oscillation_significance": 5.0, "period_s": 2400.0, "lack": None},
    **{"valve_fault": "backlash", "backlash_pct": 2.7, "stickband_pct": None, "valve_size": 0.8},
    **{"action": "retune", "due": None, "kp_new": 5.98, "ti_new": 2180.0, "advice": "x", "reason": "y"},
}
BEFORE = {**NOW, "night": "2026-03-08", "ti": 40.0, "oscillation_significance": 58.0, "period_s": 250.0}
SINCE = {**NOW, "night": "2026-03-14"}


@pytest.mark.parametrize("action", [{}, {"action": "repair valve", "due": "now", "kp_new": None}])
def test_a_loop_just_retuned_is_not_retuned_again(action):
    """After a retune that left a twelfth of the cycle neither settings nor a repair at once are asked for; the reason
    says what it was, and the valve is for the next shutdown."""
    told = calmed(NOW | action, [BEFORE, SINCE])
    assert (told["action"], told["due"], told["kp_new"], told["ti_new"]) == (
        "repair valve",
        "next shutdown",
        None,
        None,
    )
    assert (
        "slower and 9 % as much as before its settings were changed (every 4.17 min until 2026-03-08)"
        in told["reason"]
    )
    assert told["reason"].endswith("at the next shutdown stroke it in steps of 0.68 %")


@pytest.mark.parametrize(
    ("now", "earlier"),
    [
        ({}, []),
        ({}, [SINCE]),
        ({}, [BEFORE | {"oscillation_significance": 7.0}]),
        ({}, [BEFORE | {"oscillating_pct": 20.0}]),
        ({}, [BEFORE, SINCE | {"ti": 900.0}]),
        ({"cause": "tuning"}, [BEFORE]),
        ({"action": "see source loop"}, [BEFORE]),
    ],
)
def test_what_no_change_calmed_stays_as_it_was(now, earlier):
    """Without a change, or where it left two thirds of the cycle, or of another cause, the night's own advice stands;
    the settings that count are those of the last change."""
    assert calmed(NOW | now, earlier) == NOW | now
