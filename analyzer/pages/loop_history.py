"""A loop's nights: what each one said of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.loop.decisions import Status
from analyzer.pages.headings import heading, headings
from analyzer.pages.words import duration, number
from reports.pages import Block, Cell, Line, Plot, Section, Table

Row = Mapping[str, Any]

HISTORY = (
    *headings("night", "cause", "oscillation_significance", "oscillating_pct", "period_s"),
    *headings("average_absolute_error_pct", "valve_travel_pct_per_h", "variability_pct"),
    heading("action", wide=True),
)


def _night(row: Row) -> tuple[Cell, ...]:
    """One night's cells; the last says why where the loop was not assessed."""
    cells = []
    for column in HISTORY:
        value = row[column.key]
        text = (
            duration(value) if column.key == "period_s" else number(value) if column.numeric else value or ""
        )
        cells.append(Cell(text or "", value if column.numeric else None))
    if row["status"] != Status.OK:
        cells[-1] = Cell(f"{row['status']}: {row['reason']}")
    return tuple(cells)


def history(rows: Sequence[Row]) -> Section:
    """A table of a loop's nights, the last first, and a picture of how its oscillation grew or fell."""
    table = Table("history", "", HISTORY, tuple(_night(r) for r in reversed(rows)))
    known = [(i - len(rows) + 1.0, r["oscillation_significance"]) for i, r in enumerate(rows)]
    points = np.array([(x, y) for x, y in known if y is not None], float)
    blocks: list[Block] = [table]
    if len(points) > 2:
        line = Line("significance", points[:, 0], points[:, 1])
        shown = BY_NAME["oscillation_significance"]
        title = f"{shown.title} over the nights"
        blocks.insert(
            0, Plot("nights", title, "nights before this one", shown.unit, (line,), reach=(0.0, 1.0))
        )
    return Section("Over the nights", tuple(blocks))
