"""A time that a person wrote: in changes.csv, in loops.csv, on the command line. Read one way, or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from analyzer.history import stamps
from analyzer.history.plant_clock import UTC_NAME, seconds
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
    return float(parse_times([text], [where], zone, day_first)[0])


def parse_times(
    texts: Sequence[str], where: Sequence[str], zone: str = UTC_NAME, day_first: bool | None = None
) -> NDArray[np.float64]:
    """The same of many times at once, shape (n,); the first that is none, or reads two ways, is refused."""
    trimmed = [text.strip() for text in texts]
    parts = stamps.fields(pa.array(trimmed, pa.string()))
    readable = np.zeros(len(texts), dtype=bool) if parts is None else parts.readable
    for at in np.flatnonzero(~readable)[:1]:
        raise InputError(f"{where[at]}: time {trimmed[at][:SHOWN]!r}", EXAMPLE, "correct the time")
    if parts is None:
        return np.empty(0)
    first, sure = _day_first(parts, trimmed, day_first)
    local_s = np.where(first, stamps.seconds(parts, True), stamps.seconds(parts, False))
    with np.errstate(invalid="ignore"):
        of_our_time = (local_s >= FIRST_S) & (local_s < LAST_S)
    for at in np.flatnonzero(~sure | ~of_our_time)[:1]:
        seen = f"{where[at]}: time {trimmed[at][:SHOWN]!r}"
        if not sure[at]:
            raise InputError(f"{seen} reads two ways", EXAMPLE, "write the year first, with four digits")
        raise InputError(f"{seen} is no such day", EXAMPLE, "correct the time")
    epoch = datetime(1970, 1, 1)
    return np.array(
        [
            s if zoned else seconds(epoch + timedelta(seconds=s), zone)
            for s, zoned in zip(local_s.tolist(), parts.stated.tolist(), strict=True)
        ]
    )


def _day_first(
    parts: stamps.Fields, texts: Sequence[str], stated: bool | None
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether the day stands first in each date, shape (n,), and whether that is sure."""
    is_open = parts.order == stamps.OPEN
    year = is_open & parts.short & (parts.b >= 1) & (parts.b <= 12) & (parts.c >= 1) & (parts.c <= 31)
    above = (parts.a > 12) != (parts.b > 12)
    pointed = np.array(["." in text.split(" ")[0] for text in texts]) | (parts.a == parts.b)
    if stated is not None:
        return is_open & stated, np.ones(len(texts), dtype=bool)
    return is_open & np.where(above, parts.a > 12, pointed), ~is_open | (~year & (above | pointed))
