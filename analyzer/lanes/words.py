"""What the lanes of a loop say, and what they ask for, as part of its row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from analyzer.config import LaneLimits
from analyzer.lanes.figures import lanes_in
from analyzer.lanes.rules import lanes_of
from analyzer.loop.decisions import Action, Cause, Lack, Lane, Status
from analyzer.words.clauses import joined

Row = Mapping[str, Any]


def _lasting(row: Row) -> str:
    sp, pv = row["sp_mean_pct"], row["pv_mean_pct"]
    side = "off" if sp is None or pv is None else "below" if pv < sp else "above"
    text = f"PV stays {row['lasting_error_pct']:.3g} % of span {side} SP"
    if Lane.AT_LIMIT in lanes_in(row):
        return text
    return (
        f"{text} though the loop is in automatic and OP off its limits: do tags and ranges belong together?"
    )


def _at_limit(row: Row) -> str:
    side = "" if row["op_mean_pct"] is None else " lower" if row["op_mean_pct"] < 50 else " upper"
    share = row["at_limits_pct"]
    text = f"OP rests at its{side} limit for {share:.0f} % of the time"
    from_end_to_end = row["cause"] == Cause.TUNING  # then nothing is wrong with the valve's size
    return text if from_end_to_end else f"{text}: look at the valve's size and at what feeds it"


def _sluggish(row: Row) -> str:
    text = f"sluggish: errors last {row['error_memory_ti']:.2g} integral times, the gain is small"
    room = row["gain_room"]
    return (
        text if room is None or room < 2.0 else f"{text} (the process bears about {room:.1g} times as much)"
    )


SAID: Mapping[Lane, Callable[[Row], str]] = {
    Lane.MANUAL: lambda r: f"in manual for {r['manual_pct']:.0f} % of the time",
    Lane.AT_LIMIT: _at_limit,
    Lane.LASTING_ERROR: _lasting,
    Lane.FROZEN: lambda r: f"PV stands still for {r['frozen_pct']:.0f} % of the time while OP moves: frozen",
    Lane.SLUGGISH: _sluggish,
    Lane.TRAVEL: lambda r: f"OP travels {r['valve_travel_pct_per_h']:.0f} %/h",
}
"""One clause a lane; oscillation has the reason itself."""
OF_MEASUREMENT = (Lane.FROZEN, Lane.LASTING_ERROR)
"""Lanes that ask for a look at the measurement."""
NOTHING_SURER = (None, Action.NONE, Action.NEEDS_DATA, Action.CHECK_SETTINGS)
"""Actions in whose place a doubtful measurement is looked at first: what rests on it is doubtful too."""


def action_of(row: Row, lanes: tuple[Lane, ...]) -> Action | None:
    """The row's action, or the one that a lane asks for where nothing else is to be done; what holds OP at its limit
    has to be found out first."""
    action = None if row["action"] is None else Action(row["action"])
    if row["status"] == Status.NOT_ASSESSED and action is None:
        action = Action.NEEDS_DATA
    if action in NOTHING_SURER and row["status"] != Status.FAILED:
        asks = [lane for lane in lanes if lane in OF_MEASUREMENT]
        if asks and not (asks == [Lane.LASTING_ERROR] and Lane.AT_LIMIT in lanes):
            return Action.CHECK_MEASUREMENT
    return Action.UNDECIDED if action is Action.NONE and Lane.AT_LIMIT in lanes else action


def since(row: Row) -> str:
    """What was typed in within the night, and whether what is said is told of it; '' where nothing was."""
    if not row["settings_changed"]:
        return ""
    if row["judged_since_s"] is None:
        return f"before {row['settings_changed']}, too late in the night to judge"
    return f"since {row['settings_changed']}"


def in_lanes(row: Row, limits: LaneLimits) -> dict[str, Any]:
    """The row with its lanes, the clauses they add to the reason, and the action they ask for."""
    lanes = lanes_of(row, limits)
    named = {**row, "lanes": ", ".join(lanes) or None}
    known = {Lane.MANUAL} if row["lack"] == Lack.AUTOMATIC else set()  # the reason has said so already
    said = [SAID[lane](named) for lane in lanes if lane in SAID and lane not in known]
    reason = joined(row["reason"], *said)
    reason = f"{since(row)}: {reason}" if row["settings_changed"] else reason
    return {**named, "reason": reason, "action": action_of(row, lanes)}
