"""How far the cells of a workbook's sheets are spread: a reader holds every cell between the first and the last."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from analyzer.limits import HISTORY
from identification.errors import InputError

SHEET = re.compile(r"xl/worksheets/[^/]+\.xml")
CELL = re.compile(rb"<(?:\w+:)?c\b[^>]*?\br=\"([A-Za-z]{1,7})(\d{1,9})\"")
BLOCK_BYTES = 1 << 20
LONGEST = 200
"""Bytes of a cell's first tag at most, which may begin in one block and end in the next."""


@dataclass(slots=True)
class Spread:
    """The last row and column that have a cell, the cell that is farthest, and how many cells there are."""

    row: int = 0
    column: int = 0
    cells: int = 0
    far: str = ""

    def take(self, column: bytes, row: bytes) -> None:
        """Count a cell."""
        self.cells += 1
        across, down = column_number(column), int(row)
        if across > self.column or down > self.row:
            self.far = f"{column.decode()}{row.decode()}"
        self.column, self.row = max(self.column, across), max(self.row, down)


def column_number(letters: bytes) -> int:
    """The number of a column from 1 on: A is 1, AA 27."""
    number = 0
    for letter in letters.upper():
        number = 26 * number + letter - 64
    return number


def require_dense(path: Path, members: Sequence[zipfile.ZipInfo]) -> None:
    """Raise InputError where a sheet's cells span far more cells than there are: one stray cell in a far corner."""
    for info in members:
        if not SHEET.fullmatch(info.filename):
            continue
        with zipfile.ZipFile(path) as archive, archive.open(info) as sheet:
            found = Spread()
            for cell in _cells(iter(lambda: sheet.read(BLOCK_BYTES), b"")):
                found.take(*cell)
        span = found.row * found.column
        if span > HISTORY.spanned_cells and span > HISTORY.spanned_times * found.cells:
            name = Path(info.filename).stem
            seen = f"{path}, {name}: {found.cells} cells that span {span}, as far as cell {found.far}"
            remedy = f"delete what stands alone far from the table, such as {found.far}, or save it as CSV"
            raise InputError(seen, "a table without stray cells", remedy)


def _cells(blocks: Iterator[bytes]) -> Iterator[tuple[bytes, bytes]]:
    """Column and row of each cell of a sheet's text."""
    kept = b""
    for block in blocks:
        text = kept + block
        end = max(text.rfind(b">"), len(text) - LONGEST)
        yield from (found.groups() for found in CELL.finditer(text[: end + 1]))  # type: ignore
        kept = text[end + 1 :]
    yield from (found.groups() for found in CELL.finditer(kept))  # type: ignore
