"""Finding the time columns of a table and deciding how they are written."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from analyzer.history import stamps, zone
from analyzer.history.clock import (
    ELAPSED,
    SINCE_START,
    Clock,
    as_text,
    counted_s,
    is_count,
    is_text,
    scale_of,
)
from analyzer.history.day_order import with_day_order
from analyzer.history.names import (
    CLOCK_NAMES,
    FRACTIONS,
    STAMP_NAMES,
    is_stamp,
    plain,
    time_unit,
    without_unit,
)
from analyzer.history.options import ReadOptions
from analyzer.history.table import Table
from analyzer.history.zone_names import SEVERAL, header_offset_s, named_zone, of_several
from identification.errors import InputError

TIME_OF_DAY = r"^\s*\d{1,2}(:\d\d(:\d\d([.,;]\d+)?)?|\.\d\d\.\d\d([.,]\d+)?)\s*([AaPp]\.?[Mm]\.?)?\s*$"
UNREADABLE_SHARE = 0.5
GLANCE = 50
"""Texts of a column that are glanced at before they are taken apart."""
LIKE_STAMP = re.compile(
    r"\d[-/. ]\.?\s*\w{1,12}[-/. ,]|\d:\d\d|[^\W\d]{3}\.? \d{1,2}\b|^\s*\d{8}|\d\.\d\d\.\d\d|\d[年년]"
)
LETTERS_BEHIND = re.compile(r"\b([A-Z]{3,5})\W*$")
FEW_ROWS, SHARED_MINUTES = 10, 0.7
"""Rows from which stamps of whole minutes are looked at, and the share of them that must differ [-]; ours: samples 42
s apart and more are read, a few of them on one stamp."""
SHOWN = 60
"""Characters of a cell that an error shows."""
FINER = "timems"
"""Column of WinCC that holds its text's stamp to the microsecond, in millions of Excel days."""


def find_clock(table: Table, options: ReadOptions) -> Clock:
    """The time columns of a table, and how they are written.

    Raises
    ------
    InputError
        No column holds a time, or the one that is named so cannot be read.
    """
    columns = _candidates(table, options)
    heads = dict(zip(columns, table.head(columns), strict=True))
    kinds = {i: _kind(table.names[i], head, options.timezone) for i, head in heads.items()}
    clock = _chosen(table, kinds, options)
    if clock is None or _is_doubtful(table, clock, kinds, heads):
        raise _no_time(table, columns)
    clock = _with_fraction(table, with_day_order(table, clock, options))
    second, local = clock.seconds(table.head(clock.columns))
    if np.isnan(second).all():
        raise _unreadable(table, clock.columns[0])
    return with_winter_time(table, _with_zone(table, replace(clock, local=local)))


def check_seconds(table: Table, clock: Clock, tag: int = -1) -> None:
    """Raise InputError where stamps have lost their seconds, so that the samples of a minute share one.

    Parameters
    ----------
    table : Table
    clock : Clock
    tag : int
        Column of the tags of a long table, -1 for a wide one.
    """
    second = clock.seconds(table.head(clock.columns))[0]
    known = np.isfinite(second)
    if known.sum() < FEW_ROWS or (second[known] % 60.0 != 0).any():
        return
    tags = as_text(table.head([tag])[0]).to_pylist() if tag >= 0 else [""] * len(second)
    kept = {(tags[k], second[k]) for k in np.flatnonzero(known)}
    if len(kept) <= SHARED_MINUTES * known.sum():
        raise InputError(
            f"{table.path}: stamps without their seconds, {known.sum()} samples on {len(kept)} whole minutes",
            "a stamp of its own for each sample",
            "export the time with its seconds (in a spreadsheet, format the column as yyyy-mm-dd hh:mm:ss)",
        )


def _with_zone(table: Table, clock: Clock) -> Clock:
    """The clock with the zone that the column's name or its stamps state, where these are local."""
    name, head = table.names[clock.columns[0]], table.head(clock.columns[:1])[0].drop_null()
    text = str(head[0].as_py()) if clock.local and is_text(head.type) and len(head) else ""
    zone_name = named_zone(name) or named_zone(text) or clock.timezone
    several = of_several(name, zone_name)
    doubt = f", for '{several}' means several zones; state --timezone" if several else ""
    return replace(clock, offset_s=header_offset_s(name, zone_name), timezone=zone_name, doubt=doubt)


def with_winter_time(table: Table, clock: Clock) -> Clock:
    """The clock, marked where its stamps show that it keeps the stated zone's winter time all the year."""
    if (
        not clock.local
        or clock.offset_s is not None
        or clock.timezone is None
        or zone.is_fixed(clock.timezone)
    ):
        return clock
    second = clock.seconds(table.read(clock.columns))[0]
    return replace(clock, winter_s=zone.winter_offset_s(second, clock.timezone))


def _with_fraction(table: Table, clock: Clock) -> Clock:
    """The clock with a column beside it that holds what is below the second, where one is named so."""
    for i, name in enumerate(table.names):
        unit, kind = FRACTIONS.get(plain(name), 0.0), table.types[i]
        if i in clock.columns or unit == 0.0 or not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
            continue
        head = table.head([i])[0].drop_null()
        if len(head) and pc.min(head).as_py() >= 0 and pc.max(head).as_py() * unit < 1.0:
            return replace(clock, columns=(*clock.columns, i), below_s=unit)
    return clock


def clock_of(table: Table, column: int, options: ReadOptions) -> Clock:
    """The clock of one column that is known to hold stamps."""
    head = table.head([column])[0]
    is_number = pa.types.is_integer(head.type) or pa.types.is_floating(head.type)
    scale = scale_of(head, time_unit(table.names[column])) if is_number else None
    clock = Clock((column,), timezone=options.timezone, scale=scale)
    clock = with_day_order(table, clock, options)
    return with_winter_time(table, replace(clock, local=clock.seconds([head])[1]))


def holds_stamps(name: str, head: pa.Array, since_start: bool = True) -> bool:
    """Whether the first rows of a column are stamps; numbers only where the column is named as stamps are.

    With `since_start` numbers may count from the start of the export; else they must lie in our time.
    """
    filled = head.drop_null()
    if len(filled) == 0 or pa.types.is_boolean(head.type):
        return False
    if pa.types.is_integer(head.type) or pa.types.is_floating(head.type):
        scale = scale_of(filled)
        return name != "" and scale is not None and (since_start or scale not in SINCE_START.values())
    return _kind(name, filled) == "full"


def _is_doubtful(table: Table, clock: Clock, kinds: dict[int, str], heads: dict[int, pa.Array]) -> bool:
    """Whether what was chosen stands in for a time column that cannot be read, or merely counts the rows."""
    chosen = clock.columns[0]
    if is_stamp(table.names[chosen]):
        return False
    unread = [
        i
        for i, kind in kinds.items()
        if kind == "" and is_stamp(table.names[i]) and heads[i].null_count < len(heads[i])
    ]
    return bool(unread) or (clock.scale is not None and is_count(heads[chosen]))


def _candidates(table: Table, options: ReadOptions) -> list[int]:
    """Columns that may hold a time: the stated one, else by type, by name, and columns of text.

    Raises
    ------
    InputError
        There is no column of the stated name.
    """
    if options.time_column is not None:
        if options.time_column not in table.names:
            raise InputError(
                f"{table.path}: no column '{options.time_column}' among {', '.join(table.names[:8])}",
                "the name of the time column as it stands in the header",
                "correct --time-column",
            )
        return [table.names.index(options.time_column)]
    named = {i for i, name in enumerate(table.names) if is_stamp(name) or _is_index(name)}
    typed = {i for i, kind in enumerate(table.types) if pa.types.is_temporal(kind) or is_text(kind)}
    return sorted(named | typed)


def _is_index(name: str) -> bool:
    return name.startswith("__index_level_") or name in ("", "index")


def _kind(name: str, head: pa.Array, timezone: str | None = None) -> str:
    """'full', 'date', 'time of day', 'number' or '' for what the first rows hold."""
    if pa.types.is_timestamp(head.type):
        return "full"
    if pa.types.is_date(head.type):
        return "date"
    if pa.types.is_time(head.type):
        return "time of day"
    if is_text(head.type):
        return _text_kind(as_text(head).drop_null(), timezone)
    numeric = pa.types.is_integer(head.type) or pa.types.is_floating(head.type)
    if not numeric:
        return ""
    return "number" if scale_of(head, time_unit(name)) is not None else _text_kind(as_text(head.drop_null()))


def _text_kind(texts: pa.Array, timezone: str | None = None) -> str:
    if not any(LIKE_STAMP.search(text) for text in texts.slice(0, GLANCE).to_pylist()):
        return ""  # most columns of text are modes: the patterns below cost more than the rest of opening
    if (
        pc.mean(pc.cast(pc.match_substring_regex(texts, TIME_OF_DAY), pa.float64())).as_py()
        > UNREADABLE_SHARE
    ):
        return "time of day"
    parts = stamps.fields(texts, timezone)
    if parts is None or parts.readable.mean() <= UNREADABLE_SHARE:
        return ""
    return "full" if (parts.clock_s != 0).any() or len(texts) == 1 else "date"


def _chosen(table: Table, kinds: dict[int, str], options: ReadOptions) -> Clock | None:
    by_kind = {kind: _by_name(table, [i for i in kinds if kinds[i] == kind]) for kind in set(kinds.values())}
    clock = Clock((0,), date_format=options.date_format, timezone=options.timezone)
    if options.date_format is not None:
        named = _by_name(table, [i for i in kinds if is_stamp(table.names[i])] or list(kinds))
        return replace(clock, columns=(named[0],)) if named else None
    if "date" in by_kind and "time of day" in by_kind:
        return replace(clock, columns=(by_kind["date"][0], by_kind["time of day"][0]))
    finer = next((i for i in by_kind.get("number", ()) if plain(table.names[i]) == FINER), None)
    if finer is not None and (scale := scale_of(table.head([finer])[0])) is not None:
        return replace(clock, columns=(finer,), scale=scale)
    if "full" in by_kind:
        return replace(clock, columns=(by_kind["full"][0],))
    if "number" in by_kind:
        column = by_kind["number"][0]
        return replace(
            clock, columns=(column,), scale=scale_of(table.head([column])[0], time_unit(table.names[column]))
        )
    if "date" in by_kind:
        return replace(clock, columns=(by_kind["date"][0],))
    return _elapsed(table, clock, by_kind.get("time of day", ()))


def _elapsed(table: Table, clock: Clock, columns: Sequence[int]) -> Clock | None:
    """The clock of times without a date, where they begin with zero or pass a day: they count from the start."""
    for i in columns:
        second = counted_s(as_text(table.head([i])[0]))
        known = second[np.isfinite(second)]
        if known.size and (known[0] < 60.0 or known.max() > 86400.0):
            return replace(clock, columns=(i,), scale=ELAPSED)
    return None


def _by_name(table: Table, columns: Sequence[int]) -> list[int]:
    """Columns whose names mean a time first, in the order of the dictionary of names."""
    rank = {name: i for i, name in enumerate((*STAMP_NAMES, *CLOCK_NAMES))}
    return sorted(columns, key=lambda i: (rank.get(plain(without_unit(table.names[i])), len(rank)), i))


def _no_time(table: Table, columns: Sequence[int]) -> InputError:
    named = [i for i in columns if is_stamp(table.names[i])]
    if not named:
        return InputError(
            f"{table.path}: no time column among {', '.join(table.names[:8])}",
            "a column of time stamps, named timestamp, time or the like",
            "add the stamps to the export, or name their column timestamp",
        )
    return _unreadable(table, named[0])


def _unreadable(table: Table, column: int) -> InputError:
    text = next(iter(as_text(table.head([column])[0].drop_null()).to_pylist()), "")
    row = "" if table.first_row is None else f", row {table.first_row}"
    seen = (
        f"{table.path}: column '{table.names[column]}'{row}: '{text[:SHOWN]}' is no time stamp that is known"
    )
    letters = LETTERS_BEHIND.search(text)
    if letters is not None and letters[1].lower() in SEVERAL:
        return InputError(seen, f"one zone, but '{letters[1]}' means several", "state --timezone")
    return InputError(
        seen,
        "stamps such as 2024-11-21 08:00:00 or 21.11.2024 08:00:00",
        "state the date format, such as --date-format '%y%m%d %H%M%S'",
    )
