"""The hand-over sheet for maintenance: valves by fault and travel, the test to do, and room for what was found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analyzer.loop.decisions import Action, Cause, Fault, Status
from analyzer.pages.headings import heading, headings
from analyzer.pages.view import Night, linked
from analyzer.pages.words import counted, number
from analyzer.pages.work_order import valve_test
from reports.pages import Cell, Column, Page, Section, Table

Row = Mapping[str, Any]
NAME = "maintenance"
TRAVELLED = 20
"""Valves that are listed for their travel alone."""
FAULTY = (
    *headings("loop", "description", "area", "valve_fault"),
    Column("width", "Width %", True, "Play or stickband, % of OP"),
    heading("valve_travel_pct_per_h"),
    Column("test", "Test", wide=True),
    Column("found", "Found, by whom", wide=True),
)
WORN = (*headings("loop", "description", "area", "valve_travel_pct_per_h", "cause", "action"),)


def _cells(night: Night, row: Row) -> tuple[Cell, ...]:
    width = row["stickband_pct"] or row["backlash_pct"]
    return (
        linked(night, row["loop"]),
        Cell(row["description"] or ""),
        Cell(row["area"] or ""),
        Cell("" if row["valve_fault"] in (None, Fault.NONE) else row["valve_fault"], kind="valve"),
        Cell(number(width), width),
        Cell(number(row["valve_travel_pct_per_h"]), row["valve_travel_pct_per_h"]),
        Cell(valve_test(row)),
        Cell(""),
    )


def faulty(night: Night) -> Table:
    """Valves at fault, those to be repaired first, then by width."""
    rows = [r for r in night.rows if r["status"] == Status.OK and r["cause"] == Cause.VALVE]
    rows.sort(
        key=lambda r: (r["action"] != Action.REPAIR_VALVE, -(r["stickband_pct"] or r["backlash_pct"] or 0.0))
    )
    note = (
        "Test: in manual, with the process calm, move OP in steps, four up and four down, and wait each time; "
        "then look at positioner feedback, linkage, packing and actuator. "
        "With new settings a loop can wait for the shutdown."
    )
    return Table("valves", "", FAULTY, tuple(_cells(night, r) for r in rows), note, cards=True)


def worn(night: Night) -> Table:
    """The valves that travel most."""
    rows = [r for r in night.rows if r["valve_travel_pct_per_h"] is not None]
    rows.sort(key=lambda r: -r["valve_travel_pct_per_h"])
    cells = tuple(
        (
            linked(night, r["loop"]),
            Cell(r["description"] or ""),
            Cell(r["area"] or ""),
            Cell(number(r["valve_travel_pct_per_h"]), r["valve_travel_pct_per_h"]),
            Cell(r["cause"] or ""),
            Cell(r["action"] or ""),
        )
        for r in rows[:TRAVELLED]
    )
    note = "Travel of OP, or of the stem where it is recorded; where the loop is tight, its settings wear the valve."
    return Table("travel", "", WORN, cells, note, cards=True)


def page(night: Night) -> Page:
    """The sheet of a night."""
    first, second = faulty(night), worn(night)
    sections = (
        Section(f"Valves at fault ({len(first.rows)})", (first,)),
        Section("Valves that travel most", (second,)),
    )
    subtitle = (
        f"{counted(len(first.rows), 'valve')} at fault in the night of {night.name}, for the valve shop."
    )
    return Page(NAME, "Hand-over to maintenance", subtitle, sections, (("All loops", "index.html"),))
