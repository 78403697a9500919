"""Spread of the cells in a workbook's sheets: a reader keeps every cell between the first and the last in memory."""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO
from xml.parsers import expat

from identification.errors import InputError

SPANNED_CELLS = 5000000
"""Cells that those of a sheet may span from the first to the last, independently of their contents [cells]: a
reader holds 32 bytes for each, 160 MB."""
SPANNED_TIMES = 20.0
"""Times their own number that they may span beyond it: a table has most of its cells, and one stray one makes
a thousand times as many."""

CELL = re.compile(rb"<(?:\w+:)?c\b[^>]*?\br=\"([A-Za-z]{1,7})(\d{1,9})\"")
BLOCK_BYTES = 1 << 20
LONGEST = 200
"""Maximum bytes of a cell's first tag, which may begin in one block and end in the next."""
ROW_RECORD, CELL_RECORDS = 0, 11
"""Record types of a binary sheet (MS-XLSB): the start of a row, and the last type of a cell."""
LAST, LONGEST_HEAD = 0x7F, 10
"""Largest last byte of a number in a record's head; maximum bytes of a head with the number after it."""
UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, NotImplementedError)
"""Exceptions for an archive that is damaged, has a password or an unknown compression."""


@dataclass(slots=True)
class Spread:
    """The last row and column of a sheet with a cell, the farthest cell, and the number of cells."""

    name: str
    row: int = 0
    column: int = 0
    cells: int = 0
    far: tuple[int, int] = (0, 0)

    def take(self, row: int, column: int) -> None:
        """Count a cell; rows and columns from 1 on."""
        self.cells += 1
        if column > self.column or row > self.row:
            self.far = row, column
            self.row, self.column = max(self.row, row), max(self.column, column)


def column_number(letters: bytes) -> int:
    """The number of a column from 1 on: A is 1, AA 27."""
    number = 0
    for letter in letters.upper():
        number = 26 * number + letter - 64
    return number


def column_letters(number: int) -> str:
    """The letters of a column from 1 on: 1 is A, 27 is AA."""
    letters = ""
    while number:
        number, last = divmod(number - 1, 26)
        letters = chr(65 + last) + letters
    return letters


def require_dense(path: Path, members: Sequence[zipfile.ZipInfo]) -> None:
    """Raise InputError if a sheet's cells span far more cells than there are: one stray cell in a far corner."""
    for info in members:
        spreads = next((read for part, read in SHEETS.items() if part.fullmatch(info.filename)), None)
        if spreads is None:
            continue
        with suppress(*UNREADABLE), zipfile.ZipFile(path) as archive, archive.open(info) as sheet:
            for found in spreads(sheet, PurePosixPath(info.filename).stem):
                _require_dense(path, found)


def _require_dense(path: Path, found: Spread) -> None:
    span = found.row * found.column
    if span > SPANNED_CELLS and span > SPANNED_TIMES * found.cells:
        farthest = f"{column_letters(found.far[1])}{found.far[0]}"
        seen = f"{path}, {found.name}: {found.cells} cells that span {span}, as far as cell {farthest}"
        remedy = f"delete isolated cells far from the table, such as {farthest}, or save it as CSV"
        raise InputError(seen, "a table without stray cells", remedy)


def _of_xml(sheet: IO[bytes], name: str) -> Iterator[Spread]:
    """The sheet of an xlsx or xlsm workbook."""
    found, kept = Spread(name), b""
    for block in iter(lambda: sheet.read(BLOCK_BYTES), b""):
        text = kept + block
        end = max(text.rfind(b">"), len(text) - LONGEST)
        for column, row in CELL.findall(text[: end + 1]):
            found.take(int(row), column_number(column))
        kept = text[end + 1 :]
    yield found


def _of_records(sheet: IO[bytes], name: str) -> Iterator[Spread]:
    """The sheet of an xlsb workbook: a row begins with its number, a cell with its column, both from 0 on."""
    found, row = Spread(name), 0
    for kind, first in _records(sheet):
        if kind == ROW_RECORD:
            row = first + 1
        elif kind <= CELL_RECORDS:
            found.take(row, first + 1)
    yield found


def _records(sheet: IO[bytes]) -> Iterator[tuple[int, int]]:
    """Type of each record, and the number in the four bytes after its head."""
    kept, at = b"", 0
    while True:
        block = sheet.read(BLOCK_BYTES)
        kept, at = kept[at:] + block, max(at - len(kept), 0)
        end = len(kept) - (LONGEST_HEAD if block else 0)
        while at < end:
            kind, size = kept[at], kept[at + 1] if at + 1 < len(kept) else 0
            begun = at + 2
            if kind > LAST or size > LAST:
                kind, begun = _number(kept, at, 2)
                size, begun = _number(kept, begun, 4)
            yield kind, int.from_bytes(kept[begun : begun + 4], "little")
            at = begun + size
        if not block:
            return


def _number(data: bytes, at: int, most: int) -> tuple[int, int]:
    """A number of seven bits per byte, lowest first, of at most so many bytes, and the start of the next."""
    number = 0
    for k, byte in enumerate(data[at : at + most]):
        number |= (byte & LAST) << 7 * k
        if byte <= LAST:
            return number, at + k + 1
    return number, at + most


class _OpenDocument:
    """Handlers of the elements of content.xml: tables, their rows and cells, each possibly repeated."""

    def __init__(self) -> None:
        self.sheets = [Spread("")]
        self._row = self._column = 0
        self._rows = 1

    def start(self, element: str, stated: Mapping[str, str]) -> None:
        """Start of a table, a row or a cell."""
        if element == "table:table":
            self.sheets.append(Spread(stated.get("table:name", "")))
            self._row = 0
        elif element == "table:table-row":
            self._rows = _times(stated, "rows")
            self._row, self._column = self._row + self._rows, 0
        elif element in ("table:table-cell", "table:covered-table-cell"):
            self._column += _times(stated, "columns")
            if any(name.startswith("office:") or name == "table:formula" for name in stated):
                self.sheets[-1].take(self._row, self._column)


def _times(stated: Mapping[str, str], of: str) -> int:
    """Number of rows or columns that an element represents."""
    text = stated.get(f"table:number-{of}-repeated", "")
    return int(text) if text.isdecimal() and len(text) < 20 else 1


def _of_open_document(sheet: IO[bytes], name: str) -> Iterator[Spread]:
    """The sheets of an ods workbook."""
    found, parser = _OpenDocument(), expat.ParserCreate()
    parser.StartElementHandler = found.start
    with suppress(expat.ExpatError):  # which its reader reports
        parser.ParseFile(sheet)
    yield from found.sheets


SHEETS: dict[re.Pattern[str], Callable[[IO[bytes], str], Iterator[Spread]]] = {
    re.compile(r"xl/worksheets/[^/]+\.xml"): _of_xml,
    re.compile(r"xl/worksheets/[^/]+\.bin"): _of_records,
    re.compile(r"content\.xml"): _of_open_document,
}
"""Parts of an archive with sheets, and the functions that find their cells."""
