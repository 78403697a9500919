"""The plant's clock: dates, midnights and times of day in its time zone; everything else counts seconds of UTC."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones

from identification.errors import InputError

UTC_NAME = "UTC"
HOUR_S, DAY_S = 3600.0, 86400.0


def zone_of(name: str | None) -> ZoneInfo:
    """The time zone of a name, UTC without a name.

    Raises
    ------
    InputError
        The zone is not known here.
    """
    try:
        return ZoneInfo(name or UTC_NAME)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        wanted = str(name).strip().replace(" ", "_").lower()
        near = sorted(z for z in available_timezones() if z.lower().rsplit("/", 1)[-1] == wanted)
        expected = f"an IANA name such as {' or '.join(near[:3]) or 'Europe/Berlin'}"
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
    """A time of the plant's clock [s since 1970-01-01 UTC]; in a repeated hour the first one."""
    return (at if at.tzinfo is not None else at.replace(tzinfo=zone_of(zone))).timestamp()


def midnights(first_s: float, last_s: float, zone: str | None) -> list[float]:
    """The plant's midnights strictly between two times [s since 1970-01-01 UTC], 23 to 25 hours apart."""
    day = local(first_s, zone).replace(hour=0, minute=0, second=0, microsecond=0, tzinfo=None)
    out = []
    while (at := utc_seconds(day, zone)) < last_s:
        out += [at] if at > first_s else []
        day += timedelta(days=1)
    return out
