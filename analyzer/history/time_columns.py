"""Detection of the time columns of a table and of their format."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history import stamps
from analyzer.history.clock import (
    ELAPSED,
    OF_DAY,
    SINCE_START,
    WITHOUT_LEAP,
    Clock,
    DateOrder,
    TimeScale,
    counted_s,
    date_and_time,
    is_fixed,
    is_of_day,
    shown_order,
    time_scale_of,
    winter_offset_s,
)
from analyzer.history.table import (
    COLUMNS,
    NAME_LENGTH,
    WORDS,
    ReadOptions,
    Table,
    any_of,
    as_text,
    is_number,
    is_text,
    numbers,
    plain,
    stated_column,
)
from identification.errors import InputError

AHEAD_S = 172800.0  # Stamps later than now by more than this are taken as read in a wrong order [s]: two days
MINUTES_ROWS = 10  # Rows from which stamps of whole minutes are tested for lost seconds
MINUTES_SHARE = 0.7
"""Share of such stamps that must differ: samples 42 s apart and more are read, a few of them on one stamp."""
UNREADABLE_SHARE = 0.5  # Share of a column's texts that must be read as stamps for it to be a clock
GLANCE = 50  # Texts of a column that are tested before they are parsed

DAY_FIRST_ZONES = ("Europe/", "Africa/", "Australia/", "Asia/")
"""Zones in which ambiguous dates have the day first."""
TIME_OF_DAY = r"^\s*\d{1,2}(:\d\d(:\d\d([.,;]\d+)?)?|\.\d\d\.\d\d([.,]\d+)?)\s*([AaPp]\.?[Mm]\.?)?\s*$"
LIKE_STAMP = re.compile(
    r"\d[-/. ]\.?\s*\w{1,12}[-/. ,]|\d:\d\d|[^\W\d]{3}\.? \d{1,2}\b|^\s*\d{8}|\d\.\d\d\.\d\d|\d[年년]"
)
LETTERS_BEHIND = re.compile(r"\b([A-Z]{3,5})\W*$")
SHOWN = 60
"""Characters of a cell in an error message."""
FINER = "timems"
"""Column of WinCC with its text's stamp to the microsecond, in millions of Excel days."""
BELOW_SECOND = {name: float(unit_s) for unit_s, names in WORDS["below_second"].items() for name in names}
"""Columns with the fraction of a second of a stamp, and their unit [s]."""
UNIT_IN_NAME = re.compile(
    rf"(?:^|[\s_(\[.,-]+)(?:{'|'.join(f'(?P<{unit}>{any_of(unit)})' for unit in SINCE_START)})[)\].]*$",
    re.IGNORECASE,
)
RANK = {name: i for i, name in enumerate((*COLUMNS["stamp"], *COLUMNS["time_of_day"]))}


def time_unit(name: str) -> str:
    """The unit in a time column's name, as in 'Time (min)' or 't_h': ms, s, min, h or d; '' if none."""
    found = UNIT_IN_NAME.search(name[:NAME_LENGTH])
    return "" if found is None else str(found.lastgroup)


def without_unit(name: str) -> str:
    """A time column's name without its unit."""
    return UNIT_IN_NAME.sub("", name[:NAME_LENGTH])


def is_stamp(name: str) -> bool:
    """Whether a column has a name for stamps, with or without a unit."""
    if not plain(name):
        return False
    bare = plain(without_unit(name))
    return plain(name) in COLUMNS["stamp"] or bare in COLUMNS["stamp"] or bare in COLUMNS["elapsed"]


def find_clock(table: Table, options: ReadOptions, tag: int = -1) -> Clock:
    """The time columns of a table, and their format; `tag` is the column of the tags of a long table.

    Raises
    ------
    InputError
        No column contains a time, or the column of that name cannot be read, or its stamps have lost their seconds.
    """
    columns = _time_candidates(table, options)
    heads = dict(zip(columns, table.head(columns), strict=True))
    kinds = {i: _kind_of_time(table.names[i], head, options.timezone) for i, head in heads.items()}
    clock = _chosen(table, kinds, heads, options)
    if clock is None or _is_doubtful(table, clock, kinds, heads):
        raise _no_time(table, columns)
    clock = _with_fraction(table, _with_order(table, clock, options))
    second, local = clock.seconds(table.head(clock.columns))
    if np.isnan(second).all():
        raise _unreadable(table, clock.columns[0])
    constant = _has_constant_stamps(table, second, tag)
    if constant and not options.interval_s:
        seen = f"{table.path}: the time column '{table.names[clock.columns[0]]}' does not advance"
        remedy = "export the stamps, or state the time between rows, such as --interval 30s"
        raise InputError(seen, "a stamp of its own for each row", remedy)
    if not constant:
        _check_seconds(table, second, tag)
    return _in_zone(
        table,
        replace(clock, local=local, every_s=options.interval_s if constant else 0.0),
        table.names[clock.columns[0]],
    )


def stamps_clock(table: Table, column: int, options: ReadOptions, name: str) -> Clock:
    """The clock of one column that is known to contain stamps, under a name that may state their zone."""
    head = table.head([column])[0]
    scale = time_scale_of(head, time_unit(table.names[column])) if is_number(head.type) else None
    clock = _with_order(table, Clock((column,), timezone=options.timezone, scale=scale), options)
    return _in_zone(table, replace(clock, local=clock.seconds([head])[1]), name)


def _has_constant_stamps(table: Table, second: NDArray[np.float64], tag: int) -> bool:
    """Whether all first rows have the same stamp [s], with several rows for each tag."""
    known = second[np.isfinite(second)]
    if known.size < MINUTES_ROWS or np.ptp(known) > 0.0:
        return False
    return tag < 0 or len(pc.unique(table.head([tag])[0])) <= MINUTES_SHARE * known.size


def _check_seconds(table: Table, second: NDArray[np.float64], tag: int) -> None:
    """Raise InputError if the first stamps [s] have lost their seconds, so that all samples of a minute have the same
    one; `tag` is the column of the tags of a long table, -1 for a wide one."""
    known = np.isfinite(second)
    if known.sum() < MINUTES_ROWS or (second[known] % 60.0 != 0).any():
        return
    tags = as_text(table.head([tag])[0]).to_pylist() if tag >= 0 else [""] * len(second)
    distinct = {(tags[k], second[k]) for k in np.flatnonzero(known)}
    if len(distinct) <= MINUTES_SHARE * known.sum():
        samples = f"{known.sum()} samples on {len(distinct)} whole minutes"
        remedy = (
            "export the time with its seconds (in a spreadsheet, format the column as yyyy-mm-dd hh:mm:ss)"
        )
        seen = f"{table.path}: stamps without their seconds, {samples}"
        raise InputError(seen, "a stamp of its own for each sample", remedy)


def holds_stamps(head: pa.Array, timed: bool, above: bool) -> bool:
    """Whether the first rows of a column are stamps; numbers only if the column has a name for stamps, or a tag above
    it: then they must be recent, otherwise they may count from the start of the export."""
    filled = head.drop_null()
    kind = _kind_of_time("", filled) if len(filled) else ""
    if is_number(head.type):
        return isinstance(kind, TimeScale) and (timed or (above and kind not in SINCE_START.values()))
    return kind == "full"


def _with_order(table: Table, clock: Clock, options: ReadOptions) -> Clock:
    """The clock with the order of its dates, decided from as much of the column as needed."""
    if options.day_first is not None:
        return replace(clock, order=DateOrder("day" if options.day_first else "month", "as stated"))
    head = date_and_time(table.head(clock.columns))
    if clock.date_format is not None or clock.scale is not None or not is_text(head.type):
        return clock
    parts = stamps.fields(as_text(head), clock.timezone)
    if parts is None or not parts.open.any():
        return clock
    whole = stamps.fields(as_text(date_and_time(table.read(clock.columns))), clock.timezone)
    order = None if whole is None else _date_order(whole, str(head[0].as_py()), clock.timezone)
    return replace(clock, order=order)


def _date_order(parts: stamps.Fields, example: str, timezone: str | None) -> DateOrder:
    """The order of all dates of a file, one of which is `example`, in a stated zone.

    If all are ambiguous, the order with the month first may give future dates, or day first is usual in the zone.
    """
    date = example.split(" ")[0]
    pointed = "." in date
    by_year = _with_short_year(parts, pointed and "-" not in date and "/" not in date)
    if by_year is not None:
        return by_year
    shown = shown_order(parts)
    if shown is not None:
        return shown
    if pointed:
        return DateOrder("day", "dates with points; no day above 12 occurs")
    limit = time.time() + AHEAD_S
    ahead = [bool((stamps.stamp_seconds(parts, first) > limit).any()) for first in ("day", "month")]
    usual = timezone is not None and timezone.startswith(DAY_FIRST_ZONES)
    day = ahead[1] if ahead[0] != ahead[1] else usual
    first, other = ("day", "month") if day else ("month", "day")
    return DateOrder(first, f"every date fits both orders; state --{other}-first if so", sure=False)


def _with_short_year(parts: stamps.Fields, pointed: bool) -> DateOrder | None:
    """The order of dates with years of two digits that may be first; None if they are not.

    Dates with points have the year first only if no other reading fits as well; of other ambiguous ones the latest is
    used, because exports are recent.
    """
    if not parts.open.any() or not parts.short.all() or (parts.open & ~parts.year_may_begin).any():
        return None
    limit = time.time() + AHEAD_S
    readings = {first: stamps.stamp_seconds(parts, first) for first in ("year", "day", "month")}
    possible = {
        k: found for k, found in readings.items() if np.isfinite(found).all() and found.max() <= limit
    }
    if "year" not in possible:
        return None
    if len(possible) == 1:
        return DateOrder("year", "otherwise the stamps would be in the future")
    leaps = {first: float(np.max(np.abs(np.diff(found)), initial=0.0)) for first, found in possible.items()}
    latest = {first: found.max() for first, found in possible.items() if leaps[first] == min(leaps.values())}
    year = latest.pop("year", None)
    if year is None:
        return None
    if not latest:
        return DateOrder("year", WITHOUT_LEAP)
    if not pointed and max(latest.values()) <= year:
        first = "year"
    elif len(latest) == 1:
        first = next(iter(latest))
    else:
        return None
    why = "the year may be first or last; state --date-format if this is wrong"
    return DateOrder(first, why, sure=False)


def _with_fraction(table: Table, clock: Clock) -> Clock:
    """The clock with an additional column of fractions of a second, if there is one of that name."""
    for i, name in enumerate(table.names):
        unit = BELOW_SECOND.get(plain(name), 0.0)
        if i in clock.columns or unit == 0.0 or not is_number(table.types[i]):
            continue
        head = table.head([i])[0].drop_null()
        if len(head) and pc.min(head).as_py() >= 0 and pc.max(head).as_py() * unit < 1.0:
            return replace(clock, columns=(*clock.columns, i), below_s=unit)
    return clock


def _in_zone(table: Table, clock: Clock, name: str) -> Clock:
    """The clock with the zone stated by a name or by its stamps, if these are local, marked if they show that it
    keeps the zone's winter time all year."""
    head = table.head(clock.columns[:1])[0].drop_null()
    text = str(head[0].as_py()) if clock.local and is_text(head.type) and len(head) else ""
    zone = stamps.named_zone(name) or stamps.named_zone(text) or clock.timezone
    offset_s, several = stamps.header_zone(name, zone)
    doubt = f", because '{several}' means several zones; state --timezone" if several else ""
    clock = replace(clock, offset_s=offset_s, timezone=zone, doubt=doubt)
    if not clock.local or offset_s is not None or zone is None or is_fixed(zone):
        return clock
    second = clock.seconds(table.read(clock.columns))[0]
    return replace(clock, winter_s=winter_offset_s(second, zone))


def _is_doubtful(
    table: Table, clock: Clock, kinds: Mapping[int, str | TimeScale], heads: Mapping[int, pa.Array]
) -> bool:
    """Whether the chosen column replaces an unreadable time column, or only counts the rows."""
    chosen = clock.columns[0]
    if is_stamp(table.names[chosen]):
        return False
    unread = [i for i, head in heads.items() if kinds[i] == "" and head.null_count < len(head)]
    if any(is_stamp(table.names[i]) for i in unread) or clock.scale in (None, ELAPSED, OF_DAY):
        return any(is_stamp(table.names[i]) for i in unread)
    number = numbers(heads[chosen])
    return number.size > 1 and bool((np.diff(number) == 1).all()) and number[0] in (0.0, 1.0)


def _time_candidates(table: Table, options: ReadOptions) -> list[int]:
    """Columns that may contain a time: the stated one, else by type, by name, and columns of text."""
    if options.time_column is not None:
        return [stated_column(table.path, table.names, options.time_column, "time")]
    named = (is_stamp(n) or n in ("", "index") or n.startswith("__index_level_") for n in table.names)
    held = (pa.types.is_temporal(kind) or is_text(kind) for kind in table.types)
    may = (any(each) for each in zip(named, held, strict=True))
    return [i for i, each in enumerate(may) if each and table.names[i] not in options.stated]


def _kind_of_time(name: str, head: pa.Array, timezone: str | None = None) -> str | TimeScale:
    """'full', 'date', 'time of day' or '' for the contents of the first rows, or the meaning of numbers as a time."""
    if pa.types.is_timestamp(head.type):
        return "full"
    if pa.types.is_date(head.type):
        return "date"
    if pa.types.is_time(head.type):
        return "time of day"
    if is_text(head.type):
        return _text_kind(as_text(head).drop_null(), timezone)
    if not is_number(head.type):
        return ""
    return time_scale_of(head, time_unit(name)) or _text_kind(as_text(head.drop_null()))


def _text_kind(texts: pa.Array, timezone: str | None = None) -> str:
    if not any(LIKE_STAMP.search(text) for text in texts.slice(0, GLANCE).to_pylist()):
        return ""  # most columns of text are modes: the patterns below take most of the opening time
    of_day = pc.cast(pc.match_substring_regex(texts, TIME_OF_DAY), pa.float64())
    if pc.mean(of_day).as_py() > UNREADABLE_SHARE:
        return "time of day"
    parts = stamps.fields(texts, timezone)
    if parts is None or parts.readable.mean() <= UNREADABLE_SHARE:
        return ""
    return "full" if (parts.clock_s != 0).any() or len(texts) == 1 else "date"


def _chosen(
    table: Table, kinds: Mapping[int, str | TimeScale], heads: Mapping[int, pa.Array], options: ReadOptions
) -> Clock | None:
    """The clock of the column, or of the columns of date and time of day, with the most information; of times without
    a date those that count from the start: they begin with zero or exceed a day."""
    clock = Clock((0,), date_format=options.date_format, timezone=options.timezone)
    if options.date_format is not None:
        named = _by_name(table, [i for i in kinds if is_stamp(table.names[i])] or list(kinds))
        scale = OF_DAY if is_of_day(options.date_format) else None
        return replace(clock, columns=(named[0],), scale=scale) if named else None
    full, dates, times = (
        _by_name(table, [i for i in kinds if kinds[i] == kind]) for kind in ("full", "date", "time of day")
    )
    if dates and times:
        return replace(clock, columns=(dates[0], times[0]))
    scales = {i: kind for i, kind in kinds.items() if isinstance(kind, TimeScale)}
    finer = [i for i in scales if plain(table.names[i]) == FINER]
    if finer or (scales and not full):
        i = _by_name(table, finer or list(scales))[0]
        return replace(clock, columns=(i,), scale=scales[i])
    if full or dates:
        return replace(clock, columns=((full or dates)[0],))
    for i in times:
        second = counted_s(as_text(heads[i]))
        known = second[np.isfinite(second)]
        if known.size and (known[0] < 60.0 or known.max() > 86400.0):
            return replace(clock, columns=(i,), scale=ELAPSED)
    return replace(clock, columns=(times[0],), scale=OF_DAY) if times else None


def _by_name(table: Table, columns: Sequence[int]) -> list[int]:
    """Columns with a name for a time first, in the order of the dictionary of names."""
    return sorted(columns, key=lambda i: (RANK.get(plain(without_unit(table.names[i])), len(RANK)), i))


def _no_time(table: Table, columns: Sequence[int]) -> InputError:
    named = [i for i in columns if is_stamp(table.names[i])]
    if named:
        return _unreadable(table, named[0])
    seen = f"{table.path}: no time column among {', '.join(table.names[:8])}"
    remedy = "add the stamps to the export, or name their column timestamp"
    return InputError(seen, "a column of time stamps, named timestamp, time or the like", remedy)


def _unreadable(table: Table, column: int) -> InputError:
    text = next(iter(as_text(table.head([column])[0].drop_null()).to_pylist()), "")
    row = "" if table.first_row is None else f", row {table.first_row}"
    place = f"{table.path}: column '{table.names[column]}'{row}"
    seen = f"{place}: '{text[:SHOWN]}' is no time stamp that is known"
    letters = LETTERS_BEHIND.search(text)
    if letters is not None and letters[1].lower() in stamps.SEVERAL:
        return InputError(seen, f"one zone, but '{letters[1]}' means several", "state --timezone")
    remedy = "state the date format, such as --date-format '%y%m%d %H%M%S'"
    return InputError(seen, "stamps such as 2024-11-21 08:00:00 or 21.11.2024 08:00:00", remedy)
