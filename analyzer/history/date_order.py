"""Whether day, month or year stands first in a file's dates where their writing leaves it open."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from analyzer.history import stamps

DAY_FIRST_ZONES = ("Europe/", "Africa/", "Australia/", "Asia/")
"""Zones in which dates have the day first where figures alone would read either way."""
AHEAD_S = 2 * 86400.0
"""Stamps later than now by more than this are taken as read in a wrong order [s]."""
WITHOUT_LEAP = "so read, the stamps run without a leap"


@dataclass(frozen=True, slots=True)
class DateOrder:
    """What stands first ('day', 'month' or 'year'), what decided it, and whether that is sure: else another file may
    decide."""

    first: str
    why: str
    sure: bool = True


def date_order(parts: stamps.Fields, example: str, timezone: str | None) -> DateOrder:
    """The order of all dates of a file, one of which is `example`, in a stated zone."""
    date = example.split(" ")[0]
    pointed = "." in date
    by_year = _with_short_year(parts, pointed and "-" not in date and "/" not in date)
    if by_year is not None:
        return by_year
    seen = days_seen(parts)
    if seen is not None:
        return DateOrder(seen, f"the {'first' if seen == 'day' else 'second'} number exceeds 12")
    running = by_gaps(parts)
    if running is not None:
        return DateOrder(running, WITHOUT_LEAP)
    if pointed:
        return DateOrder("day", "dates with points; no day above 12 occurs")
    usual, other = ("day", "month") if _day_is_usual(parts, timezone) else ("month", "day")
    return DateOrder(usual, f"every date fits both orders; state --{other}-first if so", sure=False)


def days_seen(parts: stamps.Fields) -> str | None:
    """'day' where a first number above 12 shows it first, 'month' where a second one does, else None."""
    first, second = (parts.a[parts.open] > 12).any(), (parts.b[parts.open] > 12).any()
    return None if first == second else "day" if first else "month"


def by_gaps(parts: stamps.Fields) -> str | None:
    """The order of day and month in which the stamps run without a leap; None where they do so in either."""
    day, month = (_largest_gap(parts, first) for first in ("day", "month"))
    return None if day == month else "day" if day < month else "month"


def _largest_gap(parts: stamps.Fields, first: str) -> float:
    second = np.unique(stamps.stamp_seconds(parts, first))
    return float(np.max(np.diff(second[np.isfinite(second)]), initial=0.0))


def _day_is_usual(parts: stamps.Fields, timezone: str | None) -> bool:
    """Whether dates that read either way have the day first: where the month first would lie ahead of us, or as
    is usual in the stated zone."""
    limit = time.time() + AHEAD_S
    day, month = (bool((stamps.stamp_seconds(parts, first) > limit).any()) for first in ("day", "month"))
    if day != month:
        return month
    return timezone is not None and timezone.startswith(DAY_FIRST_ZONES)


def _with_short_year(parts: stamps.Fields, pointed: bool) -> DateOrder | None:
    """What is decided of dates with years of two digits that may stand in front; None where they do not.

    Dates with points have the year in front only where no other reading fits as well; of others that read several
    ways the latest counts, for exports are of late.
    """
    if not _may_begin_with_year(parts):
        return None
    limit = time.time() + AHEAD_S
    readings = {first: stamps.stamp_seconds(parts, first) for first in ("year", "day", "month")}
    possible = {
        first: found for first, found in readings.items() if np.isfinite(found).all() and found.max() <= limit
    }
    if "year" not in possible:
        return None
    if len(possible) == 1:
        return DateOrder("year", "else the stamps would lie ahead of us")
    leaps = {first: float(np.max(np.abs(np.diff(found)), initial=0.0)) for first, found in possible.items()}
    if leaps["year"] < min(leap for first, leap in leaps.items() if first != "year"):
        return DateOrder("year", WITHOUT_LEAP)
    latest = {first: found.max() for first, found in possible.items() if leaps[first] == min(leaps.values())}
    year = latest.pop("year", None)
    if year is None:
        return None
    if not pointed and max(latest.values()) <= year:
        first = "year"
    elif len(latest) == 1:
        first = next(iter(latest))
    else:
        return None
    return DateOrder(
        first, "the year may stand in front or behind; state --date-format if it is not so", sure=False
    )


def _may_begin_with_year(parts: stamps.Fields) -> bool:
    """Whether all dates may have a year of two digits in front: 24-11-21 as 21 November 2024."""
    b, c = parts.b[parts.open], parts.c[parts.open]
    fits = (c < 100) & (b >= 1) & (b <= 12) & (c >= 1) & (c <= 31)
    return bool(b.size and fits.all() and parts.short.all())
