"""The layouts of tables: wide (a column for each tag), pairs (a clock beside each tag's values) and long (a row for
each sample, with the tag in a column of its own)."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.clock import Clock
from analyzer.history.names import COLUMNS, LONGEST, check_once, first_named, plain, stated_column, with_loop
from analyzer.history.quality import Scheme, mostly_one, not_good, quality_columns, scheme_of
from analyzer.history.series import MainSpan, NoStampError, Series, main_span
from analyzer.history.table import ReadOptions, Table, as_text, is_number, is_text
from analyzer.history.time_columns import check_seconds, find_clock, holds_stamps, stamps_clock
from analyzer.history.values import parsed, values
from identification.errors import InputError

TIME_WORDS = re.compile(
    r"[ ._:/-]*\(?(?:time ?stamp|date ?time|time|date|zeitstempel|zeit|ts)\)?(?:[ ._]\d+)?$", re.IGNORECASE
)
TIME_FIRST = re.compile(
    r"^(?:time ?stamp|date ?time|time|zeitstempel|zeit|aika|heure|czas|tijd)[ ._:/-]+", re.IGNORECASE
)
VALUE_WORDS = re.compile(r"(?:^|[ ._:/-])\(?(?:value|val|wert)\)?(?:[ ._]\d+)?$", re.IGNORECASE)
NUMBERED = re.compile(r"[ ._]\d+$")
Stamps = tuple[NDArray[np.float64], Counter[str]]
"""Stamps of rows [s since 1970-01-01 UTC], and what was met in them."""


def source_of(table: Table, options: ReadOptions) -> Source:
    """The table by the first layout that knows it; a further one is a function that answers None for a table that is
    not its own. The last takes every table and says what is missing.

    Raises
    ------
    InputError
        There is no time column, or no column of values beside it.
    """
    return open_long(table, options) or open_pairs(table, options) or open_wide(table, options)


@dataclass(frozen=True, slots=True)
class Source(ABC):
    """One file whose layout is understood; small, picklable, holds no samples. `layout` says of what kind it is."""

    table: Table
    clock: Clock
    tags: tuple[str, ...]
    good_quality: tuple[str, ...] | None
    layout: tuple[str, ...]

    @property
    def path(self) -> Path:
        """The file."""
        return self.table.path

    @property
    def notes(self) -> tuple[str, ...]:
        """Format and layout of the file."""
        return (*self.table.notes, *self.layout, *self.clock.notes)

    def with_clock(self, clock: Clock) -> Self:
        """The same file, its stamps read in the order of day and month, and the winter time, of another clock."""
        return replace(self, clock=clock)

    @abstractmethod
    def read(self, tags: Sequence[str]) -> dict[str, Series]:
        """Samples of those of `tags` that the file holds."""

    @abstractmethod
    def span(self) -> MainSpan:
        """Where the samples lie in time, stray ones apart [s since 1970-01-01 UTC]."""

    def _series(
        self, stamps: Stamps, value: pa.Array, codes: pa.Array | None, scheme: Scheme | None
    ) -> Series:
        """One tag's samples from its columns of values and of quality codes."""
        stamp_s, met = stamps
        read = values(stamp_s, value, self.table.decimal)
        bad, found = read.bad, read.found + met
        if codes is not None and scheme is not None:
            rejected, counts = not_good(codes, scheme, self.good_quality)
            bad, found = bad | rejected, found + counts
        return replace(read, bad=bad, found=found)


@dataclass(frozen=True, slots=True)
class TagColumn:
    """One tag of a table with a column for each: its clock, and its columns of values and of quality codes (-1:
    none)."""

    clock: Clock
    value: int
    quality: int = -1


@dataclass(frozen=True, slots=True)
class WideSource(Source):
    """A table with a column for each tag; `ones` says whether most codes of quality are 1 and not 0 (None: found out
    of each column), `paired` whether rows without a stamp lie below a tag's last one."""

    columns: tuple[TagColumn, ...]
    ones: bool | None = None
    paired: bool = False

    def with_clock(self, clock: Clock) -> Self:
        """The same file, all its stamps read in the order of day and month, and the winter time, of another clock."""
        columns = tuple(
            replace(c, clock=replace(c.clock, order=clock.order, winter_s=clock.winter_s))
            for c in self.columns
        )
        return replace(self, clock=columns[0].clock, columns=columns)

    def read(self, tags: Sequence[str]) -> dict[str, Series]:
        asked = set(tags)
        wanted = {tag: c for tag, c in zip(self.tags, self.columns, strict=True) if tag in asked}
        if not wanted:
            return {}
        needed = {i for c in wanted.values() for i in (*c.clock.columns, c.value, c.quality) if i >= 0}
        arrays = self._arrays(needed)
        timed = {clock: self._timed(clock, arrays) for clock in {c.clock for c in wanted.values()}}
        return {tag: self._samples(c, arrays, *timed[c.clock]) for tag, c in wanted.items()}

    def span(self) -> MainSpan:
        clocks = dict.fromkeys(c.clock for c in self.columns)
        arrays = self._arrays({i for clock in clocks for i in clock.columns})
        stamps = [c.utc(*c.seconds([arrays[i] for i in c.columns]))[0] for c in clocks]
        return main_span(np.concatenate(stamps))

    def _arrays(self, columns: Collection[int]) -> dict[int, pa.Array]:
        """Whole columns by their positions."""
        return dict(zip(sorted(columns), self.table.read(sorted(columns)), strict=True))

    def _timed(self, clock: Clock, arrays: dict[int, pa.Array]) -> tuple[Stamps, pa.Array | None]:
        """Stamps of one clock's rows, and which rows of the table these are; None where all are."""
        times = [arrays[i] for i in clock.columns]
        if not self.paired:
            return clock.utc(*clock.seconds(times)), None
        filled = pc.is_valid(times[0])
        if pa.types.is_string(times[0].type):
            filled = pc.and_(filled, pc.fill_null(pc.not_equal(times[0], ""), False))
        return clock.utc(*clock.seconds([a.filter(filled) for a in times])), filled

    def _samples(
        self, column: TagColumn, arrays: dict[int, pa.Array], stamps: Stamps, rows: pa.Array | None
    ) -> Series:
        value, codes = (None if i < 0 else arrays[i] for i in (column.value, column.quality))
        if rows is not None:
            value, codes = (None if a is None else a.filter(rows) for a in (value, codes))
        scheme = None if codes is None else scheme_of(self.table.names[column.quality], codes, self.ones)
        return self._series(stamps, value, codes, scheme)


def open_wide(table: Table, options: ReadOptions) -> WideSource:
    """Take a table as wide: one time column, and a column for each tag."""
    clock = find_clock(table, options)
    check_seconds(table, clock)
    free = [i for i in range(len(table.names)) if i not in clock.columns and _holds_values(table, i)]
    partner, said = quality_columns(table, free)
    values_in = [i for i in free if i not in partner.values()]
    if not values_in or not _any_number(table, values_in):
        raise InputError(
            f"{table.path}: no values beside the time column '{table.names[clock.columns[0]]}'",
            "a column of values for each tag, named as the tag",
            "export the tags' values",
        )
    names = [table.names[i] for i in values_in]
    check_once(table.path, names)
    tags = with_loop(names, table.path.stem)
    coded = sorted({*partner.values()})
    ones = mostly_one(table.head(coded))
    columns = tuple(TagColumn(clock, i, partner.get(i, -1)) for i in values_in)
    layout = (f"wide table, {len(tags)} tags", *_quality_notes(table, columns, ones, said))
    return WideSource(table, clock, tags, options.good_quality, layout, columns, ones)


def _quality_notes(table: Table, columns: Sequence[TagColumn], ones: bool, said: Sequence[str]) -> list[str]:
    """Which columns of codes a wide table has, and codes of which another reading is possible."""
    coded = {table.names[c.quality]: c.quality for c in columns if c.quality >= 0}
    used = sorted(coded)
    more = f" and {len(used) - 1} more" if len(used) > 1 else ""
    notes = [f"quality in column '{used[0]}'{more}"] if used else []
    positions = {c.quality for c in columns if c.quality >= 0} if ones else set()
    schemes = {scheme_of(table.names[i], table.head([i])[0], ones) for i in positions}
    read_as = [f"quality is read as {Scheme.ONE_GOOD.value}"] if Scheme.ONE_GOOD in schemes else []
    return [*notes, *said, *read_as]


def _any_number(table: Table, columns: Sequence[int]) -> bool:
    """Whether the first rows of any column hold a number, or nothing yet; a list of alarms holds none.

    Columns of a controller's modes are texts too: they are named for their loop.
    """
    if any(mark in table.names[i] for i in columns for mark in ".:/_"):
        return True
    heads = table.head(columns)
    texts = [h for h in heads if is_text(h.type) and h.null_count < len(h)]
    read = (parsed([str(text).strip() for text in h.unique().to_pylist()], table.decimal)[0] for h in texts)
    return len(texts) < len(heads) or any(np.isfinite(number).any() for number in read)


def _holds_values(table: Table, i: int) -> bool:
    name, kind = table.names[i], table.types[i]
    if not name or name.startswith(("Unnamed:", "__index_level_")) or plain(name) in COLUMNS["remark"]:
        return False
    others = pa.types.is_decimal(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind)
    return bool(is_number(kind) or is_text(kind) or others)


def open_pairs(table: Table, options: ReadOptions) -> WideSource | None:
    """Take a table as pairs where two or more columns hold stamps, each with values behind it; else None."""
    if options.time_column is not None or options.date_format is not None:
        return None
    groups = _groups(table)
    if len(groups) < 2:
        return None
    found = [(_tag(table, c), c) for time, beside in groups for c in _paired(table, time, beside, options)]
    tags = tuple(tag for tag, _ in found)
    if len(tags) < 2 or not all(tags):
        return None
    check_once(table.path, tags)
    columns = tuple(column for _, column in found)
    clocks = len({c.clock.columns for c in columns})
    layout = f"pairs of columns, {len(tags)} tags with {clocks} clocks of their own"
    return WideSource(table, columns[0].clock, tags, options.good_quality, (layout,), columns, paired=True)


def _groups(table: Table) -> list[tuple[int, list[int]]]:
    """Each column of stamps with the columns behind it up to the next; none where a column has nothing behind it."""
    likely = [
        i
        for i, kind in enumerate(table.types)
        if is_text(kind) or pa.types.is_temporal(kind) or _time_name(table, i)
    ]
    if len(likely) < 2:
        return []
    heads = dict(zip(likely, table.head(likely), strict=True))
    times = [i for i in likely if holds_stamps(_time_name(table, i), heads[i], _is_time(table.names[i]))]
    if len(times) < 2 or times[0] != 0:
        return []
    groups = [
        (time, [i for i in range(time + 1, end) if not pa.types.is_null(table.types[i])])
        for time, end in zip(times, [*times[1:], len(table.names)], strict=True)
    ]
    return groups if all(beside for _, beside in groups) else []


def _is_time(name: str) -> bool:
    """Whether a column's own name is that of stamps."""
    bare = NUMBERED.sub("", name[:LONGEST])
    return plain(bare) in COLUMNS["stamp"] or any((TIME_WORDS.search(bare), TIME_FIRST.match(bare)))


def _time_name(table: Table, i: int) -> str:
    """A name under which numbers of a column may count as stamps: its own, or 'time' before a column without one."""
    name = NUMBERED.sub("", table.names[i][:LONGEST])
    unnamed = i + 1 < len(table.names) and table.names[i + 1] == "" and name != ""
    return "time" if unnamed or _is_time(table.names[i]) else ""


def _paired(table: Table, time: int, beside: Sequence[int], options: ReadOptions) -> list[TagColumn]:
    """The tags that share one clock: those behind it that hold values, with their quality."""
    quality = [i for i in beside if plain(NUMBERED.sub("", table.names[i])) in COLUMNS["quality"]]
    held = [i for i in beside if i not in quality]
    clock = stamps_clock(table, time, options)
    single = quality[0] if len(quality) == 1 and len(held) == 1 else -1
    return [TagColumn(clock, i, single) for i in held]


def _tag(table: Table, column: TagColumn) -> str:
    """The tag's name: above its values, or where that says nothing above its stamps."""
    own, other = table.names[column.value], table.names[column.clock.columns[0]]
    if plain(NUMBERED.sub("", own)) in COLUMNS["value"] or own == "":
        return TIME_WORDS.sub("", other[:LONGEST]) or other
    return VALUE_WORDS.sub("", own[:LONGEST]) or own


@dataclass(frozen=True, slots=True)
class LongSource(Source):
    """A long table; `tag`, `value` and `quality` are positions of columns (-1: none)."""

    tag: int
    value: int
    quality: int = -1
    scheme: Scheme | None = None

    def read(self, tags: Sequence[str]) -> dict[str, Series]:
        present = set(self.tags)
        wanted = [tag for tag in tags if tag in present]
        if not wanted:
            return {}
        columns = [*self.clock.columns, self.tag, self.value, *([self.quality] if self.quality >= 0 else [])]
        arrays = self.table.read(columns, where=(self.tag, wanted))
        times, (tag, *data) = arrays[: len(self.clock.columns)], arrays[len(self.clock.columns) :]
        second, local = self.clock.seconds(times)
        rows = _rows_of(tag, wanted)
        return {name: self._samples(second, local, data, rows[name]) for name in wanted}

    def span(self) -> MainSpan:
        spans = [
            main_span(stamp_s)
            for arrays in self.table.each(self.clock.columns)
            if np.isfinite(stamp_s := self.clock.utc(*self.clock.seconds(arrays))[0]).any()
        ]
        if not spans:
            raise NoStampError
        first, last = min(s.first_s for s in spans), max(s.last_s for s in spans)
        return MainSpan(first, last, sum(s.stray for s in spans))

    def _samples(
        self, second: NDArray[np.float64], local: bool, data: list[pa.Array], rows: NDArray[np.int64]
    ) -> Series:
        value, codes = (*(a.take(pa.array(rows)) for a in data), None)[:2]
        return self._series(self.clock.utc(second[rows], local), value, codes, self.scheme)


def tag_column(table: Table) -> int:
    """The column of tags of a long table, -1 of any other."""
    tag = first_named(table.names, COLUMNS["tag"])
    return -1 if tag is None or _value_column(table) is None else tag


def open_long(table: Table, options: ReadOptions) -> LongSource | None:
    """Take a table as long where it has columns for tag and value; else None."""
    tag, value = tag_column(table), _value_column(table)
    if tag < 0 or value is None:
        return None
    clock = find_clock(table, options)
    check_seconds(table, clock, tag)
    met = table.tags or _kinds(table, tag).to_pylist()
    tags = tuple(str(name) for name in met if name not in (None, ""))
    stated = options.quality_column
    quality = (
        first_named(table.names, COLUMNS["quality"])
        if stated is None
        else stated_column(table.path, table.names, stated, "quality")
    )
    said = f"long table, {len(tags)} tags in column '{table.names[tag]}'"
    source = LongSource(table, clock, tags, options.good_quality, (said,), tag, value)
    if quality is None:
        return source
    scheme = scheme_of(table.names[quality], _kinds(table, quality), mostly_one(table.head([quality])))
    codes = f"column '{table.names[quality]}' read as {scheme.value}"
    return replace(source, layout=(said, codes), quality=quality, scheme=scheme)


def _kinds(table: Table, column: int) -> pa.Array:
    """The distinct cells of a column."""
    return pc.unique(pa.concat_arrays([pc.unique(arrays[0]) for arrays in table.each([column])]))


def _value_column(table: Table) -> int | None:
    """The column that is named so, else the only one of numbers that is neither time nor quality."""
    named = first_named(table.names, COLUMNS["value"])
    if named is not None:
        return named
    floating = [i for i, kind in enumerate(table.types) if pa.types.is_floating(kind)]
    taken = {*COLUMNS["stamp"], *COLUMNS["quality"]} - {"data"}  # a date in Italian, but of numbers a value
    free = [i for i in floating if plain(table.names[i]) not in taken]
    return free[0] if len(free) == 1 else None


def _rows_of(tag: pa.Array, wanted: Sequence[str]) -> dict[str, NDArray[np.int64]]:
    """Rows of each tag, in the order of the file."""
    place = pc.index_in(as_text(tag), value_set=pa.array(wanted, pa.string())).to_numpy(zero_copy_only=False)
    order = np.argsort(place, kind="stable")
    bounds = np.searchsorted(place[order], np.arange(len(wanted) + 1))
    return {name: order[bounds[i] : bounds[i + 1]] for i, name in enumerate(wanted)}
