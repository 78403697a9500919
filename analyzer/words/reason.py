"""The reason of a loop's row: what was found and why, in one plain sentence; most figures stay in their columns."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from analyzer.loop.decisions import AMPLIFICATION, OF_LOAD, Action, Cause, Due, Fault, Needs, counts
from analyzer.words.units import duration

Row = Mapping[str, Any]
PLAIN = {
    Fault.BACKLASH: "the valve has {width:.2g} % play ({share:.0f} % of OP's range)",
    Fault.STICTION: "the valve sticks by {width:.2g} % ({share:.0f} % of OP's range)",
}
WITHOUT_WIDTH = {
    Fault.BACKLASH: "the valve has play over {share:.0f} % of OP's range",
    Fault.STICTION: "the valve sticks over {share:.0f} % of OP's range",
}
"""The same where OP is not in percent."""
BY_HAND = {
    Due.NOW: "; stroke it in steps of {step:.2g} %",
    Due.SHUTDOWN: "; at the next shutdown stroke it in steps of {step:.2g} %",
}
"""How a valve's fault is confirmed, and when."""
STEPS = 4.0
"""Steps of a stroke test to the width of what is looked for; ours: the first three must then move nothing."""


def reason_of(row: Row, needs: Needs | None = None) -> str:
    """One sentence on what was found and why."""
    cycle = _cycle(row)
    cause = Cause(row["cause"])
    if cause is Cause.VALVE:
        return f"{cycle}: {valve_text(row)}"
    if cause is Cause.TUNING:
        return f"{cycle}: too tight for its process; {_strongest(row, cause, 1, AMPLIFICATION)}"
    if cause is Cause.LOAD:
        return f"{cycle}: driven from outside; {_strongest(row, cause, 1, *OF_LOAD)}"
    if cause is Cause.UNDECIDED:
        return f"{cycle}; cause undecided: {needs or 'the signs do not agree'}"
    return cycle


def _cycle(row: Row) -> str:
    """Whether the loop cycles, and for how much of the time where it is too little to count."""
    share = row["oscillating_pct"]
    if not share or not row["period_s"]:
        return "does not oscillate"
    cycle = f"cycles every {duration(row['period_s'])}"
    return cycle if counts(share) else f"{cycle}, for {share:.0f} % of the time"


def to_stroke(row: Row) -> str:
    """The test that a valve's fault asks for; '' where its width is not known or the action is another."""
    width = row["stickband_pct"] or row["backlash_pct"]
    if row["action"] != Action.REPAIR_VALVE or not width:
        return ""
    return BY_HAND[Due(row["due"] or Due.NOW)].format(step=width / STEPS)


def valve_text(row: Row) -> str:
    """What is wrong with the valve, in figures where there are any."""
    plain, width = PLAIN.get(row["valve_fault"]), row["stickband_pct"] or row["backlash_pct"]
    if plain is not None and not width and row["valve_size"] is not None:
        return WITHOUT_WIDTH[row["valve_fault"]].format(share=100 * row["valve_size"])
    if plain is None or not width or row["valve_size"] is None:
        return f"the valve is at fault; {_strongest(row, Cause.VALVE, 2)}"
    return plain.format(width=width, share=100 * row["valve_size"])


def _strongest(row: Row, cause: Cause, most: int, *first: str) -> str:
    """The strongest signs of a cause, those of some names before all others."""
    signs = [s for s in json.loads(row.get("signs") or "[]") if s["points_to"] == cause]
    order = sorted(signs, key=lambda s: (s.get("name", "") not in first, -s["strength"]))
    return "; ".join(s["text"] for s in order[:most])
