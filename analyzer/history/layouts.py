"""Layouts of tables: wide (one column per tag), pairs (a clock column for each tag's values) and long (one row per
sample, with the tag in a separate column)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.clock import Clock
from analyzer.history.quality import Scheme, not_good, ones_prevail, quality_columns, scheme_of
from analyzer.history.series import MainSpan, NoStampError, Series, main_span
from analyzer.history.table import (
    COLUMNS,
    NAME_LENGTH,
    ReadOptions,
    Table,
    any_of,
    as_text,
    check_once,
    first_named,
    is_number,
    is_text,
    plain,
    stated_column,
)
from analyzer.history.time_columns import find_clock, holds_stamps, stamps_clock
from analyzer.history.values import parsed, values
from identification.errors import InputError

TIME_WORDS = re.compile(rf"[ ._:/-]*\(?(?:{any_of('time')})\)?(?:[ ._]\d+)?$", re.IGNORECASE)
TIME_FIRST = re.compile(rf"^(?:{any_of('time_first')})[ ._:/-]+", re.IGNORECASE)
VALUE_WORDS = re.compile(rf"(?:^|[ ._:/-])\(?(?:{any_of('value')})\)?(?:[ ._]\d+)?$", re.IGNORECASE)
NUMBERED = re.compile(r"[ ._]\d+$")
Stamps = tuple[NDArray[np.float64], Counter[str]]
"""Stamps of rows [s since 1970-01-01 UTC], and the problems found in them."""
Rows = NDArray[np.int64] | None
"""Rows of a table, None for all of them."""


def source_of(table: Table, options: ReadOptions) -> Source:
    """The table in the first layout that applies; a new layout is a function that returns None for other tables. The
    last one accepts every table and reports what is missing.

    Raises
    ------
    InputError
        There is no time column, or no other column of values.
    """
    return open_long(table, options) or open_pairs(table, options) or open_wide(table, options)


@dataclass(frozen=True, slots=True)
class TagColumn:
    """A tag's clock, and its columns of values and of quality codes (-1: none)."""

    clock: Clock
    value: int
    quality: int = -1


@dataclass(frozen=True, slots=True)
class Source:
    """One file with a known layout; small, picklable, without samples.

    Parameters
    ----------
    table : Table
    tags : tuple of str
    columns : tuple of TagColumn
        One per tag; for a long table one for all.
    good_quality : tuple of str or None
        As in `ReadOptions`.
    layout : tuple of str
        Its layout, in words.
    tag : int
        Column of the tags of a long table, otherwise -1.
    scheme : Scheme or None
        Of all quality codes; None: determined from each column.
    ones : bool or None
        Whether most codes are 1 and not 0; None: determined from each column.
    paired : bool
        Whether rows without a stamp follow a tag's last one.
    """

    table: Table
    tags: tuple[str, ...]
    columns: tuple[TagColumn, ...]
    good_quality: tuple[str, ...] | None
    layout: tuple[str, ...]
    tag: int = -1
    scheme: Scheme | None = None
    ones: bool | None = None
    paired: bool = False

    @property
    def path(self) -> Path:
        """The file."""
        return self.table.path

    @property
    def clock(self) -> Clock:
        """The clock of its first tag."""
        return self.columns[0].clock

    @property
    def notes(self) -> tuple[str, ...]:
        """Format and layout of the file."""
        return (*self.table.notes, *self.layout, *self.clock.notes)

    def with_clock(self, **known: Any) -> Source:
        """The same file with clock properties known from other files, by the fields of `Clock`."""
        columns = (replace(c, clock=replace(c.clock, **known)) for c in self.columns)
        return replace(self, columns=tuple(columns))

    def read(self, tags: Sequence[str]) -> dict[str, Series]:
        """Samples of those of `tags` that are in the file."""
        requested, long = set(tags), self.tag >= 0
        wanted = {tag: self.columns[0 if long else k] for k, tag in enumerate(self.tags) if tag in requested}
        if not wanted:
            return {}
        clocks = {c.clock for c in wanted.values()}
        columns = {c.value for c in wanted.values()} | {c.quality for c in wanted.values()} | {self.tag}
        needed = sorted((columns | {i for clock in clocks for i in clock.columns}) - {-1})
        where = (self.tag, list(wanted)) if long else None
        arrays = dict(zip(needed, self.table.read(needed, where), strict=True))
        if not long:
            timed = {clock: self._timed(clock, arrays) for clock in clocks}
            return {tag: self._samples(c, arrays, *timed[c.clock]) for tag, c in wanted.items()}
        second, local = self.clock.seconds([arrays[i] for i in self.clock.columns])
        rows = _rows_of(arrays[self.tag], list(wanted))
        return {
            tag: self._samples(c, arrays, self.clock.utc(second[self._stamped(rows[tag])], local), rows[tag])
            for tag, c in wanted.items()
        }

    def _stamped(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """The rows with the stamps of a tag in a long table: its own, or the first ones if none advances."""
        return np.arange(len(rows)) if self.clock.every_s else rows

    def span(self) -> MainSpan:
        """Time span of the samples without stray ones [s since 1970-01-01 UTC]."""
        clocks = dict.fromkeys(c.clock for c in self.columns)
        needed = sorted({i for clock in clocks for i in clock.columns})
        spans = []
        for arrays in self.table.each(needed):
            arrays_by_column = dict(zip(needed, arrays, strict=True))
            stamp_s = [c.utc(*c.seconds([arrays_by_column[i] for i in c.columns]))[0] for c in clocks]
            if self.tag >= 0 and self.clock.every_s:
                stamp_s = [s[: max(len(s) // len(self.tags), 1)] for s in stamp_s]
            if np.isfinite(joined := np.concatenate(stamp_s)).any():
                spans.append(main_span(joined))
        if not spans:
            raise NoStampError
        first, last = min(s.first_s for s in spans), max(s.last_s for s in spans)
        return MainSpan(first, last, sum(s.stray for s in spans))

    def _timed(self, clock: Clock, arrays: dict[int, pa.Array]) -> tuple[Stamps, Rows]:
        """Stamps of one clock's rows, and the indices of these rows in the table."""
        times = [arrays[i] for i in clock.columns]
        if not self.paired:
            return clock.utc(*clock.seconds(times)), None
        filled = pc.is_valid(times[0])
        if pa.types.is_string(times[0].type):
            filled = pc.and_(filled, pc.fill_null(pc.not_equal(times[0], ""), False))
        rows = np.flatnonzero(filled)
        return clock.utc(*clock.seconds([_taken(a, rows) for a in times])), rows

    def _samples(self, column: TagColumn, arrays: dict[int, pa.Array], stamps: Stamps, rows: Rows) -> Series:
        """One tag's samples in some rows."""
        stamp_s, met = stamps
        read = values(stamp_s, _taken(arrays[column.value], rows), self.table.decimal)
        if column.quality < 0:
            return replace(read, found=read.found + met)
        codes = _taken(arrays[column.quality], rows)
        scheme = self.scheme or scheme_of(self.table.names[column.quality], codes, self.ones)
        rejected, counts = not_good(codes, scheme, self.good_quality)
        return replace(read, bad=read.bad | rejected, found=read.found + met + counts)


def _taken(column: pa.Array, rows: Rows) -> pa.Array:
    return column if rows is None else column.take(pa.array(rows))


def open_wide(table: Table, options: ReadOptions) -> Source:
    """Read a table as wide: one time column, and a column for each tag."""
    clock = find_clock(table, options)
    others = [i for i in range(len(table.names)) if i not in clock.columns and _holds_values(table, i)]
    free = [i for i in others if not _counts_rows(table, i)] or others
    partner, notes = quality_columns(table, free, options.stated)
    values_in = [i for i in free if i not in partner.values()]
    if not values_in or not _any_number(table, values_in):
        seen = f"{table.path}: no values next to the time column '{table.names[clock.columns[0]]}'"
        raise InputError(seen, "a column of values for each tag, named as the tag", "export the tags' values")
    names = [table.names[i] for i in values_in]
    check_once(table.path, names)
    tags = _with_loop(names, table.path.stem)
    ones = ones_prevail(table.head(sorted({*partner.values()})))
    columns = tuple(TagColumn(clock, i, partner.get(i, -1)) for i in values_in)
    layout = [f"wide table, {len(tags)} tags", *notes]
    if used := {table.names[c.quality]: c.quality for c in columns if c.quality >= 0}:
        more = f" and {len(used) - 1} more" if len(used) > 1 else ""
        layout.insert(1, f"quality in column '{min(used)}'{more}")
    if ones and Scheme.ONE_GOOD in {scheme_of(name, table.head([i])[0], ones) for name, i in used.items()}:
        layout.append(f"quality is read as {Scheme.ONE_GOOD.value}")
    return Source(table, tags, columns, options.good_quality, tuple(layout), ones=ones)


def _with_loop(names: Sequence[str], stem: str) -> tuple[str, ...]:
    """Full tags: bare columns such as 'PV' and 'OP' belong to the loop named by the file, and a single column of
    values to the tag named by the file."""
    if len(names) == 1 and plain(names[0]) in COLUMNS["value"]:
        return (stem,)
    if not names or not all(plain(name) in COLUMNS["bare_ending"] for name in names):
        return tuple(names)
    return tuple(f"{stem}.{plain(name).upper()}" for name in names)


def _any_number(table: Table, columns: Sequence[int]) -> bool:
    """Whether the first rows of any column have a number, or nothing yet; a list of alarms has none.

    Columns of controller modes are also texts: they are named after their loop.
    """
    if any(mark in table.names[i] for i in columns for mark in ".:/_"):
        return True
    heads = table.head(columns)
    texts = [h for h in heads if is_text(h.type) and h.null_count < len(h)]
    read = (parsed([str(text).strip() for text in h.unique().to_pylist()], table.decimal)[0] for h in texts)
    return len(texts) < len(heads) or any(np.isfinite(number).any() for number in read)


def _counts_rows(table: Table, i: int) -> bool:
    """Whether a column numbers the rows, up or down, and its name says so: an index is not a tag."""
    if plain(table.names[i]) not in COLUMNS["index"] or not pa.types.is_integer(table.types[i]):
        return False
    number = table.head([i])[0].drop_null().to_numpy(zero_copy_only=False)
    steps = np.unique(np.diff(number.astype(np.int64))).tolist()
    return steps in ([1], [-1])


def _holds_values(table: Table, i: int) -> bool:
    name, kind = table.names[i], table.types[i]
    if not name or name.startswith(("Unnamed:", "__index_level_")) or plain(name) in COLUMNS["remark"]:
        return False
    others = pa.types.is_decimal(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind)
    return bool(is_number(kind) or is_text(kind) or others)


def open_pairs(table: Table, options: ReadOptions) -> Source | None:
    """Read a table as pairs if two or more columns have stamps, each followed by values; else None."""
    if options.time_column is not None or options.date_format is not None:
        return None
    groups = _groups(table, options.stated)
    if len(groups) < 2:
        return None
    columns = tuple(c for time, following in groups for c in _paired(table, time, following, options))
    tags = tuple(_tag(table, c) for c in columns)
    if len(tags) < 2 or not all(tags):
        return None
    check_once(table.path, tags)
    clocks = len({c.clock.columns for c in columns})
    layout = f"pairs of columns, {len(tags)} tags with {clocks} clocks of their own"
    return Source(table, tags, columns, options.good_quality, (layout,), paired=True)


def _groups(table: Table, stated: Collection[str]) -> list[tuple[int, list[int]]]:
    """Each column of stamps, except stated tags, with the columns up to the next one; empty if a column has none
    after it."""
    timed = [_is_time(name) for name in table.names]
    # a tag above both columns
    above = [NUMBERED.sub("", a) != "" and b == "" for a, b in pairwise((*table.names, "."))]
    texts = [is_text(kind) or pa.types.is_temporal(kind) for kind in table.types]
    likely = [i for i, may in enumerate(zip(texts, timed, above, strict=True)) if any(may)]
    likely = [i for i in likely if table.names[i] not in stated]
    heads = dict(zip(likely, table.head(likely), strict=True))
    times = [i for i in likely if holds_stamps(heads[i], timed[i], above[i])]
    if len(times) < 2 or times[0] != 0:
        return []
    groups = [
        (time, [i for i in range(time + 1, end) if not pa.types.is_null(table.types[i])])
        for time, end in zip(times, [*times[1:], len(table.names)], strict=True)
    ]
    return groups if all(following for _, following in groups) else []


def _is_time(name: str) -> bool:
    """Whether a column's own name is a name for stamps."""
    bare = NUMBERED.sub("", name[:NAME_LENGTH])
    return plain(bare) in COLUMNS["stamp"] or any((TIME_WORDS.search(bare), TIME_FIRST.match(bare)))


def _paired(table: Table, time: int, following: Sequence[int], options: ReadOptions) -> list[TagColumn]:
    """The tags with a common clock: the following columns of values, with their quality."""
    quality = [i for i in following if plain(NUMBERED.sub("", table.names[i])) in COLUMNS["quality"]]
    held = [i for i in following if i not in quality]
    # a tag, whose last letters are no time zone, or the name of the time
    above = NUMBERED.sub("", table.names[time])
    clock = stamps_clock(table, time, options, above if plain(above) in COLUMNS["stamp"] else "")
    single = quality[0] if len(quality) == 1 and len(held) == 1 else -1
    return [TagColumn(clock, i, single) for i in held]


def _tag(table: Table, column: TagColumn) -> str:
    """The tag's name: above its values, or above its stamps if that is unspecific."""
    own, other = table.names[column.value], table.names[column.clock.columns[0]]
    if plain(NUMBERED.sub("", own)) in COLUMNS["value"] or own == "":
        return TIME_WORDS.sub("", other[:NAME_LENGTH]) or other
    return VALUE_WORDS.sub("", own[:NAME_LENGTH]) or own


def tag_column(table: Table) -> int:
    """The column of tags of a long table, otherwise -1."""
    tag = first_named(table.names, COLUMNS["tag"])
    return -1 if tag is None or _value_column(table) is None else tag


def open_long(table: Table, options: ReadOptions) -> Source | None:
    """Read a table as long if it has columns for tag and value; else None."""
    tag, value = tag_column(table), _value_column(table)
    if tag < 0 or value is None:
        return None
    clock = find_clock(table, options, tag)
    met = table.tags or _kinds(table, tag).to_pylist()
    tags = tuple(str(name) for name in met if name not in (None, ""))
    quality, scheme = first_named(table.names, COLUMNS["quality"]), None
    if options.quality_column is not None:
        quality = stated_column(table.path, table.names, options.quality_column, "quality")
    layout = [f"long table, {len(tags)} tags in column '{table.names[tag]}'"]
    if quality is not None:
        scheme = scheme_of(table.names[quality], _kinds(table, quality), ones_prevail(table.head([quality])))
        layout.append(f"column '{table.names[quality]}' read as {scheme.value}")
    columns = (TagColumn(clock, value, -1 if quality is None else quality),)
    return Source(table, tags, columns, options.good_quality, tuple(layout), tag, scheme)


def _kinds(table: Table, column: int) -> pa.Array:
    """The distinct cells of a column."""
    return pc.unique(pa.concat_arrays([pc.unique(arrays[0]) for arrays in table.each([column])]))


def _value_column(table: Table) -> int | None:
    """The column with such a name, else the only one of numbers that is neither time nor quality."""
    named = first_named(table.names, COLUMNS["value"])
    if named is not None:
        return named
    floating = [i for i, kind in enumerate(table.types) if pa.types.is_floating(kind)]
    taken = {*COLUMNS["stamp"], *COLUMNS["quality"]} - {"data"}  # a date in Italian, but a value if numeric
    free = [i for i in floating if plain(table.names[i]) not in taken]
    return free[0] if len(free) == 1 else None


def _rows_of(tag: pa.Array, wanted: Sequence[str]) -> dict[str, NDArray[np.int64]]:
    """Rows of each tag, in the order of the file."""
    place = pc.index_in(as_text(tag), value_set=pa.array(wanted, pa.string())).to_numpy(zero_copy_only=False)
    order = np.argsort(place, kind="stable")
    bounds = np.searchsorted(place[order], np.arange(len(wanted) + 1))
    return {name: order[bounds[i] : bounds[i + 1]] for i, name in enumerate(wanted)}
