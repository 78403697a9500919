"""Tables without a header: which column is what, by what stands in it."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence

import pyarrow as pa

from analyzer.history import stamps
from analyzer.history.clock import SINCE_START, scale_of
from analyzer.history.names import WORDS

UNNAMED = "column {}"
"""Name of a column that has none, by its place, from 1."""
ROWS = 200
"""Rows that are looked at."""
MOSTLY = 0.8
"""Share of a column's cells that are numbers where it holds numbers; the rest is a historian's words; ours."""
NUMBER = re.compile(r"^[+-]?(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?$")
GOOD_OR_BAD = frozenset(WORDS["quality"]["unnamed"])


def taken_as(lines: Sequence[str], delimiter: str) -> tuple[str, ...] | None:
    """Names for the columns of a table without a header, of tag, stamp, value and quality or of a stamp and numbers;
    None for any other.

    Only where each of the first rows has the same shape: a stamp, a text that is none of the rest, and a number; or a
    stamp first and behind it numbers alone, which are named by their places (loops.csv may tell what they are).
    """
    rows = [row for row in csv.reader(io.StringIO("\n".join(lines[:ROWS])), delimiter=delimiter) if row]
    if len(rows) < 3 or len({len(row) for row in rows}) != 1 or len(rows[0]) < 3:
        return None
    columns = [[cell.strip() for cell in column] for column in zip(*rows, strict=True)]
    kinds = [_kind(column) for column in columns]
    if kinds[0] == "stamp" and set(kinds[1:]) == {"number"}:
        return ("timestamp", *(UNNAMED.format(i + 1) for i in range(1, len(columns))))
    if len(columns) > 8 or kinds.count("stamp") != 1 or "text" not in kinds or "number" not in kinds:
        return None
    tag = max(_places(kinds, "text"), key=lambda i: (len(set(columns[i])), -i))
    value = max(_places(kinds, "number"), key=lambda i: (len(set(columns[i])), -i))
    names = [UNNAMED.format(i + 1) for i in range(len(columns))]
    names[tag], names[kinds.index("stamp")], names[value] = "tag", "timestamp", "value"
    free = [i for i in range(len(columns)) if names[i].startswith("column")]
    coded = [i for i in free if {cell.lower() for cell in columns[i]} <= GOOD_OR_BAD]
    if coded:
        names[max(coded, key=lambda i: (kinds[i] == "quality", i))] = "quality"
    return tuple(names)


def _places(kinds: Sequence[str], kind: str) -> list[int]:
    return [i for i, found in enumerate(kinds) if found == kind]


def _kind(cells: Sequence[str]) -> str:
    """'stamp', 'number', 'quality' or 'text' for what all cells of a column are; '' where they are not alike."""
    numbers = [float(cell.replace(",", ".")) for cell in cells if NUMBER.match(cell)]
    if NUMBER.match(cells[0]) and len(numbers) >= MOSTLY * len(cells):
        scale = scale_of(pa.array(numbers))
        return "number" if scale is None or scale in SINCE_START.values() else "stamp"
    if {cell.lower() for cell in cells} <= GOOD_OR_BAD:
        return "quality"
    parts = stamps.fields(pa.array(cells))
    if parts is not None and parts.readable.all():
        return "stamp"
    return "text" if all(cell and not NUMBER.match(cell) for cell in cells) else ""
