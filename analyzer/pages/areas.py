"""Areas of the plant: their score and their five worst loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.loop.decisions import CAUSES, Cause, Status
from analyzer.pages.headings import heading
from analyzer.pages.words import number
from reports.pages import Cell, Column, Table

Row = Mapping[str, Any]
WORST = 5
COLUMNS = (
    heading("area"),
    Column("score", "Score", True, "Share of the assessed loops, by importance, that need no touch"),
    Column("loops", "Loops", True),
    Column("assessed", "Assessed", True),
    Column("valve", "Valve", True),
    Column("tuning", "Tuning", True),
    Column("load", "Load", True),
    Column("undecided", "Undecided", True),
    Column("significance", "Signif.", True, "Sum of the oscillation significance"),
    Column("worst", "Worst five", wide=True),
)


def score(rows: Sequence[Row]) -> float | None:
    """Share of assessed loops, by importance, with no fault found [%]; None where none is assessed."""
    weights = [
        (1.0 if r["importance"] is None else r["importance"], r["cause"] in (Cause.NONE, None))
        for r in rows
        if r["status"] == Status.OK
    ]
    total = sum(w for w, _ in weights)
    return 100.0 * sum(w for w, good in weights if good) / total if total > 0 else None


def _area(name: str, rows: Sequence[Row]) -> tuple[Cell, ...]:
    assessed = [r for r in rows if r["status"] == Status.OK]
    worst = sorted(
        (r for r in assessed if r["cause"] != Cause.NONE),
        key=lambda r: -(r["oscillation_significance"] or 0.0),
    )
    total = sum(r["oscillation_significance"] or 0.0 for r in assessed)
    points = score(rows)
    counts = [sum(r["cause"] == c for r in assessed) for c in (*CAUSES, Cause.UNDECIDED)]
    listed = ", ".join(f"{r['loop']} ({number(r['oscillation_significance'])})" for r in worst[:WORST])
    return (
        Cell(name or "no area stated"),
        Cell(number(points), points),
        *(Cell(str(n), float(n)) for n in (len(rows), len(assessed), *counts)),
        Cell(number(total), total),
        Cell(listed),
    )


def area_table(rows: Sequence[Row]) -> Table:
    """Areas, the lowest score first."""
    names = sorted({r["area"] or "" for r in rows})
    cells = [_area(name, [r for r in rows if (r["area"] or "") == name]) for name in names]
    cells.sort(key=lambda c: 101.0 if c[1].number is None else c[1].number)
    note = "Score: share of the assessed loops, by importance, in which no fault was found; 100 is best."
    return Table("areas", "", COLUMNS, tuple(cells), note)
