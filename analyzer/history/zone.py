"""Local clock to UTC: the hour that autumn repeats, the hour that spring leaves out, and clocks that know neither."""

from __future__ import annotations

from collections import Counter
from datetime import datetime
from itertools import pairwise
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
from numpy.typing import NDArray

MISSING_HOUR = "samples stand in the hour that the time zone leaves out in spring and are left out"
REPEATED_HOUR = "samples stand in the hour that the time zone repeats in autumn; told apart by their order"
HOUR_S, DAY_S = 3600.0, 86400.0
ENOUGH = 12
"""Samples in the hours about an autumn change from which their number tells whether an hour came twice; ours: one in
five minutes."""
IN_SPRING, IN_AUTUMN = 0.25, 1.5
"""Samples in the hour that spring leaves out, and in that which autumn repeats, over those of their neighbours:
beyond the first, or below the second, a clock keeps winter time [-]; where it is changed they are 0 and 2."""
TYPICAL_STEPS = 3.0
"""Typical steps that a step over the change may take where the clock does not run backwards [-]; ours."""


def to_utc(local_s: NDArray[np.float64], zone: str) -> tuple[NDArray[np.float64], Counter[str]]:
    """Seconds of a local clock to seconds of UTC.

    Parameters
    ----------
    local_s : ndarray, shape (n,)
        Local wall clock [s since 1970-01-01 00:00 local], in the order of the file; NaN stays NaN.
    zone : str
        IANA name.

    Returns
    -------
    ndarray, shape (n,)
        [s since 1970-01-01 UTC]; NaN in the hour that does not exist.
    Counter
        Samples in repeated and in missing hours.
    """
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
    stand in these hours beside their neighbours tells it, in whatever order the samples are.

    Parameters
    ----------
    local_s : ndarray, shape (n,)
        Local wall clock [s since 1970-01-01 00:00 local], in any order; NaN where unreadable.
    zone : str
        IANA name.
    """
    hour, count = np.unique(np.floor(local_s[np.isfinite(local_s)] / HOUR_S), return_counts=True)
    inner = np.flatnonzero(np.diff(hour) <= 2.0)
    around = np.unique(np.concatenate([hour, hour[inner] + 1.0]))
    summer, winter = _offset_readings(around * HOUR_S + HOUR_S / 2, zone)
    held = dict(zip(hour.tolist(), count.tolist(), strict=True))
    spring = _shares(around[np.isnan(summer)], held, 1)
    autumn = _shares(around[np.isfinite(summer) & (summer != winter)], held, ENOUGH)
    keeps = max(spring) > IN_SPRING if spring else bool(autumn) and max(autumn) < IN_AUTUMN
    if not keeps:
        return None
    year = datetime(1970, 1, 1).year + int(np.median(hour) * HOUR_S / (365.2425 * DAY_S))
    return min(_offset_s(datetime(year, month, 1), zone) for month in (1, 7))


def is_fixed(zone: str) -> bool:
    """Whether a zone, such as UTC, has no summer time of any year."""
    return ZoneInfo(zone).utcoffset(None) is not None


def _offset_s(at: datetime, zone: str) -> float:
    offset = at.replace(tzinfo=ZoneInfo(zone)).utcoffset()
    return 0.0 if offset is None else offset.total_seconds()


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
    index = pd.DatetimeIndex((np.nan_to_num(local_s) * 1e6).round().astype("datetime64[us]"))
    readings = []
    for summer in (True, False):
        doubtful = np.full(len(index), summer)
        utc = (
            index.tz_localize(zone, ambiguous=doubtful, nonexistent="NaT").tz_convert("UTC").tz_localize(None)
        )
        offset_s = (utc - index).total_seconds().to_numpy()
        readings.append(local_s + offset_s)
    return readings[0], readings[1]


def _second_pass(local_s: NDArray[np.float64], twice: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True within a repeated hour from where the clock was set back."""
    second = np.zeros(len(local_s), dtype=bool)
    doubtful = np.flatnonzero(twice)
    if doubtful.size == 0:
        return second
    days = np.floor(local_s[doubtful] / DAY_S)
    steps = np.diff(local_s)
    typical = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    cuts = np.r_[0, np.flatnonzero(np.diff(days)) + 1, doubtful.size]
    for a, b in pairwise(cuts.tolist()):
        rows = doubtful[a:b]
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
    if step < 0 or (step + HOUR_S <= TYPICAL_STEPS * typical_s and step < min(at_start, at_end)):
        return inner
    return 0 if at_start < at_end else len(rows)
