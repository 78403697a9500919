"""The plant's clock: dates, midnights and times of day in its time zone; all else counts seconds of UTC.

And a column of its stamps to UTC: the hour that autumn repeats, the hour that spring leaves out, and clocks that know
neither.
"""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np
from numpy.typing import NDArray

from analyzer.limits import HISTORY
from identification.errors import InputError

UTC_NAME = "UTC"
MISSING_HOUR = "samples stand in the hour that the time zone leaves out in spring and are left out"
REPEATED_HOUR = "samples stand in the hour that the time zone repeats in autumn; told apart by their order"
HOUR_S, DAY_S = 3600.0, 86400.0


def zone_of(name: str | None) -> ZoneInfo:
    """The time zone of a name, UTC where there is none.

    Raises
    ------
    InputError
        Where no such zone is known here.
    """
    try:
        return ZoneInfo(name or UTC_NAME)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        expected = "an IANA name such as Europe/Berlin"
        raise InputError(f"time zone '{name}'", expected, "correct the name of the time zone") from error


def local(at_s: float, zone: str | None) -> datetime:
    """A time [s since 1970-01-01 UTC] on the plant's clock."""
    return datetime.fromtimestamp(at_s, UTC).astimezone(zone_of(zone))


def date_of(at_s: float, zone: str | None) -> str:
    """The plant's date at a time [s since 1970-01-01 UTC]."""
    return local(at_s, zone).strftime("%Y-%m-%d")


def stamp(at_s: float, zone: str | None) -> str:
    """A time to the minute on the plant's clock."""
    return local(at_s, zone).strftime("%Y-%m-%d %H:%M")


def utc_seconds(at: datetime, zone: str | None) -> float:
    """A time of the plant's clock [s since 1970-01-01 UTC]; of an hour that stands twice the first one."""
    return (at if at.tzinfo is not None else at.replace(tzinfo=zone_of(zone))).timestamp()


def midnights(first_s: float, last_s: float, zone: str | None) -> list[float]:
    """The plant's midnights strictly between two times [s since 1970-01-01 UTC], 23 to 25 hours apart."""
    day = local(first_s, zone).replace(hour=0, minute=0, second=0, microsecond=0, tzinfo=None)
    out = []
    while (at := utc_seconds(day, zone)) < last_s:
        out += [at] if at > first_s else []
        day += timedelta(days=1)
    return out


def to_utc(local_s: NDArray[np.float64], zone: str) -> tuple[NDArray[np.float64], Counter[str]]:
    """Seconds of a local wall clock, in the order of the file, to seconds of UTC, shape (n,), and how many lie in
    repeated and in missing hours; NaN stays NaN, and becomes of the hour that does not exist."""
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
    """The offset of a zone's winter time [s east of Greenwich] where a clock keeps it all the year; else None.

    Such a clock shows the hour that spring leaves out, and the hour that autumn repeats once only; how many samples
    stand in these hours beside their neighbours tells it, in whatever order the samples are; NaN where unreadable.
    """
    hour, count = np.unique(np.floor(local_s[np.isfinite(local_s)] / HOUR_S), return_counts=True)
    inner = np.flatnonzero(np.diff(hour) <= 2.0)
    around = np.unique(np.concatenate([hour, hour[inner] + 1.0]))
    summer, winter = _offset_readings(around * HOUR_S + HOUR_S / 2, zone)
    held = dict(zip(hour.tolist(), count.tolist(), strict=True))
    spring = _shares(around[np.isnan(summer)], held, 1)
    autumn = _shares(around[np.isfinite(summer) & (summer != winter)], held, HISTORY.autumn_samples)
    keeps = max(spring) > HISTORY.in_spring if spring else bool(autumn) and max(autumn) < HISTORY.in_autumn
    if not keeps:
        return None
    year = 1970 + int(np.median(hour) * HOUR_S / (365.2425 * DAY_S))
    days = (datetime(year, month, 1, tzinfo=ZoneInfo(zone)).utcoffset() for month in (1, 7))
    return min(day.total_seconds() for day in days if day is not None)


def is_fixed(zone: str) -> bool:
    """Whether a zone, such as UTC, has no summer time of any year."""
    return ZoneInfo(zone).utcoffset(None) is not None


def _shares(hours: NDArray[np.float64], held: dict[float, int], least: int) -> list[float]:
    """Samples in some hours over those of the fuller hour beside them, where these are enough to tell."""
    shares = []
    for hour in hours.tolist():
        beside = held.get(hour - 1.0, 0), held.get(hour + 1.0, 0)
        if min(beside) >= least or (least == 1 and max(beside) >= 1 and hour in held):
            shares.append(held.get(hour, 0) / max(beside))
    return shares


def _offset_readings(
    local_s: NDArray[np.float64], zone: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both readings of every stamp: with summer time where the hour is doubtful, and without."""
    import pandas as pd  # late: a page's dates need none of it

    index = pd.DatetimeIndex((np.nan_to_num(local_s) * 1e6).round().astype("datetime64[us]"))

    def reading(summer: bool) -> NDArray[np.float64]:
        zoned = index.tz_localize(zone, ambiguous=np.full(len(index), summer), nonexistent="NaT")
        offset = zoned.tz_convert("UTC").tz_localize(None) - index
        return np.asarray(local_s + offset.total_seconds().to_numpy())

    return reading(True), reading(False)


def _second_pass(local_s: NDArray[np.float64], twice: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True within a repeated hour from where the clock was set back."""
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
    """How many of the rows of one repeated hour stand before the clock was set back.

    Where it ran backwards most; where it never did, where an hour more makes the least gap.
    """
    before = local_s[rows] - local_s[np.maximum(rows - 1, 0)]
    at_start = before[0] if rows[0] > 0 else -np.inf
    at_end = local_s[rows[-1] + 1] - local_s[rows[-1]] if rows[-1] + 1 < len(local_s) else -np.inf
    inner = int(np.argmin(before[1:])) + 1 if rows.size > 1 else 0
    step = before[inner] if inner else np.inf
    if step < 0 or (step + HOUR_S <= HISTORY.typical_steps * typical_s and step < min(at_start, at_end)):
        return inner
    return 0 if at_start < at_end else len(rows)
