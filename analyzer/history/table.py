"""A file of named columns in any format, the column names of historians, and options that a user may state."""

from __future__ import annotations

import re
import tomllib
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.files import own_scratch
from identification.errors import InputError

NAME_LENGTH = 200
"""Characters of a name that are read. No tag has more, and the time of a pattern grows with the square of
the length."""

HEAD_ROWS = 1000
"""Rows from which a table's format is detected."""
WORDS: dict[str, Any] = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
INTERVAL = re.compile(r"^\s*(?P<number>\d+(?:[.,]\d+)?)\s*(?P<unit>[A-Za-zµμ]*)\s*$")
UNITS_S = {unit: scale["unit_s"] for unit, scale in WORDS["since_start"].items()}
"""Units of time [s]."""
COLUMNS: dict[str, tuple[str, ...]] = {kind: tuple(names) for kind, names in WORDS["columns"].items()}


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """Format of exports; None means: detect from the file.

    Parameters
    ----------
    delimiter, decimal, encoding : str or None
        Of delimited text: the separator of columns, the decimal mark, the character encoding.
    day_first : bool or None
        True where 03/04/2024 is the third of April.
    date_format : str or None
        Format of the stamps in the notation of `datetime.strptime`.
    timezone : str or None
        IANA name of the zone of stamps that state none; None: UTC.
    interval : str or None
        Time between rows, such as 30s or 5 min, of a table whose stamps do not advance.
    time_column, quality_column : str or None
        Names of the columns of stamps and, in long tables, of quality codes as in the header.
    good_quality : tuple of str or None
        Quality codes or texts that count as good, instead of the detected scheme.
    stated : frozenset of str
        Tags stated in loops.csv: columns of these names contain neither stamps nor quality codes.
    scratch : Path or None
        Directory for plain copies of packed files; None: a temporary one of this process.
    """

    delimiter: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    day_first: bool | None = None
    date_format: str | None = None
    timezone: str | None = None
    good_quality: tuple[str, ...] | None = None
    interval: str | None = None
    time_column: str | None = None
    quality_column: str | None = None
    stated: frozenset[str] = frozenset()
    scratch: Path | None = None

    @property
    def interval_s(self) -> float:
        """The stated time between rows [s], 0 if none is stated. Raises InputError for an invalid one."""
        if self.interval is None:
            return 0.0
        found = INTERVAL.match(self.interval)
        unit = {"": "s", "m": "min"}.get(found["unit"].lower(), found["unit"].lower()) if found else ""
        each = [float(s) for name, s in UNITS_S.items() if re.fullmatch(any_of(name), unit)]
        number = float(found["number"].replace(",", ".")) if found else 0.0
        if not each or not 0.0 < number * each[0] < 1e6:
            raise InputError(
                f"--interval {self.interval!r}", "a time such as 30s, 5min or 500ms", "correct it"
            )
        return number * each[0]

    @property
    def place(self) -> Path:
        """Folder for copies."""
        return self.scratch or own_scratch()


@dataclass(frozen=True, slots=True)
class Table(ABC):
    """Columns of a file by position; `read` touches no other column.

    `path` is the file, `names` and `types` are of its columns, `found` are notes on its format, `decimal` the mark in
    numbers among texts, `first_row` the number of the first row of data as an editor counts them (None for binary
    files), `tags` the tags of a long table in order of first occurrence, if known. `found` does not distinguish two
    tables of one file, so that a cached read serves both; and its `repr` describes the format of a file, not its
    place or date.
    """

    path: Path = field(repr=False)
    names: tuple[str, ...]
    types: tuple[pa.DataType, ...] = field(default=(), compare=False)
    found: tuple[str, ...] = field(default=(), compare=False)
    decimal: str = "."
    first_row: int | None = None
    tags: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the format."""
        return self.found

    @abstractmethod
    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        """First rows of some columns, for detection."""

    @abstractmethod
    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        """Whole columns, or only the rows where column `where[0]` contains one of `where[1]`."""

    def each(self, columns: Sequence[int]) -> Iterator[list[pa.Array]]:
        """Whole columns, piece by piece if the table is in several files."""
        yield self.read(columns)


def any_of(kind: str) -> str:
    """A pattern of all words of a kind in column names, without an enclosing group."""
    return "|".join(WORDS["in_names"][kind])


def plain(name: str) -> str:
    """Name without case, units in brackets, blanks and underscores: ' Time_Stamp (UTC)' is 'timestamp'."""
    return re.sub(r"\([^()]*\)|\[[^\[\]]*\]|[\s_\-\"']", "", name[:NAME_LENGTH]).lower()


def first_named(names: Sequence[str], wanted: Iterable[str]) -> int | None:
    """Index of the column whose plain name is the first match in `wanted`, or None."""
    plains = [plain(name) for name in names]
    return next((plains.index(name) for name in wanted if name in plains), None)


def stated_column(path: Path, names: Sequence[str], stated: str, kind: str) -> int:
    """Index of the column that the user states as that of a kind, time or quality.

    Raises
    ------
    InputError
        There is no column of that name.
    """
    if stated not in names:
        seen = f"{path}: no column '{stated}' among {', '.join(names[:8])}"
        expected = f"the name of the {kind} column as written in the header"
        raise InputError(seen, expected, f"correct --{kind}-column")
    return names.index(stated)


def check_once(path: Path, names: Sequence[str]) -> None:
    """Raise InputError for duplicate column names, because their tag is ambiguous."""
    name, count = max(Counter(names).items(), key=lambda item: item[1], default=("", 1))
    if count > 1:
        raise InputError(f"{path}: column '{name}' occurs twice", "each tag once", "rename or remove one")


def is_text(kind: pa.DataType) -> bool:
    """True for types of text."""
    if pa.types.is_dictionary(kind):
        return is_text(kind.value_type)
    return str(kind) in ("string", "large_string", "string_view")


def is_number(kind: pa.DataType) -> bool:
    """True for whole and floating numbers."""
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind))


def as_text(column: pa.Array) -> pa.Array:
    """The column as plain strings."""
    return pc.cast(column, pa.string())


def numbers(column: pa.Array) -> NDArray[np.float64]:
    """A column as numbers, shape (n,), NaN where it is empty."""
    return np.asarray(pc.cast(column, pa.float64(), safe=False).to_numpy(zero_copy_only=False))


def distinct(column: pa.Array) -> tuple[pa.Array, NDArray[np.int64], NDArray[np.int64]]:
    """The distinct cells of a column, an empty one last; the index of each cell among them; and their counts."""
    encoded = column if pa.types.is_dictionary(column.type) else pc.dictionary_encode(column)
    kinds = pa.concat_arrays([encoded.dictionary, pa.nulls(1, encoded.dictionary.type)])
    place = pc.fill_null(encoded.indices, len(kinds) - 1).to_numpy(zero_copy_only=False)
    return kinds, place, np.bincount(place, minlength=len(kinds))


def one_array(column: pa.Array | pa.ChunkedArray) -> pa.Array:
    """A column in one piece."""
    return column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column


def trimmed(column: pa.Array | pa.ChunkedArray, unquoted: bool) -> pa.Array:
    """A column of delimited text in one piece, trimmed, also of quotes if these have no special meaning."""
    array = one_array(column)
    if not pa.types.is_string(array.type):
        return array
    return pc.utf8_trim(array, ' \t"') if unquoted else pc.utf8_trim_whitespace(array)
