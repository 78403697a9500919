"""The morning on one screen: what to do first, what changed, the worst loops with what to type in."""

from __future__ import annotations

from analyzer.loop.decisions import CAUSES, Action, Status
from analyzer.pages.lead import first_things
from analyzer.pages.news import news_lines
from analyzer.pages.view import Night, Row, needs_a_look, oscillates, read_night
from analyzer.pages.words import counted
from analyzer.pages.work_order import work_order
from analyzer.plantwide.view import read_groups
from analyzer.store.store import Store
from analyzer.words.units import changed_settings
from reports.pages import Cell, Column, Listing, Page, Section, Table, Text

WORST = 10
"""Loops that are listed."""
NEWS = 8
"""Changes that are listed."""
COLUMNS = (
    Column("loop", "Loop"),
    Column("reason", "What", wide=True),
    Column("do", "Do", wide=True),
    Column("note", "Note", wide=True),
)


def _do(row: Row) -> str:
    if row["kp_new"] is not None or row["ti_new"] is not None:
        return f"{row['action']}: {changed_settings(row)}"
    if row["action"] == Action.UNDECIDED:
        return dict(work_order(row))["Do"]
    return "" if row["action"] in (None, Action.NONE) else row["action"]


def _counts(night: Night) -> str:
    assessed = [r for r in night.rows if r["status"] == Status.OK]
    swinging = [r for r in assessed if oscillates(r)]
    of = ", ".join(f"{sum(r['cause'] == c for r in swinging)} by {c}" for c in CAUSES)
    return f"{len(assessed)} of {counted(len(night.rows), 'loop')} assessed, {len(swinging)} oscillate: {of}."


def page(store: Store, name: str | None = None) -> Page:
    """The summary of a night, the latest by default.

    Raises
    ------
    InputError
        Where the store holds no such night.
    """
    night = read_night(store, name, WORST, drawn=False)
    first = first_things(
        [r for r in night.rows if r["loop"] not in night.hidden], read_groups(store, night.name)
    )
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (Cell(r["loop"], kind="strong"), Cell(r["reason"] or ""), Cell(_do(r)), Cell(night.note(r["loop"])))
        for r in night.worst
    )
    shown = COLUMNS if any(row[3].text for row in rows) else COLUMNS[:3]
    rows = tuple(row[: len(shown)] for row in rows)
    left = sum(needs_a_look(r) and r["loop"] not in night.hidden for r in night.rows) - len(rows)
    note = f"{left} more in the list." if left > 0 else ""
    lines = news_lines(night)
    more = [("", f"{len(lines) - NEWS} more")] if len(lines) > NEWS else []
    news = (
        (Listing((*(("", text) for text in lines[:NEWS]), *more)),) if lines else (Text(("Nothing new.",)),)
    )
    sections = (
        Section("First", (Listing(tuple(("", text) for text in first)), Text((_counts(night),)))),
        *((Section(f"Since {night.before_name}", news),) if night.before_name else ()),
        Section(
            "Loops worth a look", (Table("worst", "", shown, rows, note),) if rows else (Text(("None.",)),)
        ),
    )
    return Page("summary", f"Loops in the morning of {night.name}", "", sections)
