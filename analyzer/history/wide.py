"""Wide tables: a time column and a column for each tag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from analyzer.history.clock import Clock, is_text
from analyzer.history.codes import Scheme, mostly_one, not_good, scheme_of
from analyzer.history.names import REMARKS, check_once, plain, with_loop
from analyzer.history.options import ReadOptions
from analyzer.history.quality_columns import quality_columns
from analyzer.history.raw import Raw
from analyzer.history.stray import MainSpan, main_span
from analyzer.history.table import Table
from analyzer.history.time_columns import check_seconds, find_clock
from analyzer.history.values import values
from identification.errors import InputError


@dataclass(frozen=True, slots=True)
class WideSource:
    """A wide table; see `table.Source`. `columns` and `quality` are columns of each tag, -1 for none;
    `said` what of the layout is worth a warning, `ones` whether most codes of quality are 1 and not 0."""

    table: Table
    clock: Clock
    tags: tuple[str, ...]
    columns: tuple[int, ...]
    quality: tuple[int, ...]
    good_quality: tuple[str, ...] | None = None
    said: tuple[str, ...] = ()
    ones: bool = False

    @property
    def path(self) -> Path:
        """The file."""
        return self.table.path

    @property
    def notes(self) -> tuple[str, ...]:
        """Format and layout of the file."""
        used = sorted({self.table.names[i] for i in self.quality if i >= 0})
        more = f" and {len(used) - 1} more" if len(used) > 1 else ""
        quality = [f"quality in column '{used[0]}'{more}"] if used else []
        layout = f"wide table, {len(self.tags)} tags"
        return (*self.table.notes, layout, *quality, *self.said, *self.clock.notes)

    def with_clock(self, clock: Clock) -> Self:
        """The same file, its stamps read by another clock."""
        return replace(self, clock=clock)

    def read(self, tags: Sequence[str]) -> dict[str, Raw]:
        """Samples of those of `tags` that the file holds."""
        place = {tag: i for i, tag in enumerate(self.tags)}
        wanted = [place[tag] for tag in tags if tag in place]
        if not wanted:
            return {}
        columns = [*self.clock.columns, *(self.columns[i] for i in wanted)]
        columns += sorted({self.quality[i] for i in wanted if self.quality[i] >= 0})
        arrays = dict(zip(columns, self.table.read(columns), strict=True))
        stamp_s, found = self.clock.utc(*self.clock.seconds([arrays[i] for i in self.clock.columns]))
        return {self.tags[i]: self._raw(i, arrays, stamp_s, found) for i in wanted}

    def span(self) -> MainSpan:
        """Where the samples lie in time, stray ones apart [s since 1970-01-01 UTC]."""
        return main_span(self.clock.utc(*self.clock.seconds(self.table.read(self.clock.columns)))[0])

    def _raw(
        self, i: int, arrays: dict[int, pa.Array], stamp_s: NDArray[np.float64], met: Counter[str]
    ) -> Raw:
        read = values(arrays[self.columns[i]], self.table.decimal)
        bad, found = read.bad, read.found + met
        if self.quality[i] >= 0:
            codes = arrays[self.quality[i]]
            rejected, counts = not_good(
                codes, scheme_of(self.table.names[self.quality[i]], codes, self.ones), self.good_quality
            )
            bad, found = bad | rejected, found + counts
        return Raw(stamp_s, read.value, bad, read.text, found, read.unread, read.example)


def open_wide(table: Table, options: ReadOptions) -> WideSource:
    """Take a table as wide.

    Raises
    ------
    InputError
        There is no time column, or no column of values beside it.
    """
    clock = find_clock(table, options)
    check_seconds(table, clock)
    free = [i for i in range(len(table.names)) if i not in clock.columns and _holds_values(table, i)]
    partner, said = quality_columns(table, free)
    columns = [i for i in free if i not in partner.values()]
    if not columns or not _any_number(table, columns):
        raise InputError(
            f"{table.path}: no values beside the time column '{table.names[clock.columns[0]]}'",
            "a column of values for each tag, named as the tag",
            "export the tags' values",
        )
    names = [table.names[i] for i in columns]
    check_once(table.path, names)
    quality = tuple(partner.get(i, -1) for i in columns)
    tags = with_loop(names, table.path.stem)
    ones = mostly_one(table.head(sorted({*partner.values()})))
    said += _read_as(table, quality, ones)
    return WideSource(table, clock, tags, tuple(columns), quality, options.good_quality, tuple(said), ones)


def _read_as(table: Table, quality: Sequence[int], ones: bool) -> list[str]:
    """A sentence on codes of quality of which another reading is possible."""
    columns = sorted({i for i in quality if i >= 0}) if ones else []
    schemes = {scheme_of(table.names[i], table.head([i])[0], ones) for i in columns}
    return [f"quality is read as {Scheme.ONE_GOOD.value}"] if Scheme.ONE_GOOD in schemes else []


def _any_number(table: Table, columns: Sequence[int]) -> bool:
    """Whether the first rows of any column hold a number, or nothing yet; a list of alarms holds none.

    Columns of a controller's modes are texts too: they are named for their loop.
    """
    if any(mark in table.names[i] for i in columns for mark in ".:/_"):
        return True
    heads = table.head(columns)
    texts = [h for h in heads if is_text(h.type) and h.null_count < len(h)]
    return len(texts) < len(heads) or any(np.isfinite(values(h, table.decimal).value).any() for h in texts)


def _holds_values(table: Table, i: int) -> bool:
    name, kind = table.names[i], table.types[i]
    unnamed = not name or name.startswith(("Unnamed:", "__index_level_")) or plain(name) in REMARKS
    number = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
    return not unnamed and (number or is_text(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind))
