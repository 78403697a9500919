"""What contradicts itself is not made."""

from __future__ import annotations

from dataclasses import replace

import pytest

from analyzer.loop.decisions import Action, Cause, Due, Fault, Finding, Remedy, Root, Status, Swing

NOW = Finding(
    "L",
    "2026-03-15",
    Status.OK,
    swing=Swing(5.0, 90.0, 2400.0),
    cause=Cause.VALVE,
    fault=Fault.BACKLASH,
    remedy=Remedy(Action.RETUNE, "x", 5.98, 2180.0),
)


def test_what_contradicts_itself_is_not_made() -> None:
    """No settings without a retune, no time for a repair that is none, no follower that is to do something of its
    own."""
    with pytest.raises(ValueError, match="new settings"):
        Remedy(Action.NONE, kp_new=1.0)
    with pytest.raises(ValueError, match="repair"):
        Remedy(Action.RETUNE, due=Due.NOW)
    with pytest.raises(ValueError, match="follows F"):
        replace(NOW, follows=Root("F", 0.9, None, 90.0))
