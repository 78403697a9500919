"""The morning list from a store, as table, CSV, JSON or Markdown; reads what it shows and no more."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.columns.ranking import LISTED, RANKING
from analyzer.columns.table import BY_NAME, names
from analyzer.store import Store
from identification.errors import InputError
from reports.tables import harmless

SORTABLE = names(RANKING)
LIST_COLUMNS = names((*RANKING, *LISTED))
"""Columns of CSV and JSON: the contract's, then what says in which units settings stand, and the advice in full."""
MOST_NAMES = 10
"""Areas that are named in an error."""
WIDEST = 240
"""Characters of a wide table."""
Row = Mapping[str, Any]


def ranked(
    store: Store,
    column: str,
    top: int | None = None,
    night: str | None = None,
    ascending: bool = False,
    area: str | None = None,
) -> tuple[list[dict[str, Any]], str]:
    """Rows of a night, or of one of its areas, sorted; loops without a figure come last by name.

    Raises
    ------
    InputError
        Where there is no such store, night, column or area.
    """
    if column not in SORTABLE:
        raise InputError(f"column {column!r}", "one of " + ", ".join(SORTABLE), "correct --by")
    name = night or store.require()
    rows = _within(store.read("nights", name, LIST_COLUMNS).to_pylist(), area)
    known = [r for r in rows if r[column] not in (None, "")]
    others = sorted((r for r in rows if r[column] in (None, "")), key=lambda r: r["loop"])
    if BY_NAME[column].is_number:
        known.sort(key=lambda r: (r[column] if ascending else -r[column], r["loop"]))
    else:
        known.sort(key=lambda r: (r[column], r["loop"]))
    return (known + others)[:top], name


def _within(rows: list[dict[str, Any]], area: str | None) -> list[dict[str, Any]]:
    """The rows of an area, all where none is named; capitals do not matter."""
    if area is None:
        return rows
    found = [r for r in rows if (r["area"] or "").casefold() == area.casefold()]
    if not found:
        known = sorted({r["area"] for r in rows if r["area"]})
        named = ", ".join(known[:MOST_NAMES]) or "none: loops.csv states no areas"
        raise InputError(f"area {area!r}", f"one of {named}", "correct --area")
    return found


def rendered(rows: Sequence[Row], form: str, night: str, wide: bool = False) -> str:
    """Rows as text in one of the formats; a `wide` table keeps all its columns."""
    if form == "table":
        return as_table(rows, night, WIDEST if wide else None)
    return {"csv": as_csv, "json": as_json, "markdown": as_markdown}[form](rows, night)


def as_csv(rows: Sequence[Row], night: str) -> str:
    """All columns as CSV, empty where not assessed, texts of the plant harmless to spreadsheets."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(LIST_COLUMNS)
    writer.writerows([_cell(r[c]) for c in LIST_COLUMNS] for r in rows)
    return out.getvalue().rstrip("\n")


def _cell(value: Any) -> Any:
    """A cell that no spreadsheet takes for a formula; empty where nothing is known."""
    if value is None:
        return ""
    return harmless(value) if isinstance(value, str) else value


def as_json(rows: Sequence[Row], night: str) -> str:
    """All columns as a JSON list of objects, null where not assessed."""
    return json.dumps([{c: r[c] for c in LIST_COLUMNS} for r in rows], indent=1)


def as_markdown(rows: Sequence[Row], night: str) -> str:
    """The columns for people as a Markdown table."""
    from analyzer.present import markdown_table

    return markdown_table(rows)


def as_table(rows: Sequence[Row], night: str, width: int | None = None) -> str:
    """The columns for people as a table; those worth least go where `width` (the terminal's by default) is short."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from analyzer.present import CAUSE_STYLES, WITH_UNITS, brief, fitting

    table = Table(
        box=SIMPLE_HEAD, title=f"Night {night}", title_justify="left", pad_edge=False, padding=(0, 1, 0, 0)
    )
    console = Console(width=width or (None if interactive() else 180))
    shown = [brief(row) for row in rows]
    kept = fitting(shown, console.width)
    for column in (BY_NAME[name] for name in kept):
        right = column.is_number and column.name not in WITH_UNITS
        table.add_column(
            column.heading, justify="right" if right else "left", no_wrap=column.name != "reason"
        )
    for row, cells in zip(rows, shown, strict=True):
        style = CAUSE_STYLES.get(row["cause"], "")
        table.add_row(*(Text(cells[name], style=style if name == "loop" else "") for name in kept))
    with console.capture() as capture:
        console.print(table)
    return "\n".join(line.rstrip() for line in capture.get().rstrip().splitlines())


def interactive() -> bool:
    """Whether the output is read on a terminal."""
    import sys

    return sys.stdout.isatty()
