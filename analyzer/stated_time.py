"""A time that a person wrote: in changes.csv, in loops.csv, on the command line. Read one way, or not at all."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pyarrow as pa

from analyzer.history import stamps
from analyzer.plant_clock import UTC_NAME, seconds
from identification.errors import InputError

FIRST_S, LAST_S = 0.0, 4102444800.0
"""Times before 1970 and from 2100 on are nobody's changes [s since 1970-01-01 UTC]."""
SHOWN = 40
"""Characters of a text that an error shows."""
EXAMPLE = "a time such as 2026-03-09 08:00 or 2026-03-09T08:00:00Z"


def parse_time(text: str, where: str, zone: str = UTC_NAME, day_first: bool | None = None) -> float:
    """A time as seconds since 1970-01-01 UTC; one that states no zone is of the plant's clock.

    Parameters
    ----------
    text : str
        ISO, or as exports write stamps; dates with points have the day first.
    where : str
        Place in the message of an error.
    zone : str
        The plant's time zone.
    day_first : bool or None
        Order of dates such as 03/04/2026; None: unknown, and such dates are refused.

    Raises
    ------
    InputError
        It is no time, could be read two ways, or lies outside 1970 to 2099.
    """
    shown = text.strip()[:SHOWN]
    parts = stamps.fields(pa.array([text.strip()]))
    if parts is None or not parts.readable[0]:
        raise InputError(f"{where}: time {shown!r}", EXAMPLE, "correct the time")
    order = _day_first(parts, text, day_first)
    if order is None:
        raise InputError(
            f"{where}: time {shown!r} reads two ways", EXAMPLE, "write the year first, with four digits"
        )
    local_s = float(stamps.seconds(parts, order)[0])
    if not np.isfinite(local_s) or not FIRST_S <= local_s < LAST_S:
        raise InputError(f"{where}: time {shown!r} is no such day", EXAMPLE, "correct the time")
    if parts.zoned:
        return local_s
    return seconds(datetime(1970, 1, 1) + timedelta(seconds=local_s), zone)


def _day_first(parts: stamps.Fields, text: str, stated: bool | None) -> bool | None:
    """Whether the day stands first; None where a date reads two ways."""
    if not parts.is_open:
        return False
    if parts.short_year and stamps.may_be_year_first(parts):
        return stated
    if stated is not None:
        return stated
    seen = stamps.days_seen(parts)
    if seen is not None:
        return seen
    if "." in text.strip().split(" ")[0] or parts.a[0] == parts.b[0]:
        return True
    return None
