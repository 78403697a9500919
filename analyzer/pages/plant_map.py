"""The plant as a map: areas and loops as large as their loss, coloured by why they are worth a look."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.loop.decisions import CAUSES, Status
from analyzer.pages.cost import LOSS, cost, cost_column
from analyzer.pages.view import Night, linked, needs_a_look
from analyzer.pages.words import number
from reports.pages import Tile, TileGroup, TreeMap

Row = Mapping[str, Any]
MOST = 15
"""Loops of an area that are drawn by themselves; the rest is one rectangle."""
KEYS = (
    ("valve", "valve"),
    ("tuning", "tuning"),
    ("load", "load"),
    ("unclear", "another reason to look"),
    ("calm", "nothing to do"),
)


def _kind(row: Row) -> str:
    if not needs_a_look(row):
        return "calm"
    return row["cause"] if row["cause"] in CAUSES else "unclear"


def _tile(night: Night, row: Row, by: str) -> Tile:
    text = f"{row['loop']}: {number(cost(row, by))}. {row['reason'] or ''}"
    return Tile(row["loop"], cost(row, by), _kind(row), text, linked(night, row["loop"]).href)


def _area(night: Night, name: str, rows: Sequence[Row], by: str) -> TileGroup:
    ordered = sorted(rows, key=lambda r: (-cost(r, by), r["loop"]))
    tiles = [_tile(night, r, by) for r in ordered[:MOST]]
    rest = ordered[MOST:]
    if rest:
        total = sum(cost(r, by) for r in rest)
        tiles.append(Tile(f"{len(rest)} more", total, "calm", f"{len(rest)} more loops: {number(total)}"))
    return TileGroup(name or "no area stated", tuple(tiles))


def plant_map(night: Night) -> TreeMap | None:
    """The map of the assessed loops; None where nothing is lost anywhere."""
    rows = [r for r in night.rows if r["status"] == Status.OK]
    by = cost_column(rows)
    if not any(cost(r, by) > 0 for r in rows):
        return None
    what = "average absolute error times importance" if by == LOSS else "oscillation significance"
    areas = sorted({r["area"] or "" for r in rows})
    groups = tuple(_area(night, a, [r for r in rows if (r["area"] or "") == a], by) for a in areas)
    return TreeMap("plant", f"The plant by area: size is {what}", groups, KEYS)
