"""Tables as CSV, safe to open in a spreadsheet."""

from __future__ import annotations

import csv
import io
import math

from reports.pages import Cell, Table
from reports.visible import visible

FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
"""First characters by which spreadsheets take a text for a formula (OWASP, CSV injection)."""


def harmless(text: str) -> str:
    """A text that no spreadsheet takes for a formula: an apostrophe goes before those that it would."""
    return f"'{text}" if text.lstrip(" ").startswith(FORMULA) or text.startswith(FORMULA) else text


def _cell(cell: Cell, numeric: bool) -> str:
    if not numeric:
        return harmless(visible(cell.text))
    if cell.number is None or not math.isfinite(cell.number):
        return ""
    return repr(float(cell.number))


def as_csv(table: Table) -> str:
    """A table as CSV: full numbers, empty where not known, texts harmless."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([harmless(c.key) for c in table.columns])
    for row in table.rows:
        writer.writerow([_cell(cell, col.numeric) for cell, col in zip(row, table.columns, strict=True)])
    return out.getvalue()
