"""A file of named columns, whatever its format; what layouts make of it; and what a user may state about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import pyarrow as pa
import pyarrow.compute as pc

if TYPE_CHECKING:
    from analyzer.history.clock import Clock
    from analyzer.history.series import MainSpan, Raw


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How exports are written; None means: find out from the file.

    Parameters
    ----------
    delimiter, decimal, encoding : str or None
        Of delimited text: the separator of columns, the decimal mark, the character encoding.
    day_first : bool or None
        True where 03/04/2024 is the third of April.
    date_format : str or None
        Format of the stamps in the notation of `datetime.strptime`.
    timezone : str or None
        IANA name of the zone of stamps that state none; None takes them as UTC.
    time_column, quality_column : str or None
        Names of the columns of stamps and, in long tables, of quality codes as they stand in the header.
    good_quality : tuple of str or None
        Quality codes or texts that count as good, in place of the detected scheme.
    scratch : Path or None
        Directory for plain copies of packed files; None: this process's own, gone with it.
    """

    delimiter: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    day_first: bool | None = None
    date_format: str | None = None
    timezone: str | None = None
    good_quality: tuple[str, ...] | None = None
    time_column: str | None = None
    quality_column: str | None = None
    scratch: Path | None = None


class SourceTable(Protocol):
    """Columns by position; `read` touches no other column.

    `path` is the file, `names` and `types` are of its columns, `notes` what was found out about its format,
    `decimal` the mark in numbers that stand among texts, `first_row` the number of the first row of data as
    an editor counts them (None for binary files).
    """

    @property
    def path(self) -> Path: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def types(self) -> tuple[pa.DataType, ...]: ...
    @property
    def notes(self) -> tuple[str, ...]: ...
    @property
    def decimal(self) -> str: ...
    @property
    def first_row(self) -> int | None: ...

    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        """First rows of some columns, for detection."""

    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        """Whole columns, or only the rows where column `where[0]` holds one of `where[1]`."""


class Source(Protocol):
    """One file whose layout is understood; small, picklable, holds no samples."""

    @property
    def path(self) -> Path: ...
    @property
    def tags(self) -> tuple[str, ...]: ...
    @property
    def notes(self) -> tuple[str, ...]: ...
    @property
    def clock(self) -> Clock: ...

    def with_clock(self, clock: Clock) -> Source:
        """The same file, its stamps read in the order of day and month, and the winter time, of another clock."""

    def read(self, tags: Sequence[str]) -> dict[str, Raw]:
        """Samples of those of `tags` that the file holds."""

    def span(self) -> MainSpan:
        """Where the samples lie in time, stray ones apart [s since 1970-01-01 UTC]."""


def is_text(kind: pa.DataType) -> bool:
    """True for the types that hold text."""
    if pa.types.is_dictionary(kind):
        return is_text(kind.value_type)
    return str(kind) in ("string", "large_string", "string_view")


def is_number(kind: pa.DataType) -> bool:
    """True for whole and floating numbers."""
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind))


def as_text(column: pa.Array) -> pa.Array:
    """The column as plain strings."""
    return pc.cast(column, pa.string())


def one_array(column: pa.Array | pa.ChunkedArray) -> pa.Array:
    """A column in one piece."""
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    return pa.concat_arrays(array.chunks) if isinstance(array, pa.ChunkedArray) else array


def trimmed(column: pa.Array | pa.ChunkedArray, unquoted: bool) -> pa.Array:
    """A column of delimited text in one piece; texts trimmed, of quotes too where those were taken as they stand."""
    array = one_array(column)
    if not pa.types.is_string(array.type):
        return array
    return pc.utf8_trim(array, ' \t"') if unquoted else pc.utf8_trim_whitespace(array)
