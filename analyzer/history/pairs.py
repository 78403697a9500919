"""Pairs of columns: each tag with a clock of its own beside its values, as spreadsheets of a historian have them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from analyzer.history.clock import Clock, is_text
from analyzer.history.codes import not_good, scheme_of
from analyzer.history.names import LONGEST, QUALITY_NAMES, STAMP_NAMES, VALUE_NAMES, check_once, plain
from analyzer.history.options import ReadOptions
from analyzer.history.raw import Raw
from analyzer.history.stray import MainSpan, main_span
from analyzer.history.table import Table
from analyzer.history.time_columns import clock_of, holds_stamps
from analyzer.history.values import values

TIME_WORDS = re.compile(
    r"[ ._:/-]*\(?(?:time ?stamp|date ?time|time|date|zeitstempel|zeit|ts)\)?(?:[ ._]\d+)?$", re.IGNORECASE
)
TIME_FIRST = re.compile(
    r"^(?:time ?stamp|date ?time|time|zeitstempel|zeit|aika|heure|czas|tijd)[ ._:/-]+", re.IGNORECASE
)
VALUE_WORDS = re.compile(r"(?:^|[ ._:/-])\(?(?:value|val|wert)\)?(?:[ ._]\d+)?$", re.IGNORECASE)
NUMBERED = re.compile(r"[ ._]\d+$")


@dataclass(frozen=True, slots=True)
class Pair:
    """One tag: its clock, and its columns of values and of quality codes (-1: none)."""

    tag: str
    clock: Clock
    value: int
    quality: int = -1


@dataclass(frozen=True, slots=True)
class PairSource:
    """A table of pairs; see `table.Source`."""

    table: Table
    pairs: tuple[Pair, ...]
    good_quality: tuple[str, ...] | None = None

    @property
    def path(self) -> Path:
        """The file."""
        return self.table.path

    @property
    def tags(self) -> tuple[str, ...]:
        """All tags, in the order of the columns."""
        return tuple(pair.tag for pair in self.pairs)

    @property
    def clock(self) -> Clock:
        """The first tag's clock; all are written alike."""
        return self.pairs[0].clock

    @property
    def notes(self) -> tuple[str, ...]:
        """Format and layout of the file."""
        clocks = len({pair.clock.columns for pair in self.pairs})
        layout = f"pairs of columns, {len(self.pairs)} tags with {clocks} clocks of their own"
        return (*self.table.notes, layout, *self.clock.notes)

    def with_clock(self, clock: Clock) -> Self:
        """The same file, all its stamps read in the order of day and month, and the winter time, of another clock."""
        pairs = tuple(replace(p, clock=_ordered_as(p.clock, clock)) for p in self.pairs)
        return replace(self, pairs=pairs)

    def read(self, tags: Sequence[str]) -> dict[str, Raw]:
        """Samples of those of `tags` that the file holds."""
        wanted = [pair for pair in self.pairs if pair.tag in set(tags)]
        if not wanted:
            return {}
        columns = sorted({i for p in wanted for i in (*p.clock.columns, p.value, p.quality) if i >= 0})
        arrays = dict(zip(columns, self.table.read(columns), strict=True))
        return {pair.tag: self._raw(pair, arrays) for pair in wanted}

    def span(self) -> MainSpan:
        """Where the samples lie in time, stray ones apart [s since 1970-01-01 UTC]."""
        columns = sorted({i for pair in self.pairs for i in pair.clock.columns})
        arrays = dict(zip(columns, self.table.read(columns), strict=True))
        clocks = {pair.clock.columns: pair.clock for pair in self.pairs}.values()
        stamps = [c.utc(*c.seconds([arrays[i] for i in c.columns]))[0] for c in clocks]
        return main_span(np.concatenate(stamps))

    def _raw(self, pair: Pair, arrays: dict[int, pa.Array]) -> Raw:
        """One tag's samples; rows below its last one, where longer tags go on, are none."""
        times = [arrays[i] for i in pair.clock.columns]
        filled = pc.is_valid(times[0]).to_numpy(zero_copy_only=False)
        if pa.types.is_string(times[0].type):
            filled &= pc.fill_null(pc.not_equal(times[0], ""), False).to_numpy(zero_copy_only=False)
        stamp_s, found = pair.clock.utc(*pair.clock.seconds([a.filter(pa.array(filled)) for a in times]))
        read = values(arrays[pair.value].filter(pa.array(filled)), self.table.decimal)
        bad, met = read.bad, read.found + found
        if pair.quality >= 0:
            codes = arrays[pair.quality].filter(pa.array(filled))
            scheme = scheme_of(self.table.names[pair.quality], codes)
            rejected, counts = not_good(codes, scheme, self.good_quality)
            bad, met = bad | rejected, met + counts
        return Raw(stamp_s, read.value, bad, read.text, Counter(met), read.unread, read.example)


def _ordered_as(clock: Clock, other: Clock) -> Clock:
    return replace(
        clock,
        day_first=other.day_first,
        year_first=other.year_first,
        ambiguous=other.ambiguous,
        why=other.why,
        winter_s=other.winter_s,
    )


def open_pairs(table: Table, options: ReadOptions) -> PairSource | None:
    """Take a table as pairs where two or more columns hold stamps, each with values behind it; else None."""
    if options.time_column is not None or options.date_format is not None:
        return None
    groups = _groups(table)
    if len(groups) < 2:
        return None
    pairs = [pair for time, beside in groups for pair in _pairs(table, time, beside, options)]
    tags = [pair.tag for pair in pairs]
    if len(pairs) < 2 or not all(tags):
        return None
    check_once(table.path, tags)
    return PairSource(table, tuple(pairs), options.good_quality)


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
    empty = {i for i in range(len(table.names)) if pa.types.is_null(table.types[i])}
    groups = [
        (time, [i for i in range(time + 1, end) if i not in empty])
        for time, end in zip(times, [*times[1:], len(table.names)], strict=True)
    ]
    return groups if all(beside for _, beside in groups) else []


def _is_time(name: str) -> bool:
    """Whether a column's own name is that of stamps."""
    bare = NUMBERED.sub("", name[:LONGEST])
    return (
        plain(bare) in STAMP_NAMES
        or TIME_WORDS.search(bare) is not None
        or TIME_FIRST.match(bare) is not None
    )


def _time_name(table: Table, i: int) -> str:
    """A name under which numbers of a column may count as stamps: its own, or 'time' before a column without one."""
    if _is_time(table.names[i]):
        return "time"
    name = NUMBERED.sub("", table.names[i][:LONGEST])
    unnamed = i + 1 < len(table.names) and table.names[i + 1] == "" and name != ""
    return "time" if unnamed else ""


def _pairs(table: Table, time: int, beside: Sequence[int], options: ReadOptions) -> list[Pair]:
    """The tags that share one clock: those behind it that hold values, with their quality."""
    quality = [i for i in beside if plain(NUMBERED.sub("", table.names[i])) in QUALITY_NAMES]
    held = [i for i in beside if i not in quality]
    clock = clock_of(table, time, options)
    single = quality[0] if len(quality) == 1 and len(held) == 1 else -1
    return [Pair(_tag(table, time, i), clock, i, single) for i in held]


def _tag(table: Table, time: int, value: int) -> str:
    """The tag's name: above its values, or where that says nothing above its stamps."""
    own, other = table.names[value], table.names[time]
    if plain(NUMBERED.sub("", own)) in VALUE_NAMES or own == "":
        return TIME_WORDS.sub("", other[:LONGEST]) or other
    return VALUE_WORDS.sub("", own[:LONGEST]) or own
