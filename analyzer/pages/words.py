"""Formatting of figures, times, columns and cells, common to all pages."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

from analyzer.columns import BY_NAME, GROUPS
from analyzer.columns import Column as Declared
from analyzer.history.plant_clock import stamp
from analyzer.loop.cost import mark
from analyzer.loop.decisions import CAUSES
from analyzer.words import toml_of
from analyzer.words.reason import in_short
from analyzer.words.units import Row, duration, number
from reports.pages import Cell, Column, Facts, Floats, Listing, Table, Text

__all__ = ["Row", "duration", "number", "stamp"]  # words that are chosen elsewhere

CellContent = Cell | str | float | None
"""Content of a table cell: a text or a number alone makes a cell."""
ROOM = "analyzer.pages"
"""Package with the tables and texts of pages."""
ALL_LOOPS = ("All loops", "index.html")
"""The link from a page to the morning page."""
SHARES = tuple(f"osc_{cause}_pct" for cause in CAUSES)
WHOLE = frozenset({"oscillating_pct", *SHARES})
"""Shares without decimals in lists."""
OF_GROUPS = {c.name: c for c in GROUPS if c.name not in BY_NAME}
"""Columns only in the table of groups; their headings include the unit."""


def signed(value: float | None) -> str:
    """A percentage with its sign, whole numbers from 10 on."""
    if value is None:
        return "–"
    text = f"{value:+.1f}" if abs(value) < 9.95 else f"{value:+.0f}"
    return text.replace("-", "−")


def with_noun(n: int, what: str) -> str:
    """A number with its noun."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def enumerated(names: list[str]) -> str:
    """Names in a sentence."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def texts(subject: str) -> dict[str, Any]:
    """The texts of a subject in texts.toml."""
    found: dict[str, Any] = toml_of(ROOM, "texts.toml")[subject]
    return found


def _declared(name: str) -> Declared:
    return BY_NAME.get(name) or OF_GROUPS[name]


def heading(name: str, **more: bool) -> Column:
    """A column of the store as a column of a page."""
    declared = _declared(name)
    unit = f" [{declared.unit}]" if name in OF_GROUPS and declared.unit else ""
    return Column(name, declared.heading + unit, declared.is_number, declared.hint, **more)


@cache
def page_columns(table: str) -> tuple[Column, ...]:
    """The columns of a table of a page, as declared in tables.toml."""
    stated = toml_of(ROOM, "tables.toml")[table]["columns"]
    parted = (c if isinstance(c, dict) else c.split() for c in stated)
    return tuple(
        Column(**c) if isinstance(c, dict) else heading(c[0], **dict.fromkeys(c[1:], True)) for c in parted
    )


def keys(*tables: str) -> tuple[str, ...]:
    """The keys of the columns of some tables, each once."""
    return tuple(dict.fromkeys(c.key for table in tables for c in page_columns(table)))


def page_table(declared: str, rows: Iterable[Iterable[CellContent]], **own: Any) -> Table:
    """A table of a page with its rows, as declared in tables.toml, except for its `own` properties."""
    stated = {
        k: tuple(v) if isinstance(v, list) else v for k, v in toml_of(ROOM, "tables.toml")[declared].items()
    }
    cell_rows = tuple(tuple(map(_as_cell, row)) for row in rows)
    return Table(
        **{"name": declared, "title": "", **stated, "columns": page_columns(declared), "rows": cell_rows}
        | own
    )


def _as_cell(value: CellContent) -> Cell:
    return value if isinstance(value, Cell) else Cell(value) if isinstance(value, str) else plain_cell(value)


def lead(*clauses: str) -> Text:
    """Clauses as opening sentences of a section."""
    return Text(tuple(f"{text[:1].upper()}{text[1:]}." for text in clauses), "lead")


def listing(texts: Iterable[str]) -> Listing:
    """A list of texts without leads."""
    return Listing(tuple(("", text) for text in texts))


def titled(name: str, text: str) -> tuple[str, str]:
    """A figure as a fact: the column's title, and a text with the column's unit."""
    declared = BY_NAME[name]
    return declared.title, f"{text} {declared.unit}".strip()


def known_figures(row: Row, names: Iterable[str]) -> Facts:
    """Known figures of a row, with their titles and units."""
    return Facts(tuple(titled(name, number(row[name])) for name in names if row[name] is not None))


def plain_cell(value: float | None) -> Cell:
    """A number that is not a column of the store."""
    return Cell(number(value), value)


def cell(row: Row, name: str) -> Cell:
    """The cell for a column of the store: three digits, a period in the most readable unit, or a text."""
    value = row[name]
    if name == "reason":
        return Cell(in_short(value or "")[0])
    if not _declared(name).is_number:
        return Cell(value or "")
    of_stem = name == "valve_travel_pct_per_h" and row.get("travel_of") == "stem" and value is not None
    text = duration(value) if name == "period_s" else number(value)
    return Cell(f"{text} stem" if of_stem else text, value)


def cells(row: Row, columns: str | Iterable[Column], **own: CellContent) -> tuple[CellContent, ...]:
    """A row of a table by the keys of its columns: its `own` cells, otherwise values of the store."""
    shown = page_columns(columns) if isinstance(columns, str) else columns
    return tuple(own[c.key] if c.key in own else cell(row, c.key) for c in shown)


def marked_cell(row: Row, name: str) -> Cell:
    """A figure in a list of loops: shares without decimals, with a mark if it is not comparable with other loops."""
    shown = cell(row, name)
    text = f"{shown.number:.0f}" if name in WHOLE and shown.number is not None else shown.text
    return Cell(text + mark(row, name), shown.number)


def cause_cell(cause: str | None) -> Cell:
    """A cause in its colour."""
    return Cell(cause or "", kind=cause if cause in CAUSES else "")


@dataclass(frozen=True, slots=True)
class PvScale:
    """Meaning of percent of span for a loop: PV at 0 %, the span, and the unit; '' if it is not stated."""

    low: float
    span: float
    unit: str

    @property
    def label(self) -> str:
        """The unit on an axis."""
        return self.unit or "own unit"

    def of(self, percent: Floats) -> Floats:
        """PV or SP in its own unit."""
        return self.low + percent * (self.span / 100.0)


PERCENT = "% of span"
PLAIN = PvScale(0.0, 100.0, PERCENT)
"""Percent unchanged, if the night does not state its meaning."""


def pv_scale_of(row: Row) -> PvScale:
    """Meaning of percent in a row of the night."""
    low, high = row.get("pv_lo"), row.get("pv_hi")
    if low is None or high is None or not high > low:
        return PLAIN
    return PvScale(low, high - low, row["pv_unit"] or "")


def in_loop_unit(name_unit: str, value: float | None, scale: PvScale) -> str:
    """A figure in % of span converted to the loop's own unit, in brackets; '' if that adds nothing."""
    if value is None or name_unit != PERCENT or not scale.unit or scale is PLAIN:
        return ""
    if scale.unit == "%" and scale.span == 100.0:
        return ""
    return f" ({number(value * scale.span / 100.0)} {scale.unit})"
