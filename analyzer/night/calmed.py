"""Which loops a change of settings has calmed, though their valves are as worn as they were, by the nights before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.loop.decisions import Action, Cause, Due, Status, counts
from analyzer.loop.finding import Before, Finding, Swing, calmed
from analyzer.words.reason import CALMED as WORDS

Row = Mapping[str, Any]
REMEMBERED = (
    "loop",
    "night",
    "status",
    "kp",
    "ti",
    "oscillation_significance",
    "oscillating_pct",
    "period_s",
)
"""What is read of the nights before."""
CALMED = 0.25
"""Significance over that under the settings before up to which a change has calmed a loop [-]; ours: on the sample
mill five of six retunes leave none to a sixth, which differs from night to night by all of it, one two thirds."""


def before_change(found: Finding, earlier: Sequence[Row]) -> Row | None:
    """The last of the nights before, oldest first, under other settings than a night's; None where there is none."""
    now = found.known.get("kp"), found.known.get("ti")
    other = (r for r in reversed(earlier) if r["status"] == Status.OK and r["kp"] is not None)
    return next((r for r in other if (r["kp"], r["ti"]) != now), None)


def told_calmed(found: Finding, earlier: Sequence[Row]) -> Finding:
    """A loop in a night, one with a worn valve that a change of settings has calmed with its repair at the next
    shutdown and no further settings.

    Parameters
    ----------
    found : Finding
    earlier : sequence of mapping
        Its rows of the nights before, oldest first.
    """
    action, due, swing = found.remedy.action, found.remedy.due, found.swing
    urgent = action is Action.RETUNE or (action is Action.REPAIR_VALVE and due is Due.NOW)
    if not urgent or found.cause is not Cause.VALVE or swing is None or not found.oscillates:
        return found
    row = before_change(found, earlier)
    if row is None or not counts(row["oscillating_pct"]):
        return found
    if swing.significance > CALMED * row["oscillation_significance"]:
        return found
    then = Swing(row["oscillation_significance"], row["oscillating_pct"], row["period_s"])
    return calmed(found, Before(row["night"], then), WORDS)
