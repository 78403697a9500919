"""`triage rank` as text: the loops or the groups of a night as table, CSV, JSON or Markdown."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from shutil import get_terminal_size
from typing import Any

from analyzer.columns import BY_NAME, GROUP_LIST, names
from analyzer.lanes.lanes import FIGURE
from analyzer.loop.cost import MARK, OF_RECORDED, mark
from analyzer.loop.decisions import Lane
from analyzer.pages.rank import LIST_COLUMNS
from analyzer.words.present import (
    CAUSE_STYLES,
    SHOWN,
    WITH_UNITS,
    brief,
    figure,
    fitting,
    markdown_table,
    shown_of,
)
from analyzer.words.units import duration
from reports.markdown import escaped
from reports.plain import Heading, csv_text, table
from reports.texts import visible

Row = Mapping[str, Any]
WIDEST, PIPED = 240, 180
"""Characters of a line of a wide table, and of one that no terminal shows."""
OF_GROUPS = ("group", "loops", "period", "starts at", "action there", "others gain %", "members")


def rendered(rows: Sequence[Row], form: str, night: str, wide: bool = False, lane: Lane | None = None) -> str:
    """Loops as text in one of the formats; a `wide` table keeps all its columns, one of a lane shows its figure."""
    if form == "csv":
        return _csv(rows, LIST_COLUMNS)
    if form == "json":
        return json.dumps([{c: r[c] for c in LIST_COLUMNS} for r in rows], indent=1)
    if not rows:
        return f"Night {night}: no loop is in the lane {lane}" if lane else f"Night {night}: no loops"
    shown = shown_of(rows, None if lane is None else FIGURE[lane])
    if form == "table":
        text, sign = as_table(rows, night, WIDEST if wide else None, shown), MARK
    else:
        text, sign = markdown_table(rows, shown), escaped(MARK)
    marked = any(mark(row, column) for row in rows for column in shown)
    return f"{text}\n\n{sign} {OF_RECORDED}" if marked else text


def _csv(rows: Sequence[Row], columns: Sequence[str]) -> str:
    return csv_text(columns, ([row[c] for c in columns] for row in rows)).rstrip("\n")


def as_table(
    rows: Sequence[Row], night: str, width: int | None = None, columns: Sequence[str] | None = None
) -> str:
    """The columns for people as a table; those worth least go where `width` (the terminal's by default) is short."""
    width = width or (get_terminal_size().columns if interactive() else PIPED)
    shown = [brief(row, columns or SHOWN) for row in rows]
    kept = fitting(shown, width)
    headings = [
        Heading(c.heading, c.is_number and c.name not in WITH_UNITS, c.name == "reason")
        for c in map(BY_NAME.__getitem__, kept)
    ]
    head, body = table(headings, [[cells[name] for name in kept] for cells in shown], width)
    rule = " " + "\u2500" * (max(map(len, (head, *(line for lines in body for line in lines)))) - 1)
    coloured = interactive() and not os.environ.get("NO_COLOR")
    lines = [
        _coloured(line, row["loop"], row["cause"]) if coloured and not k else line
        for row, lines in zip(rows, body, strict=True)
        for k, line in enumerate(lines)
    ]
    return "\n".join([f"Night {night}", "", head, rule, *lines])


def _coloured(line: str, loop: str, cause: str | None) -> str:
    """A row's first line with its loop in the colour of its cause."""
    import click

    colour, shown = CAUSE_STYLES.get(cause or ""), visible(loop)
    return line if colour is None else line.replace(shown, click.style(shown, fg=colour), 1)


def rendered_groups(rows: Sequence[Row], form: str, night: str) -> str:
    """Groups (analyzer.pages.groups.group_row) as text in one of the formats."""
    if form == "csv":
        return _csv(rows, names(GROUP_LIST))
    if form == "json":
        lists = ("candidates", "members")
        held = [{k: json.loads(v) if k in lists else v for k, v in r.items()} for r in rows]
        return json.dumps(held, indent=1)
    if form == "table":
        return _group_table(rows, night)
    lines = ["| " + " | ".join(OF_GROUPS) + " |", "|" + "|".join("---" for _ in OF_GROUPS) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(map(escaped, _group_cells(r))) + " |" for r in rows)])


def _group_cells(row: Row) -> tuple[str, ...]:
    start = ", ".join(f"{loop} {pct:.0f} %" for loop, pct in json.loads(row["candidates"]).items())
    members = [m for m in json.loads(row["members"]) if m != row["fix_first"]]
    cells = (
        *(row["group"], f"{row['loops']:.0f}", duration(row["group_period_s"]), start or "unseen"),
        *(row["source_action"] or "undecided", figure(row["others_gain_pct"]), ", ".join(members)),
    )
    return tuple(map(visible, cells))


def _group_table(rows: Sequence[Row], night: str) -> str:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    if not rows:
        return f"Night {night}: no loops share an oscillation"
    drawn = Table(box=SIMPLE_HEAD, title=f"Night {night}: one cause, several loops", title_justify="left")
    for name in OF_GROUPS:
        drawn.add_column(name, justify="right" if name in ("loops", "others gain %") else "left")
    for row in rows:
        drawn.add_row(*(Text(cell) for cell in _group_cells(row)))
    console = Console(width=None if interactive() else PIPED)
    with console.capture() as capture:
        console.print(drawn)
    return "\n".join(line.rstrip() for line in capture.get().rstrip().splitlines())


def interactive() -> bool:
    """Whether the output is read on a terminal."""
    return sys.stdout.isatty()
