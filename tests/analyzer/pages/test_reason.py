"""The sentence that describes the oscillation of a loop."""

from __future__ import annotations

import pytest

from analyzer.loop.decisions import Cause, Finding, OscillationFigures, Sign, SignKind, Status
from analyzer.words.reason import in_short, reason


@pytest.mark.parametrize(
    ("share", "expected"),
    [
        (0.0, "does not oscillate"),
        (6.3, "cycles every 18.1 min, for 6 % of the time"),
        (19.9, "cycles every 18.1 min, for 20 % of the time"),
        (
            80.0,
            "cycles every 18.1 min: external disturbance; the cycle keeps its size and changes its rhythm",
        ),
    ],
)
def test_a_loop_that_oscillates_for_a_part_of_the_night_is_reported(share: float, expected: str) -> None:
    """A cycle of a small share of the time is reported with its share; only a loop without a cycle does not
    oscillate.
    """
    signs = (Sign(Cause.LOAD, 1.0, SignKind.REGULARITY, (1.5, 0.2, 1.0)),)
    swing = OscillationFigures(1.0, share, 1086.0 if share else None, 1.0)
    cause = Cause.LOAD if share >= 20 else Cause.NONE
    assert reason(Finding("L", "2026-03-02", Status.OK, swing=swing, cause=cause, signs=signs)) == expected


@pytest.mark.parametrize(
    ("text", "head"),
    [
        ("does not oscillate", "does not oscillate"),
        ("one two; three", "one two; three"),
        (f"{'a ' * 18}b; c; d", f"{'a ' * 18}b; c"),
        (f"{'a ' * 24}b; c", f"{'a ' * 24}b"),
        ("", ""),
    ],
)
def test_a_reason_in_short_is_its_first_clauses(text: str, head: str) -> None:
    """The short form has complete clauses of up to twenty words, at least one; the others follow, and none is
    lost.
    """
    first, rest = in_short(text)
    assert first == head
    assert "; ".join(filter(None, (first, rest))) == text
