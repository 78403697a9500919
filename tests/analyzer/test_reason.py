"""The sentence that says what a loop does."""

from __future__ import annotations

import pytest

from analyzer.loop.decisions import Cause, Status
from analyzer.loop.finding import Finding, Sign, Swing
from analyzer.words.reason import reason


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.0, "does not oscillate"),
        (26.3, "cycles every 18.1 min, for 26 % of the time"),
        (49.9, "cycles every 18.1 min, for 50 % of the time"),
        (80.0, "cycles every 18.1 min: driven from outside; the cycle keeps its size"),
    ],
)
def test_a_loop_that_cycles_for_a_part_of_the_night_is_not_said_to_be_calm(share: float, said: str) -> None:
    """A cycle of too little time to count is told with its share; only a loop without one does not oscillate."""
    signs = (Sign("load", 1.0, "the cycle keeps its size"),)
    swing = Swing(1.0, share, 1086.0 if share else None, 1.0)
    cause = Cause.LOAD if share >= 50 else Cause.NONE
    assert reason(Finding("L", "2026-03-02", Status.OK, swing=swing, cause=cause, signs=signs)) == said
