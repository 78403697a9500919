"""Delimited text: its columns, read only as far as they are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
from pyarrow import csv

from identification.errors import InputError

WHOLE_FILE_BYTES = 64_000_000  # files below are read at once and kept for the next loop's read
KEPT_READS = 2
HEAD_ROWS = 1000


@dataclass(frozen=True, slots=True)
class Sheet:
    """A file of delimited text and how it is written; see `table.Table`.

    `skip_rows` is the number of lines up to and with the header, `bytes` the size of the file. With
    `as_written` all columns stay text, for dates of a stated format that may look like ISO dates and be none.
    """

    path: Path
    changed_ns: int
    bytes: int
    encoding: str
    delimiter: str
    decimal: str
    skip_rows: int
    names: tuple[str, ...]
    as_written: bool = False
    types: tuple[pa.DataType, ...] = ()
    found: tuple[str, ...] = ()

    @property
    def first_row(self) -> int:
        """Number of the first row of data, counted from 1."""
        return self.skip_rows + 1

    @property
    def notes(self) -> tuple[str, ...]:
        """How the file is written, and the lines of it that do not fit its header."""
        left_out = _loaded(self, self._wanted([0]))[1]
        if left_out == 0:
            return self.found
        return (*self.found, f"{left_out} lines do not have as many columns as the header and are left out")

    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        """First rows of some columns."""
        if self.bytes >= WHOLE_FILE_BYTES:
            return [_first_block(self)[i] for i in columns]
        return [array.slice(0, HEAD_ROWS) for array in self.read(columns)]

    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        """Whole columns, or the rows where a column holds one of some texts."""
        wanted = [*columns] if where is None else [*columns, where[0]]
        loaded = _loaded(self, self._wanted(wanted))[0]
        arrays = [loaded[i] for i in wanted]
        if where is None:
            return arrays
        keep = pc.is_in(pc.cast(arrays[-1], pa.string()), value_set=pa.array(where[1], pa.string()))
        return [array.filter(keep) for array in arrays[:-1]]

    def _wanted(self, columns: Sequence[int]) -> tuple[int, ...]:
        return tuple(range(len(self.names))) if self.bytes < WHOLE_FILE_BYTES else tuple(sorted(set(columns)))


@lru_cache(maxsize=KEPT_READS)
def _loaded(sheet: Sheet, columns: tuple[int, ...]) -> tuple[dict[int, pa.Array], int]:
    """Columns by position, and the number of lines left out."""
    try:
        return _parsed(sheet, columns, sheet.encoding)
    except pa.ArrowInvalid as error:
        if "UTF8" not in str(error):
            raise _unreadable(sheet.path, error) from error
        return _parsed(sheet, columns, "cp1252")
    except (UnicodeError, OSError) as error:
        raise _unreadable(sheet.path, error) from error


def _unreadable(path: Path, error: Exception) -> InputError:
    return InputError(
        f"{path}: {str(error)[:120]}",
        "delimited text in one encoding",
        "state --encoding or export the file again",
    )


def _parsed(sheet: Sheet, columns: tuple[int, ...], encoding: str) -> tuple[dict[int, pa.Array], int]:
    left_out: list[int] = []
    table = csv.read_csv(sheet.path, **_how(sheet, columns, encoding, left_out))
    return {i: _tidy(table.column(str(i))) for i in columns}, len(left_out)


@lru_cache(maxsize=KEPT_READS)
def _first_block(sheet: Sheet) -> dict[int, pa.Array]:
    """First rows of all columns, without reading further."""
    columns = tuple(range(len(sheet.names)))
    with csv.open_csv(sheet.path, **_how(sheet, columns, sheet.encoding, [])) as reader:
        batch = reader.read_next_batch().slice(0, HEAD_ROWS)
    return {i: _tidy(pa.chunked_array([batch.column(i)])) for i in columns}


def _how(sheet: Sheet, columns: tuple[int, ...], encoding: str, left_out: list[int]) -> dict[str, Any]:
    """Options of the parser; it adds to `left_out` for each line that does not fit."""
    names = [str(i) for i in range(len(sheet.names))]

    def leave_out(row: csv.InvalidRow) -> str:
        left_out.append(1)
        return "skip"

    kinds = dict.fromkeys(names, pa.string()) if sheet.as_written else None
    return {
        "read_options": csv.ReadOptions(
            skip_rows=sheet.skip_rows, column_names=names, encoding=encoding.replace("utf-8-sig", "utf-8")
        ),
        "parse_options": csv.ParseOptions(delimiter=sheet.delimiter, invalid_row_handler=leave_out),
        "convert_options": csv.ConvertOptions(
            column_types=kinds,
            include_columns=[names[i] for i in columns],
            null_values=[""],
            true_values=[],
            false_values=[],
            strings_can_be_null=True,
            decimal_point=sheet.decimal,
        ),
    }


def _tidy(column: pa.ChunkedArray) -> pa.Array:
    """One array; texts trimmed."""
    chunks = column.combine_chunks()
    array = chunks.chunk(0) if isinstance(chunks, pa.ChunkedArray) else chunks
    return pc.utf8_trim_whitespace(array) if pa.types.is_string(array.type) else array
