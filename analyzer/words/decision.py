"""The decision of a night on a loop as lines, with the same words in every command."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from analyzer.columns import Row
from analyzer.loop.decisions import Action, Cause, Due, Fault
from analyzer.words.orders import order
from analyzer.words.units import number
from identification.signals.field_indices import PUBLISHED, concluded

SHOWN_COLUMNS = (
    *(
        "night",
        "status",
        "oscillating_pct",
        "period_s",
        "cause",
        "valve_fault",
        "backlash_pct",
        "stickband_pct",
    ),
    *("lanes", "source_loop", "action", "due", "kp", "ti", "kp_new", "ti_new", "reason", "advice"),
)
"""Columns of a decision shown by commands, named as in the contract of the ranking."""
INDICES = ("harris", "hagglund", "horch", "idle", "kano", "choudhury", "yamashita", "ellipse", "he")
"""The published indices in the order of publication."""
ABOVE_ACTION = (Cause.VALVE, Cause.TUNING, Cause.LOAD)


def as_data(row: Row) -> Row:
    """A decision as plain data, with the action in words and the published indices."""
    return {name: row[name] for name in SHOWN_COLUMNS} | {"do": _do(row), "field_indices": indices(row)}


def indices(row: Row) -> list[dict[str, Any]]:
    """The published indices of a row, in the order of publication: name, values, and the index's conclusion, None if
    it is undecided or its publication gives no limit."""
    found = json.loads(row["field_indices"] or "{}")
    if row["harris_index"] is not None:
        found["harris"] = [row["harris_index"]]
    known = ((name, found[name]) for name in INDICES if name in found)
    return [
        {"index": name, "values": x, "finds": concluded(name, x) if name in PUBLISHED else None}
        for name, x in known
    ]


def decided(data: Mapping[str, Any]) -> str:
    """The night's decision on an explained loop, in sentences; '' if unknown."""
    row = data.get("night")
    if row is None:
        return ""
    cause = row["cause"] or "not reported"
    text = f"The night of {row['night']} found: cause {cause}{_fault(row)}; {row['reason'] or 'no reason'}."
    return f"{text} Action: {row['action'] or 'none'}{_due(row)}. {_sentence(row['do'])}".strip()


def decision_lines(row: Row) -> list[str]:
    """Cause, fault and action with their evidence, one line each."""
    at = f"{row['loop']}, night {row['night']}: cause {row['cause'] or 'not reported'}{_surely(row)}"
    lines = [at + _fault(row), f"action: {row['action'] or 'none'}{_due(row)}"]
    if _do(row):
        lines.append(f"do: {_do(row)}")
    if row["action"] == Action.RETUNE:
        ti = f"{number(row['ti_new'])} {row['ti_unit'] or 's'}" if row["ti_new"] else "off"
        form = f"{row['gain_unit'] or 'percent'}, {row['form'] or 'ideal'}"
        lines.append(f"new settings: kp {number(row['kp_new'])}, ti {ti} ({form})")
    if row["reason"]:
        lines.append(f"reason: {row['reason']}")
    return lines


def _do(row: Row) -> str:
    """The action, '' for a loop without one."""
    return dict(order(row))["Do"] if row["action"] not in (None, Action.NONE) else ""


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _surely(row: Row) -> str:
    """Confidence in a cause."""
    cause = row["cause"]
    share = row[f"osc_{cause}_pct"] if cause in ABOVE_ACTION else None
    return f" ({share:.0f} %)" if share else ""


def _fault(row: Row) -> str:
    """The fault of the valve, with its width."""
    fault, width = row["valve_fault"], row["stickband_pct"] or row["backlash_pct"]
    if fault in (None, Fault.NONE):
        return ""
    return f"; valve {fault}" + (f" {number(width)} % of OP" if width else "")


def _due(row: Row) -> str:
    return f" at the {Due.SHUTDOWN}" if row["due"] == Due.SHUTDOWN else ""
