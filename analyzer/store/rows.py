"""Conversion of findings to rows of tables and back: the only interface between a loop's results and stored columns.

In the pieces that workers write, signs are figures, and the column `reason` contains a loop's missing data; texts are
made last.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, astuple
from typing import TYPE_CHECKING, Any

from analyzer.columns import Row, row_of
from analyzer.loop.decisions import (
    CAUSES,
    Action,
    Cause,
    Cell,
    Due,
    Fault,
    Finding,
    Lane,
    MissingData,
    OscillationFigures,
    Remedy,
    Requirement,
    RequirementKind,
    Sign,
    SignKind,
    Status,
)
from analyzer.words.reason import as_stored, reason

if TYPE_CHECKING:
    from analyzer.loop.assess import Assessment

SWING = {
    "oscillation_significance": "significance",
    "oscillating_pct": "oscillating_pct",
    "period_s": "period_s",
    "pv_amplitude_pct": "amplitude_pct",
}
"""Columns of the oscillation, and their names there."""
TYPED = (
    *("loop", "night", "status", "lack", "cause", "valve_fault", "signs", "source_loop", "lanes", "group"),
    *("action", "advice", "kp_new", "ti_new", "due", "reason", *SWING, *(f"osc_{c}_pct" for c in CAUSES)),
)
"""Columns that are separate attributes of a Finding."""


def night_row(found: Finding) -> dict[str, Any]:
    """The row of one loop and night, with every column."""
    signs = json.dumps([as_stored(s) for s in found.signs]) if found.status is Status.OK else None
    return {**piece_row(found), "signs": signs, "reason": reason(found)}


def piece_row(found: Finding) -> dict[str, Any]:
    """The same as stored by a worker, before the night is combined."""
    swing = found.swing
    ok = found.status is Status.OK
    row = {
        **found.known,
        **({c: getattr(swing, name) for c, name in SWING.items()} if swing is not None else {}),
        **{f"osc_{c}_pct": found.confidence.get(c) for c in CAUSES},
        "loop": found.loop,
        "night": found.night,
        "status": found.status,
        "lack": found.lack,
        "cause": found.cause,
        "valve_fault": found.fault,
        "signs": json.dumps([asdict(s) for s in found.signs]) if ok else None,
        "source_loop": found.follows.loop if found.follows else None,
        "lanes": ", ".join(found.lanes) or None,
        "group": found.group,
        "action": found.remedy.action,
        "advice": found.remedy.text if ok else None,
        "kp_new": found.remedy.kp_new,
        "ti_new": found.remedy.ti_new,
        "due": found.remedy.due,
        "reason": json.dumps(astuple(found.lacking)) if found.lacking is not None else None,
    }
    return row_of({k: finite(v) for k, v in row.items()})


def finding_of(row: Row) -> Finding:
    """The finding of a loop from a worker's piece."""
    swing, action = None, _or_none(Action, row["action"])
    if row["oscillating_pct"] is not None:
        swing = OscillationFigures(**{name: row[c] for c, name in SWING.items()})
    return Finding(
        row["loop"],
        row["night"],
        Status(row["status"]),
        _needs(*json.loads(row["reason"])) if row["reason"] else None,
        _or_none(MissingData, row["lack"]),
        swing,
        _or_none(Cause, row["cause"]),
        _or_none(Fault, row["valve_fault"]),
        {c: row[f"osc_{c}_pct"] for c in CAUSES if row[f"osc_{c}_pct"] is not None},
        tuple(_sign_of(**s) for s in json.loads(row["signs"] or "[]")),
        Remedy(action, row["advice"] or "", row["kp_new"], row["ti_new"], _or_none(Due, row["due"])),
        {k: v for k, v in row.items() if k not in TYPED},
        lanes=tuple(Lane(name) for name in (row["lanes"] or "").split(", ") if name),
        group=row["group"],
    )


def _needs(lack: str | None, need: str, figures: list[Cell]) -> Requirement:
    return Requirement(_or_none(MissingData, lack), RequirementKind(need), tuple(figures))


def _sign_of(points_to: str, strength: float, kind: str, figures: list[Cell]) -> Sign:
    return Sign(Cause(points_to), strength, SignKind(kind), tuple(figures))


def _or_none(kind: Any, text: str | None) -> Any:
    return None if text is None else kind(text)


def finite(value: Any) -> Cell:
    """None for non-finite numbers, so that nothing unknown is stored as a number."""
    if value is None or isinstance(value, str):
        return value
    return float(value) if math.isfinite(value) else None


def hour_rows(a: Assessment, night: str) -> list[dict[str, Any]]:
    """Rows of the hourly table."""
    rows = []
    for h in a.hours:
        figures = {k: finite(v) for k, v in h.figures.as_row().items()}
        figures |= {k: getattr(h, k) for k in ("oscillation_significance", "oscillating_pct")}
        rows.append({"loop": a.loop, "night": night, "hour_s": h.start_s, **figures})
    return rows
