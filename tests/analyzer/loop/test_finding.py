"""A contradictory finding raises an error."""

from __future__ import annotations

from dataclasses import replace

import pytest

from analyzer.loop.decisions import (
    Action,
    Cause,
    Due,
    Fault,
    Finding,
    OscillationFigures,
    Remedy,
    SourceLoop,
    Status,
)

NOW = Finding(
    "L",
    "2026-03-15",
    Status.OK,
    swing=OscillationFigures(5.0, 90.0, 2400.0),
    cause=Cause.VALVE,
    fault=Fault.BACKLASH,
    remedy=Remedy(Action.RETUNE, "x", 5.98, 2180.0),
)


def test_a_contradictory_finding_is_refused() -> None:
    """Settings without a retune, a time for an action other than a repair, and a follower with an own action are
    refused.
    """
    with pytest.raises(ValueError, match="new settings"):
        Remedy(Action.NONE, kp_new=1.0)
    with pytest.raises(ValueError, match="repair"):
        Remedy(Action.RETUNE, due=Due.NOW)
    with pytest.raises(ValueError, match="follows F"):
        replace(NOW, follows=SourceLoop("F", 0.9, None, 90.0))
