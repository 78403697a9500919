"""`triage rank`: the loops of a night in morning order, as text; only reads."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from shutil import get_terminal_size
from typing import Any

from analyzer.columns import BELIEVED, BY_NAME, LISTED, NOTED, RANKING, names
from analyzer.lanes.lanes import FIGURE, lanes_in
from analyzer.loop.cost import LOSS, MARK, OF_RECORDED, RECORDED, SIGNIFICANCE, compares, cost_column, mark
from analyzer.loop.decisions import Cause, Due, Lane
from analyzer.pages.words import SHARES, Row, cell, keys, marked_cell, number
from analyzer.store import notes
from analyzer.store.store import Store
from analyzer.words.units import gain_unit
from identification.errors import InputError
from reports.markdown import escaped, rows_of_table
from reports.pages import Column
from reports.plain import csv_text, table
from reports.texts import visible

BELIEF_COLUMNS = tuple(c for c in BELIEVED if c.name not in ("constants", "state", "news_tone"))
"""Columns that beliefs add to a list."""
LANE_FIGURES = tuple(n for n in FIGURE.values() if n not in names((*RANKING, *BELIEF_COLUMNS)))
"""Figures of lanes that are not in the list."""
SORTABLE = (*names(RANKING), "importance", LOSS, *LANE_FIGURES, *names(BELIEF_COLUMNS))
KEPT = names((*RANKING, *LISTED, *BELIEF_COLUMNS))
LIST_COLUMNS = (*KEPT, *names(NOTED))
"""Columns of CSV and JSON: the contract's, then the units of the settings, and the full advice."""
MOST_NAMES = 10
"""Maximum number of areas listed in an error."""
WIDEST, PIPED = 240, 180
"""Characters of a line of a wide table, and of one that is not on a terminal."""
CAUSE_STYLES: Mapping[str, str] = {
    Cause.VALVE: "red",
    Cause.TUNING: "yellow",
    Cause.LOAD: "cyan",
    Cause.UNDECIDED: "magenta",
}
"""Colours of causes on the terminal."""
SHOWN = keys("list")
"""Columns for people, in order; new settings are in the cells of the old ones."""
WITH_UNITS = frozenset({"period_s", "kp", "ti"})
"""Numbers that are shown as texts, with their units."""
LEAST_REASON = 44
"""Minimum characters of a line of the reason."""


def ranked(
    store: Store,
    column: str | None = None,
    top: int | None = None,
    night: str | None = None,
    ascending: bool = False,
    area: str | None = None,
    lane: Lane | None = None,
) -> tuple[list[dict[str, Any]], str]:
    """Rows of a night, or of one of its areas or lanes, sorted; loops without a figure come last by name.

    Without a column, loops that need a look come first: those of a lane by its figure; all by their loss if
    loops.csv states importances, otherwise by the significance of their oscillation.

    Raises
    ------
    InputError
        There is no such store, night, column or area.
    """
    if column is not None and column not in SORTABLE:
        in_words = (c for c in SORTABLE if get_close_matches(column, c.split("_"), 1, 0.75))
        near = get_close_matches(column, SORTABLE, 3) or [*in_words][:3] or [SIGNIFICANCE, "period_s"]
        remedy = "correct --by; 'triage rank --format csv' heads its columns with all names"
        raise InputError(f"column {column!r}", "one such as " + " or ".join(near), remedy)
    name = night or store.require()
    known = notes.read_notes(store.path)
    rows = [
        _noted(row, known)
        for row in store.rows("nights", name, (*KEPT, *LANE_FIGURES, "timezone", "travel_of"))
    ]
    rows = _rows_of_area(rows, area)
    if lane is not None:
        rows = [r for r in rows if lane in lanes_in(r)]
    if column is None and not ascending:
        return worst_first(rows, None if lane is None else FIGURE[lane])[:top], name
    return _sorted_by_column(rows, column or SIGNIFICANCE, ascending)[:top], name


def _noted(row: dict[str, Any], known: Mapping[str, tuple[notes.Note, ...]]) -> dict[str, Any]:
    """A row with the newest note of its loop; non-finite numbers become unknown."""
    row = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}
    found = notes.last(known, row["loop"])
    text, until = (
        (None, None) if found is None else (found.as_line(row["timezone"]), found.hidden_until or None)
    )
    return {**row, "note": text, "hidden_until": until}


def hidden_loops(rows: Sequence[Row], night: str) -> tuple[str, ...]:
    """Loops that their notes hide from a night's list."""
    return tuple(r["loop"] for r in rows if notes.hides(r["hidden_until"], night))


def _sorted_by_column(rows: Sequence[dict[str, Any]], column: str, ascending: bool) -> list[dict[str, Any]]:
    """Rows by a column, ties and loops without a figure by name."""
    known, unknown = ([r for r in rows if (r[column] in (None, "")) is empty] for empty in (False, True))
    known.sort(key=lambda r: r["loop"])
    known.sort(key=lambda r: r[column], reverse=BY_NAME[column].is_number and not ascending)
    return known + sorted(unknown, key=lambda r: r["loop"])


def worst_first(rows: Sequence[dict[str, Any]], column: str | None = None) -> list[dict[str, Any]]:
    """Rows in morning order: oscillating loops, then loops in another lane, then the rest.

    Each part is sorted by a column. Loops with an unknown or incomparable figure follow, by the significance within
    their own recorded range.
    """
    by = cost_column(rows)
    alike = _sorted_by_column([r for r in rows if compares(r, column or by)], column or by, False)
    others = _sorted_by_column([r for r in rows if not compares(r, column or by)], SIGNIFICANCE, False)
    return sorted((*alike, *others), key=lambda row: _worth(row, by == LOSS))


def _worth(row: Row, lossy: bool) -> int:
    """0 for loops that need a look first, 2 for those that need none; losses are compared across lanes."""
    lanes = lanes_in(row)
    if row["due"] == Due.SHUTDOWN:
        return 1
    if Lane.OSCILLATION in lanes or row["cause"] == Cause.VALVE:
        return 0
    return 2 if not lanes else 0 if lossy else 1


def _rows_of_area(rows: list[dict[str, Any]], area: str | None) -> list[dict[str, Any]]:
    """The rows of an area, all if none is given; upper and lower case are equal."""
    if area is None:
        return rows
    found = [r for r in rows if (r["area"] or "").casefold() == area.casefold()]
    if not found:
        known = sorted({r["area"] for r in rows if r["area"]})
        named = ", ".join(known[:MOST_NAMES]) or "none: loops.csv states no areas"
        raise InputError(f"area {area!r}", f"one of {named}", "correct --area")
    return found


def rendered(rows: Sequence[Row], form: str, night: str, wide: bool = False, lane: Lane | None = None) -> str:
    """Loops as text in one of the formats; a `wide` table has all columns, one of a lane its figure."""
    if form == "csv":
        return csv_text(LIST_COLUMNS, ([r[c] for c in LIST_COLUMNS] for r in rows)).rstrip("\n")
    if form == "json":
        return json.dumps([{c: r[c] for c in LIST_COLUMNS} for r in rows], indent=1)
    if not rows:
        return f"Night {night}: no loop is in the lane {lane}" if lane else f"Night {night}: no loops"
    shown = _shown_of(rows, None if lane is None else FIGURE[lane])
    if form == "table":
        text, sign = as_table(rows, night, WIDEST if wide else None, shown), MARK
    else:
        cells = [map(escaped, brief(row, shown).values()) for row in rows]
        text = "\n".join(rows_of_table([BY_NAME[name].heading for name in shown], cells))
        sign = escaped(MARK)
    marked = any(mark(row, column) for row in rows for column in shown)
    return f"{text}\n\n{sign} {OF_RECORDED}" if marked else text


def as_table(
    rows: Sequence[Row], night: str, width: int | None = None, columns: Sequence[str] | None = None
) -> str:
    """The columns for people as a table; the least important are dropped if `width` (default: the terminal's) is
    small."""
    width = width or (get_terminal_size().columns if interactive() else PIPED)
    shown = [brief(row, columns or SHOWN) for row in rows]
    kept = _fitting(shown, width)
    headings = [
        Column(n, BY_NAME[n].heading, BY_NAME[n].is_number and n not in WITH_UNITS, wide=n == "reason")
        for n in kept
    ]
    head, body = table(headings, [[cells[name] for name in kept] for cells in shown], width)
    rule = " " + _line() * (max(map(len, (head, *(line for lines in body for line in lines)))) - 1)
    if interactive() and not os.environ.get("NO_COLOR"):
        for row, lines in zip(rows, body, strict=True):
            lines[0] = _coloured(lines[0], row["loop"], row["cause"])
    return "\n".join([f"Night {night}", "", head, rule, *(line for lines in body for line in lines)])


def _line() -> str:
    """Character of a line, by what the output can show."""
    try:
        "\u2500".encode(getattr(sys.stdout, "encoding", None) or "utf-8")
    except UnicodeEncodeError:
        return "-"
    return "\u2500"


def _coloured(line: str, loop: str, cause: str | None) -> str:
    """A row's first line with its loop in the colour of its cause."""
    import click

    colour, shown = CAUSE_STYLES.get(cause or ""), visible(loop)
    return line if colour is None else line.replace(shown, click.style(shown, fg=colour), 1)


def _shown_of(rows: Sequence[Row], figure: str | None) -> tuple[str, ...]:
    """The columns for people: a lane's figure instead of the significance, and the loss if there is one."""
    lead = [] if figure is None or figure in SHOWN else [figure]
    lead += [LOSS] if cost_column(rows) == LOSS else []
    rest = [name for name in SHOWN[1:] if figure in (None, *SHOWN) or name not in SHARES]
    return (SHOWN[0], *lead, *rest)


def brief(row: Row, columns: Sequence[str]) -> dict[str, str]:
    """A row for people, by column: short figures, old and new settings in one cell."""
    gain = gain_unit(row.get("gain_unit"), row.get("pv_unit"), row.get("op_unit"))
    in_percent = row.get("gain_unit") in (None, "percent") and row.get("percent_of") == RECORDED
    gain += MARK if in_percent else ""
    noted = f" [note: {row['note']}]" if row.get("note") else ""
    special = {
        "kp": _setting_text(row["kp"], row["kp_new"], gain),
        "ti": _setting_text(row["ti"], row["ti_new"], row.get("ti_unit") or "s", "none"),
        "reason": cell(row, "reason").text + noted,
    }
    return {name: visible(special.get(name) or marked_cell(row, name).text) for name in columns}


def _fitting(shown: Sequence[Mapping[str, str]], width: int) -> tuple[str, ...]:
    """The columns that fit into a width with all tags complete, without the least important ones; none without
    rows."""
    kept = list(shown[0]) if shown else []
    size = {name: max(map(len, (BY_NAME[name].heading, *(row[name] for row in shown)))) + 1 for name in kept}
    size |= {"reason": LEAST_REASON + 1} if shown else {}
    for name in keys("list-worth-least"):
        if name in kept and sum(size[n] for n in kept) + 1 > width:
            kept.remove(name)
    return tuple(kept)


def _setting_text(now: float | None, new: float | None, unit: str, off: str = "0") -> str:
    """A setting and its new value, with its unit; empty if neither is known, `off` if it is 0."""
    if now is None:
        return f"-> {number(new)} {unit}" if new else ""
    present = number(now) if now else off
    if new:
        return f"{present} -> {number(new)} {unit}"
    return f"{present} {unit}" if now else off


def interactive() -> bool:
    """Whether the output is a terminal."""
    return sys.stdout is not None and sys.stdout.isatty()
