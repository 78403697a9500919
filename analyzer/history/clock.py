"""Time columns of a table: which ones, their format, and their seconds on the file's clock and in UTC, across the
hour repeated in autumn and the hour skipped in spring, also for clocks without summer time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.plant_clock import DAY_S, HOUR_S
from analyzer.history.stamps import Fields, fields, stamp_seconds, with_midnights
from analyzer.history.table import WORDS, as_text, is_text, numbers

EARLIEST_S = -11676096000.0
"""Stamps before it are invalid, counted from 1970 [s]: the year 1600; later ones that stray are reported."""
LATEST_S = 10413792000.0  # Stamps from it on are invalid [s]: the year 2300
EXCEL_DAYS = 4000.0  # Span that stamps in Excel days may have [d]: numbers that rise further count seconds
LEAST_MS_STEP = 100.0
"""Steps of a clock without a unit from which it counts milliseconds where they are no whole minutes."""
AUTUMN_SAMPLES = 12
"""Samples in the hours about an autumn change from which their number shows whether an hour came twice: one
in five minutes."""
IN_SPRING = 0.25
"""Ratio of the samples in the hour that is skipped in spring to those in adjacent hours, above which a
clock keeps winter time. It is 0 for a clock with summer time and 1 for one without."""
IN_AUTUMN = 1.5
"""The same ratio for the hour that is repeated in autumn, below which a clock keeps winter time. It is 2
for a clock with summer time and 1 for one without."""
TYPICAL_STEPS = 3.0
"""Typical steps that a step over the change may take where the clock does not run backwards."""
LEAST_STEP_S = 1e-5
"""Interval of samples below which a unit in the name of a time column is not used [s]: drives are sampled at
100 kHz at most."""
MOST_STEP_S = 1e5
"""Interval of samples above which it is not used [s]: more than one day between samples is no trend of a loop."""

TICKS_PER_S = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


@dataclass(frozen=True, slots=True)
class TimeScale:
    """Meaning of a number as a time: second = number * unit_s + origin_s, on a local clock or in UTC."""

    name: str
    low: float
    high: float
    unit_s: float
    origin_s: float = 0.0
    local: bool = False

    @property
    def note(self) -> str:
        """Note on how stamps of this scale are read."""
        if self == OF_DAY:
            return f"stamps are {self.name}; export the date too, so that the night has its own"
        text = f"stamps are {'texts' if self == ELAPSED else 'numbers'}, read as {self.name}"
        another = (
            ", from 1970 on; state the unit in the column's name, as in 'Time (ms)', where it is another"
        )
        return text + another if self in SINCE_START.values() else text


MISSING_HOUR = "samples are in the hour that the time zone skips in spring and are left out"
REPEATED_HOUR = "samples are in the hour that the time zone repeats in autumn; distinguished by their order"
SCALES = tuple(TimeScale(**scale) for scale in WORDS["scales"])
SINCE_START = {unit: TimeScale(**scale) for unit, scale in WORDS["since_start"].items()}
"""Clocks that count from the start, by the unit in the column's name."""
ELAPSED = TimeScale("hours, minutes and seconds since the start", 0, 0, 1.0)
"""A clock in text that counts from the start, such as 25:10:03."""
OF_DAY = TimeScale("times of day with no date, from 1970-01-01 on, a day more at each midnight", 0, 0, 1.0)
"""A clock in text without a date, such as 23:00:00."""
WITHOUT_LEAP = "in this order the stamps increase without a jump"
MIDNIGHT = r"[ T]0?0:00:00(?:\.0+)?$"
COUNTED = r"^\s*(?P<h>\d{1,5}):(?P<m>[0-5]\d):(?P<s>[0-5]\d(?:[.,]\d+)?)\s*$"


@dataclass(frozen=True, slots=True)
class DateOrder:
    """First part of a date ('day', 'month' or 'year'), the reason, and whether it is certain; otherwise another file
    may decide."""

    first: str
    why: str
    sure: bool = True


def shown_order(parts: Fields) -> DateOrder | None:
    """The order shown by a number above 12, or the only order in which the stamps increase regularly; or None."""
    first, second = ((part[parts.open] > 12).any() for part in (parts.a, parts.b))
    if first != second:
        return DateOrder(
            "day" if first else "month", f"the {'first' if first else 'second'} number exceeds 12"
        )
    known = (np.unique(stamp_seconds(parts, order)) for order in ("day", "month"))
    day, month = (np.max(np.diff(second[np.isfinite(second)]), initial=0.0) for second in known)
    return None if day == month else DateOrder("day" if day < month else "month", WITHOUT_LEAP)


@dataclass(frozen=True, slots=True)
class Clock:
    """The time columns of one table.

    Parameters
    ----------
    columns : tuple of int
        One column, or a column of dates and one of times of day.
    scale : Scale or None
        Meaning of numbers.
    order : DateOrder or None
        First part of ambiguous dates; None while undecided (then the month).
    date_format, timezone : str or None
        As in `ReadOptions`.
    local : bool
        True where the stamps state no zone.
    below_s : float
        Unit [s] of the last of the columns, which contains the fraction of a second; 0 without one.
    offset_s : float or None
        Time zone offset in the column's name [s east of Greenwich].
    winter_s : float or None
        Offset of the stated zone's winter time [s east of Greenwich] if the clock keeps it all year.
    doubt : str
        What is unknown about the zone, for the notes.
    every_s : float
        Stated time between rows whose stamps do not advance [s]; 0 if they do.
    """

    columns: tuple[int, ...]
    scale: TimeScale | None = None
    order: DateOrder | None = None
    date_format: str | None = None
    timezone: str | None = None
    local: bool = False
    below_s: float = 0.0
    offset_s: float | None = None
    winter_s: float | None = None
    doubt: str = ""
    every_s: float = 0.0

    def seconds(self, arrays: Sequence[pa.Array]) -> tuple[NDArray[np.float64], bool]:
        """Seconds since 1970-01-01 on the file's clock, NaN where unreadable; True where that is local."""
        second, local = self._seconds(arrays)
        with np.errstate(invalid="ignore"):
            known = (second >= EARLIEST_S) & (second < LATEST_S)
        second = np.where(known, second, np.nan)
        if self.every_s and known.any():
            second = second[known][0] + self.every_s * np.arange(len(second))
        return second, local

    def _seconds(self, arrays: Sequence[pa.Array]) -> tuple[NDArray[np.float64], bool]:
        if self.below_s > 0:
            second, local = replace(self, below_s=0.0).seconds(arrays[:-1])
            return second + numbers(pc.fill_null(arrays[-1], 0)) * self.below_s, local
        column, scale = date_and_time(arrays), self.scale
        if scale == ELAPSED:
            return counted_s(as_text(column)), False
        if scale == OF_DAY:
            return of_day_s(as_text(column), self.date_format), False
        if pa.types.is_date(column.type):
            column = pc.cast(column, pa.timestamp("s"))
        if pa.types.is_timestamp(column.type):
            ticks = column.view(pa.int64()).to_numpy(zero_copy_only=False)
            return ticks / TICKS_PER_S[column.type.unit], column.type.tz is None
        if scale is not None and not is_text(column.type):
            digits = 3 if scale.name == "Excel days" else 6
            return np.round(numbers(column) * scale.unit_s + scale.origin_s, digits), scale.local
        return self._from_texts(as_text(column))

    def utc(self, second: NDArray[np.float64], local: bool) -> tuple[NDArray[np.float64], Counter[str]]:
        """Seconds of UTC from seconds of the file's clock, in the order of the file."""
        fixed_s = self.winter_s if self.offset_s is None else self.offset_s
        if local and fixed_s is not None:
            return second - fixed_s, Counter()
        if not local or self.timezone is None:
            return second, Counter()
        return to_utc(second, self.timezone)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on how the stamps are read, unless it is obvious."""
        notes = [] if self.scale is None else [self.scale.note]
        if self.every_s:
            notes.append(f"stamps do not advance: rows are taken as {self.every_s:g} s apart, as stated")
        if self.order is not None:
            notes.append(f"dates are read {self.order.first} first: {self.order.why}")
        if self.local and self.offset_s is not None:
            notes.append(f"stamps are {self.offset_s / 3600.0:+g} h from UTC, as their column's name states")
        elif self.local and self.winter_s is not None:
            hours = self.winter_s / 3600.0
            fixed = f"Etc/GMT{-hours:+.0f}" if hours.is_integer() else "a zone without summer time"
            seen = f"stamps do not show the changes of {self.timezone} to or from summer time"
            notes.append(f"{seen}, taken as {hours:+g} h from UTC throughout; state --timezone {fixed}")
        elif self.local:
            notes.append(f"stamps state no time zone, taken as {self.timezone or 'UTC'}{self.doubt}")
        return tuple(notes)

    def _from_texts(self, texts: pa.Array) -> tuple[NDArray[np.float64], bool]:
        if self.date_format is not None:
            return _formatted(texts, self.date_format)
        parts = fields(texts, self.timezone)
        if parts is None:
            return np.full(len(texts), np.nan), True
        order = self.order
        if order is None and parts.open.any():  # no ambiguous date in the first rows
            order = shown_order(parts)
        second = stamp_seconds(parts, "month" if order is None else order.first)
        return with_midnights(second, parts), not parts.stated.any()


def time_scale_of(column: pa.Array, unit: str = "") -> TimeScale | None:
    """Meaning of a column's numbers as a time, by their size and a unit in its name; None if they are not times."""
    number = numbers(column)
    number = number[np.isfinite(number)]
    if len(number) == 0:
        return None
    middle, reach = float(np.median(number)), float(np.ptp(number))
    found = next((scale for scale in SCALES if scale.low <= middle < scale.high), None)
    since = SINCE_START[unit or _unit_by_step(number)]
    counted = since.low <= middle < since.high
    if found is not None:
        in_days = found.unit_s == DAY_S  # such numbers hardly change over an export
        of_unix = found.origin_s == 0.0 and not found.local
        other = (
            unit in ("ms", "s", "min", "h")
            if in_days
            else of_unix and unit != "" and since.unit_s != found.unit_s
        )
        plausible = counted and LEAST_STEP_S <= _step(number) * since.unit_s <= MOST_STEP_S
        if not ((other and (in_days or plausible)) or (in_days and reach > EXCEL_DAYS)):
            return found
    return since if counted else None


def _step(number: NDArray[np.float64]) -> float:
    """The usual difference of different neighbouring numbers; 0 if there is none."""
    steps = np.abs(np.diff(number))
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0


def _unit_by_step(number: NDArray[np.float64]) -> str:
    """'ms' for counts with steps that only milliseconds have, 's' for others: loop trends are sampled every few
    seconds or every few minutes."""
    step = _step(number)
    whole = bool((number % 1 == 0).all())
    return "ms" if whole and step >= LEAST_MS_STEP and (step % 60 != 0 or step % 1000 == 0) else "s"


def counted_s(texts: pa.Array) -> NDArray[np.float64]:
    """Texts such as 25:10:03 as seconds, shape (n,), NaN for other texts."""
    parts = pc.extract_regex(texts, COUNTED)
    hour, minute, second = (
        numbers(pc.replace_substring(pc.struct_field(parts, name), ",", ".")) for name in "hms"
    )
    return np.asarray(3600.0 * hour + 60.0 * minute + second)


def is_of_day(date_format: str) -> bool:
    """Whether a format has a time of day and no date."""
    at = datetime(2026, 5, 12, 8, 9, 10)
    return datetime.strptime(at.strftime(date_format), date_format) == at.replace(1900, 1, 1)


def of_day_s(texts: pa.Array, date_format: str | None = None) -> NDArray[np.float64]:
    """Times of day as seconds, shape (n,), NaN for other texts: a day is added, or subtracted, after a change of more
    than half a day."""
    if date_format is not None:
        second = _formatted(texts, date_format)[0] % DAY_S
    else:
        parts = fields(pc.binary_join_element_wise("1970-01-01", pc.utf8_trim_whitespace(texts), " "))
        if parts is None:
            return np.full(len(texts), np.nan)
        second = np.where(parts.readable, parts.clock_s, np.nan)
    known = np.isfinite(second)
    second[known] = np.unwrap(second[known], period=DAY_S)
    return np.asarray(second - DAY_S * np.floor(np.min(second[known], initial=DAY_S) / DAY_S))


def date_and_time(arrays: Sequence[pa.Array]) -> pa.Array:
    """A column of dates and one of times of day as one column of text; a single column unchanged."""
    if len(arrays) == 1:
        return arrays[0]
    texts = (pc.replace_substring_regex(as_text(array), MIDNIGHT, "") for array in arrays)
    return pc.binary_join_element_wise(*texts, " ")


def _formatted(texts: pa.Array, date_format: str) -> tuple[NDArray[np.float64], bool]:
    zoned = "%z" in date_format
    written = pd.Series(texts.to_pylist(), dtype=object)
    index = pd.to_datetime(written, format=date_format, errors="coerce", utc=zoned)
    naive = index.dt.tz_localize(None) if zoned else index
    ticks = naive.to_numpy().astype("datetime64[us]")
    return np.where(np.isnat(ticks), np.nan, ticks.astype(np.int64) / TICKS_PER_S["us"]), not zoned


def to_utc(local_s: NDArray[np.float64], zone: str) -> tuple[NDArray[np.float64], Counter[str]]:
    """Convert seconds of a local wall clock, in the order of the file, to seconds of UTC, shape (n,), and count those
    in repeated and in skipped hours; NaN stays NaN, and skipped hours become NaN."""
    falling = np.nansum(np.sign(np.diff(local_s))) < 0
    ordered = local_s[::-1] if falling else local_s
    summer, winter = _offset_readings(ordered, zone)
    twice = np.isfinite(summer) & (summer != winter)
    known = np.isfinite(ordered)
    second = np.zeros(len(ordered), dtype=bool)
    second[known] = _second_pass(ordered[known], twice[known])
    utc = np.where(second, winter, summer)
    missing = int((np.isfinite(ordered) & np.isnan(utc)).sum())
    found = +Counter({REPEATED_HOUR: int(twice.sum()), MISSING_HOUR: missing})
    return (utc[::-1] if falling else utc), found


def winter_offset_s(local_s: NDArray[np.float64], zone: str) -> float | None:
    """The offset of a zone's winter time [s east of Greenwich] if a clock keeps it all year; else None.

    Such a clock contains the hour skipped in spring, and only once the hour repeated in autumn. The numbers of
    samples in these hours and in adjacent ones show it, in any order of the samples; NaN where unreadable.
    """
    hour, count = np.unique(np.floor(local_s[np.isfinite(local_s)] / HOUR_S), return_counts=True)
    inner = np.flatnonzero(np.diff(hour) <= 2.0)
    around = np.unique(np.concatenate([hour, hour[inner] + 1.0]))
    summer, winter = _offset_readings(around * HOUR_S + HOUR_S / 2, zone)
    counts = dict(zip(hour.tolist(), count.tolist(), strict=True))
    spring = _shares(around[np.isnan(summer)], counts, 1)
    autumn = _shares(around[np.isfinite(summer) & (summer != winter)], counts, AUTUMN_SAMPLES)
    keeps = max(spring) > IN_SPRING if spring else bool(autumn) and max(autumn) < IN_AUTUMN
    if not keeps:
        return None
    year = 1970 + int(np.median(hour) * HOUR_S / (365.2425 * DAY_S))
    days = (datetime(year, month, 1, tzinfo=ZoneInfo(zone)).utcoffset() for month in (1, 7))
    return min(day.total_seconds() for day in days if day is not None)


def is_fixed(zone: str) -> bool:
    """Whether a zone, such as UTC, has no summer time of any year."""
    return ZoneInfo(zone).utcoffset(None) is not None


def _shares(hours: NDArray[np.float64], counts: dict[float, int], least: int) -> list[float]:
    """Samples in some hours relative to the fuller adjacent hour, if there are enough."""
    shares = []
    for hour in hours.tolist():
        adjacent = counts.get(hour - 1.0, 0), counts.get(hour + 1.0, 0)
        if min(adjacent) >= least or (least == 1 and max(adjacent) >= 1 and hour in counts):
            shares.append(counts.get(hour, 0) / max(adjacent))
    return shares


def _offset_readings(
    local_s: NDArray[np.float64], zone: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both readings of every stamp: with summer time where the hour is ambiguous, and without."""
    index = pd.DatetimeIndex((np.nan_to_num(local_s) * 1e6).round().astype("datetime64[us]"))

    def reading(summer: bool) -> NDArray[np.float64]:
        zoned = index.tz_localize(zone, ambiguous=np.full(len(index), summer), nonexistent="NaT")
        offset = zoned.tz_convert("UTC").tz_localize(None) - index
        return np.asarray(local_s + offset.total_seconds().to_numpy())

    return reading(True), reading(False)


def _second_pass(local_s: NDArray[np.float64], twice: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True within a repeated hour after the clock was set back."""
    second = np.zeros(len(local_s), dtype=bool)
    doubtful = np.flatnonzero(twice)
    if doubtful.size == 0:
        return second
    steps = np.diff(local_s)
    typical = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    new_day = np.diff(np.floor(local_s[doubtful] / DAY_S)) != 0
    for rows in np.split(doubtful, np.flatnonzero(new_day) + 1):
        second[rows[_set_back(local_s, rows, typical) :]] = True
    return second


def _set_back(local_s: NDArray[np.float64], rows: NDArray[np.intp], typical_s: float) -> int:
    """Number of the rows of one repeated hour before the clock was set back.

    At the largest backward step; without one, where an additional hour makes the smallest gap.
    """
    before = local_s[rows] - local_s[np.maximum(rows - 1, 0)]
    at_start = before[0] if rows[0] > 0 else -np.inf
    at_end = local_s[rows[-1] + 1] - local_s[rows[-1]] if rows[-1] + 1 < len(local_s) else -np.inf
    inner = int(np.argmin(before[1:])) + 1 if rows.size > 1 else 0
    step = before[inner] if inner else np.inf
    if step < 0 or (step + HOUR_S <= TYPICAL_STEPS * typical_s and step < min(at_start, at_end)):
        return inner
    return 0 if at_start < at_end else len(rows)
