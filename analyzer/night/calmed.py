"""Which loops a change of settings has calmed, though their valves are as worn as they were, by the nights before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.loop.decisions import Action, Cause, Due, Status, counts
from analyzer.words.present import calmed_row

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


def before_change(row: Row, earlier: Sequence[Row]) -> Row | None:
    """The last of the nights before, oldest first, under other settings than a night's; None where there is none."""
    other = (r for r in reversed(earlier) if r["status"] == Status.OK and r["kp"] is not None)
    return next((r for r in other if (r["kp"], r["ti"]) != (row["kp"], row["ti"])), None)


def calmed(row: Row, earlier: Sequence[Row]) -> Row:
    """The row of a night, that of a worn valve whose loop a change of settings has calmed with its repair at the next
    shutdown and no further settings.

    Parameters
    ----------
    row : mapping
        Of a loop in a night.
    earlier : sequence of mapping
        Its rows of the nights before, oldest first.
    """
    urgent = row["action"] == Action.RETUNE or (
        row["action"] == Action.REPAIR_VALVE and row["due"] == Due.NOW
    )
    if not urgent or row["cause"] != Cause.VALVE or not counts(row["oscillating_pct"]):
        return row
    before = before_change(row, earlier)
    if before is None or not counts(before["oscillating_pct"]):
        return row
    most = CALMED * before["oscillation_significance"]
    return calmed_row(row, before) if row["oscillation_significance"] <= most else row
