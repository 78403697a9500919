"""Delimited text: its columns, read only as needed."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa
import pyarrow.compute as pc
from pyarrow import csv

from analyzer.history.table import HEAD_ROWS, Table, as_text, trimmed
from identification.errors import InputError

WHOLE_SHARE = 0.95
"""Share of a file's lines that must come back as rows: where fewer do, an open quote has swallowed the
rest."""
LATE_COLUMNS = 3
"""Columns with late texts for which a pass begins again, one by one; then all columns are read as texts."""
WHOLE_BYTES = 64000000
"""Size from which delimited text is streamed into Parquet once, instead of being read whole and kept for the
next loop [bytes]."""

KEPT_READS = 2
BLOCK_BYTES = 1 << 24
Read = TypeVar("Read")
LATE_TEXT = re.compile(r"In CSV column #(?P<column>\d+): (?:Row #\d+: )?CSV conversion error")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet(Table):
    """A file of delimited text and its format.

    `first_row` is the number of the first row below the header, `bytes` the size of the file. With `as_written` all
    columns stay text, for dates of a stated format that look like ISO dates but are not; with `unquoted` quotes have
    no special meaning.
    """

    first_row: int
    changed_ns: int = field(repr=False)
    bytes: int
    encoding: str
    delimiter: str
    as_written: bool = False
    unquoted: bool = False

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the format of the file, and on the lines that do not match its header."""
        return (*self.found, *_loaded(self)[1])

    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        return [array.slice(0, HEAD_ROWS) for array in self.read(columns)]

    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        columns_read = _loaded(self)[0]
        arrays = [columns_read[i] for i in columns]
        if where is None:
            return arrays
        keep = pc.is_in(as_text(columns_read[where[0]]), value_set=pa.array(where[1], pa.string()))
        return [array.filter(keep) for array in arrays]


@lru_cache(maxsize=KEPT_READS)
def _loaded(sheet: Sheet) -> tuple[list[pa.Array], list[str]]:
    """Columns of the whole file by position, and notes on it."""
    return read_through(sheet, _parsed_sheet)


def read_through(
    sheet: Sheet, read: Callable[[Sheet, Collection[int]], tuple[int, int, Read]]
) -> tuple[Read, list[str]]:
    """Result of `read` on a sheet, which also returns the numbers of rows and of lines left out; and notes on these.
    Quotes lose their meaning if so few lines were returned that an open one must have swallowed others.

    Raises
    ------
    InputError
        The text cannot be read to its end.
    """
    notes = []
    try:
        rows, left_out, found = _as_far_as_numbers_go(sheet, read)
        lines = _count_lines(sheet.path, sheet.changed_ns) - sheet.first_row + 1
        if rows + left_out < WHOLE_SHARE * lines - 1:
            more, others_left_out, found = _as_far_as_numbers_go(replace(sheet, unquoted=True), read)
            if more > rows + left_out:
                left_out, notes = others_left_out, ["a quote is not closed: quotes are read as characters"]
            else:
                found = _as_far_as_numbers_go(sheet, read)[2]
    except (UnicodeError, pa.ArrowInvalid) as error:
        remedy = "state --encoding or export the file again"
        seen = f"{sheet.path}: {str(error)[:120]}"
        raise InputError(seen, "delimited text in one encoding", remedy) from error
    lost = f"{left_out} lines do not have as many columns as the header and are left out"
    return found, [*notes, lost] if left_out else notes


def _as_far_as_numbers_go(sheet: Sheet, read: Callable[[Sheet, Collection[int]], Read]) -> Read:
    """Result of `read` on a sheet, repeated with a column as text if only its first block is all numbers, or in
    another encoding if a later letter requires it."""
    texts = set[int]()
    while True:
        try:
            return read(sheet, texts)
        except pa.ArrowInvalid as error:
            late = LATE_TEXT.search(str(error))
            if "UTF8" in str(error) and sheet.encoding != "cp1252":
                sheet = replace(sheet, encoding="cp1252")
            elif late is not None and int(late["column"]) not in texts:
                few = len(texts) < LATE_COLUMNS
                texts.update([int(late["column"])] if few else range(len(sheet.names)))
            else:
                raise


@lru_cache(maxsize=KEPT_READS)
def _count_lines(path: Path, changed_ns: int) -> int:
    """Number of non-empty lines of a file, within one."""
    count = 0
    with path.open("rb") as file:
        while block := file.read(BLOCK_BYTES):
            count += block.count(b"\n") or block.count(b"\r")
            count -= block.count(b"\n\n") + block.count(b"\n\r\n")
    return count


def _parsed_sheet(sheet: Sheet, texts: Collection[int]) -> tuple[int, int, list[pa.Array]]:
    left_out: list[int] = []
    table = csv.read_csv(sheet.path, **reading(sheet, left_out, texts))
    return table.num_rows, len(left_out), [trimmed(column, sheet.unquoted) for column in table.columns]


def types_of(sheet: Sheet) -> tuple[pa.DataType, ...]:
    """Types of all columns; for a big file those of its first rows only."""
    if sheet.bytes < WHOLE_BYTES:
        return tuple(array.type for array in _loaded(sheet)[0])
    with csv.open_csv(sheet.path, **reading(sheet, [], ())) as reader:
        return tuple(reader.schema.types)


def reading(sheet: Sheet, left_out: list[int], texts: Collection[int]) -> dict[str, Any]:
    """Options of the parser; it adds to `left_out` for each line that does not match.

    One thread: the parser calls back for such lines, and calls from its own threads sometimes crashed processes.
    """
    names = [str(i) for i in range(len(sheet.names))]

    def leave_out(row: csv.InvalidRow) -> str:
        left_out.append(1)
        return "skip"

    as_text = names if sheet.as_written else [names[i] for i in texts]
    return {
        "read_options": csv.ReadOptions(
            skip_rows=sheet.first_row - 1,
            column_names=names,
            encoding=sheet.encoding.replace("utf-8-sig", "utf-8"),
            use_threads=False,
        ),
        "parse_options": csv.ParseOptions(
            delimiter=sheet.delimiter,
            quote_char=False if sheet.unquoted else '"',
            invalid_row_handler=leave_out,
        ),
        "convert_options": csv.ConvertOptions(
            column_types=dict.fromkeys(as_text, pa.string()) if as_text else None,
            null_values=[""],
            true_values=[],
            false_values=[],
            strings_can_be_null=True,
            decimal_point=sheet.decimal,
        ),
    }
