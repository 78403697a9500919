"""Pages and tables without markup: text for a terminal or a mail, and CSV; without pictures."""

from __future__ import annotations

import csv
import io
import math
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from rich.cells import cell_len, chop_cells

from reports.pages import Block, Cell, Column, Facts, Listing, Page, Table, Text, Tiles
from reports.texts import harmless, visible, visible_parts

WIDTH = 100
"""Characters of a line."""
GAP = "  "
"""Separator of two columns."""
LEAST = 20
"""Minimum characters per line of a wrapped cell, however narrow the terminal."""


def _wrapped(text: str, first: str = "", then: str = "") -> list[str]:
    return textwrap.wrap(" ".join(text.split()), WIDTH, initial_indent=first, subsequent_indent=then) or []


def _table_lines(table: Table) -> list[str]:
    """A row as its first cell and, indented below, the other cells that are not empty."""
    out = []
    for row in table.rows:
        head, *rest = (cell.text for cell in row)
        out.append(" ".join(head.split()))
        for column, text in zip(table.columns[1:], rest, strict=True):
            if text:
                out += _wrapped(f"{column.title}: {text}", "  ", "    ")
    return [*out, *_wrapped(table.note)]


def _block(block: Block) -> list[str]:
    match block:
        case Table():
            return _table_lines(block)
        case Text():
            return [line for p in block.paragraphs for line in _wrapped(p)]
        case Listing():
            return [line for lead, text in block.items for line in _wrapped(f"{lead} {text}", "- ", "  ")]
        case Facts():
            return [line for term, detail in block.items for line in _wrapped(f"{term}: {detail}", "", "  ")]
        case Tiles():
            return [f"{figure} {what}" for figure, what, _ in block.items]
    return []


def render(page: Page) -> str:
    """A page as plain text."""
    page = visible_parts(page)
    lines = [page.title, "=" * min(len(page.title), WIDTH), *_wrapped(page.subtitle)]
    for section in page.sections:
        lines += ["", section.title, "-" * min(len(section.title), WIDTH)]
        lines += [line for block in section.blocks for line in _block(block)]
    return "\n".join([*lines, "", *_wrapped(page.made)]).rstrip() + "\n"


def csv_text(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV, empty cells for unknown values, texts safe for spreadsheets."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(map(harmless, names))
    writer.writerows([harmless(visible(v)) if isinstance(v, str) else v for v in row] for row in rows)
    return out.getvalue()


def as_csv(table: Table) -> str:
    """A table as CSV: full numbers, empty cells for unknown values, safe texts."""
    rows = [
        [_held(c, column.numeric) for c, column in zip(row, table.columns, strict=True)] for row in table.rows
    ]
    return csv_text([c.key for c in table.columns], rows)


def _held(cell: Cell, numeric: bool) -> str | float | None:
    if not numeric:
        return cell.text
    return None if cell.number is None or not math.isfinite(cell.number) else float(cell.number)


def table(
    columns: Sequence[Column], rows: Sequence[Sequence[str]], width: int
) -> tuple[str, list[list[str]]]:
    """The line of headings, and the lines of each row.

    Parameters
    ----------
    columns : sequence of Column
        Numbers are right-aligned, and the cells of a wide one (at most one) are wrapped.
    rows : sequence of rows
        A cell for each column.
    width : int
        Characters of a line; columns that are not wide are never cut, and may make it longer.
    """
    sizes = [
        max(map(cell_len, (h.title, *(row[k] for row in rows))), default=0) for k, h in enumerate(columns)
    ]
    others = sum(size for size, h in zip(sizes, columns, strict=True) if not h.wide)
    room = max(width - others - len(GAP) * (len(columns) - 1) - 2, LEAST)
    sizes = [min(size, room) if h.wide else size for size, h in zip(sizes, columns, strict=True)]
    head = _line([h.title for h in columns], columns, sizes)
    return head, [_lines(row, columns, sizes, room) for row in rows]


def _lines(row: Sequence[str], columns: Sequence[Column], sizes: Sequence[int], room: int) -> list[str]:
    folded = [_folded(cell, room) if h.wide else [cell] for cell, h in zip(row, columns, strict=True)]
    return [
        _line([cell[k] if k < len(cell) else "" for cell in folded], columns, sizes)
        for k in range(max(map(len, folded)))
    ]


def _folded(text: str, width: int) -> list[str]:
    """The lines of a wrapped cell, by display width; a word longer than a line is split."""
    if cell_len(text) <= width:
        return [text]
    lines = [""]
    for word in (part for whole in text.split() for part in chop_cells(whole, width)):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if cell_len(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def _line(cells: Sequence[str], columns: Sequence[Column], sizes: Sequence[int]) -> str:
    """Cells side by side, each padded to its column's display width."""
    filled = []
    for text, column, size in zip(cells, columns, sizes, strict=True):
        space = " " * (size - cell_len(text))
        filled.append(space + text if column.numeric else text + space)
    return f" {GAP.join(filled)}".rstrip()


def json_ready(x: Any) -> Any:
    """The same value with JSON-compatible numbers: no NaN, no infinity, no numpy types."""
    if isinstance(x, dict):
        return {str(k): json_ready(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [json_ready(v) for v in x]
    if isinstance(x, np.generic):
        x = x.item()
    if isinstance(x, float):
        return float(f"{x:.6g}") if math.isfinite(x) else None
    return x
