"""Long tables: a row for each sample, with the tag in a column of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.clock import Clock, as_text
from analyzer.history.codes import Scheme, mostly_one, not_good, scheme_of
from analyzer.history.converted import Converted
from analyzer.history.names import QUALITY_NAMES, STAMP_NAMES, TAG_NAMES, VALUE_NAMES, first_named, plain
from analyzer.history.options import ReadOptions
from analyzer.history.raw import Raw
from analyzer.history.stray import MainSpan, NoStampError, main_span
from analyzer.history.table import Table
from analyzer.history.time_columns import check_seconds, find_clock
from analyzer.history.values import values
from identification.errors import InputError


@dataclass(frozen=True, slots=True)
class LongSource:
    """A long table; see `table.Source`. `tag`, `value` and `quality` are positions of columns (-1: none)."""

    table: Table
    clock: Clock
    tags: tuple[str, ...]
    tag: int
    value: int
    quality: int = -1
    scheme: Scheme = Scheme.TEXT
    good_quality: tuple[str, ...] | None = None

    @property
    def path(self) -> Path:
        """The file."""
        return self.table.path

    @property
    def notes(self) -> tuple[str, ...]:
        """Format and layout of the file."""
        layout = f"long table, {len(self.tags)} tags in column '{self.table.names[self.tag]}'"
        if self.quality < 0:
            return (*self.table.notes, layout, *self.clock.notes)
        quality = f"column '{self.table.names[self.quality]}' read as {self.scheme.value}"
        return (*self.table.notes, layout, quality, *self.clock.notes)

    def with_clock(self, clock: Clock) -> Self:
        """The same file, its stamps read by another clock."""
        return replace(self, clock=clock)

    def read(self, tags: Sequence[str]) -> dict[str, Raw]:
        """Samples of those of `tags` that the file holds."""
        present = set(self.tags)
        wanted = [tag for tag in tags if tag in present]
        if not wanted:
            return {}
        columns = [*self.clock.columns, self.tag, self.value, *([self.quality] if self.quality >= 0 else [])]
        arrays = self.table.read(columns, where=(self.tag, wanted))
        times, (tag, *data) = arrays[: len(self.clock.columns)], arrays[len(self.clock.columns) :]
        second, local = self.clock.seconds(times)
        rows = _rows_of(tag, wanted)
        return {name: self._raw(second[rows[name]], local, _at(data, rows[name])) for name in wanted}

    def span(self) -> MainSpan:
        """Where the samples lie in time, stray ones apart [s since 1970-01-01 UTC]."""
        spans = [
            main_span(stamp_s)
            for arrays in pieces(self.table, self.clock.columns)
            if np.isfinite(stamp_s := self.clock.utc(*self.clock.seconds(arrays))[0]).any()
        ]
        if not spans:
            raise NoStampError
        first, last = min(s.first_s for s in spans), max(s.last_s for s in spans)
        return MainSpan(first, last, sum(s.stray for s in spans))

    def _raw(self, second: NDArray[np.float64], local: bool, data: list[pa.Array]) -> Raw:
        stamp_s, found = self.clock.utc(second, local)
        read = values(data[0], self.table.decimal)
        bad = read.bad
        if len(data) > 1:
            rejected, counts = not_good(data[1], self.scheme, self.good_quality)
            bad, found = bad | rejected, found + counts
        return Raw(stamp_s, read.value, bad, read.text, found + read.found, read.unread, read.example)


def pieces(table: Table, columns: Sequence[int]) -> Iterator[list[pa.Array]]:
    """Whole columns, in one piece or, of a table that lies in several files, file by file."""
    if isinstance(table, Converted):
        yield from table.each(columns)
    else:
        yield table.read(columns)


def _kinds(table: Table, column: int) -> pa.Array:
    """The distinct cells of a column."""
    found = [pc.unique(arrays[0]) for arrays in pieces(table, [column])]
    return pc.unique(pa.concat_arrays(found))


def tag_column(table: Table) -> int:
    """The column of tags of a long table, -1 of any other."""
    tag = first_named(table.names, TAG_NAMES)
    return -1 if tag is None or _value_column(table) is None else tag


def open_long(table: Table, options: ReadOptions) -> LongSource | None:
    """Take a table as long where it has columns for tag and value; else None."""
    tag = first_named(table.names, TAG_NAMES)
    value = None if tag is None else _value_column(table)
    if tag is None or value is None:
        return None
    clock = find_clock(table, options)
    check_seconds(table, clock, tag)
    met = table.tags if isinstance(table, Converted) else _kinds(table, tag).to_pylist()
    tags = tuple(str(name) for name in met if name not in (None, ""))
    quality = _quality_column(table, options)
    if quality is None:
        return LongSource(table, clock, tags, tag, value)
    scheme = scheme_of(table.names[quality], _kinds(table, quality), mostly_one(table.head([quality])))
    return LongSource(table, clock, tags, tag, value, quality, scheme, options.good_quality)


def _quality_column(table: Table, options: ReadOptions) -> int | None:
    """The column of quality codes: the stated one, else by its name.

    Raises
    ------
    InputError
        There is no column of the stated name.
    """
    if options.quality_column is None:
        return first_named(table.names, QUALITY_NAMES)
    if options.quality_column not in table.names:
        raise InputError(
            f"{table.path}: no column '{options.quality_column}' among {', '.join(table.names[:8])}",
            "the name of the quality column as it stands in the header",
            "correct --quality-column",
        )
    return table.names.index(options.quality_column)


def _value_column(table: Table) -> int | None:
    """The column that is named so, else the only one of numbers that is neither time nor quality."""
    named = first_named(table.names, VALUE_NAMES)
    if named is not None:
        return named
    floating = [i for i, kind in enumerate(table.types) if pa.types.is_floating(kind)]
    taken = {*STAMP_NAMES, *QUALITY_NAMES} - {
        "data"
    }  # a date in Italian, but numbers of that name are values
    free = [i for i in floating if plain(table.names[i]) not in taken]
    return free[0] if len(free) == 1 else None


def _rows_of(tag: pa.Array, wanted: Sequence[str]) -> dict[str, NDArray[np.int64]]:
    """Rows of each tag, in the order of the file."""
    place = pc.index_in(as_text(tag), value_set=pa.array(wanted, pa.string())).to_numpy(zero_copy_only=False)
    order = np.argsort(place, kind="stable")
    bounds = np.searchsorted(place[order], np.arange(len(wanted) + 1))
    return {name: order[bounds[i] : bounds[i + 1]] for i, name in enumerate(wanted)}


def _at(arrays: Sequence[pa.Array], rows: NDArray[np.int64]) -> list[pa.Array]:
    return [array.take(pa.array(rows)) for array in arrays]
