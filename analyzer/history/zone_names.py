"""Zones as letters, hours or names, behind stamps and in the names of their columns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime
from functools import lru_cache
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from analyzer.history.names import plain

HEADER_ZONE = re.compile(
    r"(?:^|[\s(\[_])(?P<name>(?i:UTC|GMT|Z|CEST|CET|EEST|EET)|[A-Z]{3,5})?"
    r"\s*(?P<offset>[+-]\d{1,2}(?::?\d\d)?)?[)\]]?\s*$"
)
NAMED_ZONE = re.compile(r"(?P<zone>[A-Z][A-Za-z]+/[A-Za-z_]+(?:/[A-Za-z_]+)?)[)\]]?\s*$")
"""A zone of the database of time zones at the end of a stamp or a column's name."""
ZONE_OFFSETS_H = {
    "z": 0.0, "utc": 0.0, "gmt": 0.0, "wet": 0.0, "west": 1.0, "bst": 1.0, "cet": 1.0, "met": 1.0, "mez": 1.0,
    "cest": 2.0, "mest": 2.0, "mesz": 2.0, "eet": 2.0, "eest": 3.0, "msk": 3.0, "jst": 9.0, "est": -5.0, "edt": -4.0,
    "cdt": -5.0, "mst": -7.0, "mdt": -6.0, "pst": -8.0, "pdt": -7.0, "akst": -9.0, "akdt": -8.0, "hst": -10.0,
    "nst": -3.5, "ndt": -2.5, "adt": -3.0, "brt": -3.0, "aest": 10.0, "aedt": 11.0, "acst": 9.5, "acdt": 10.5,
    "awst": 8.0, "nzst": 12.0, "nzdt": 13.0, "kst": 9.0, "hkt": 8.0, "sgt": 8.0, "sast": 2.0, "wib": 7.0,
}  # fmt: skip
"""Hours east of Greenwich of zones by the letters that stand behind stamps; those that mean several are left out."""
SEVERAL = frozenset({"cst", "ist", "ast", "cdst", "gst", "sst"})
"""Letters that mean several zones: only a stated zone says which."""


@lru_cache
def offsets_h(timezone: str | None) -> Mapping[str, float]:
    """Hours east of Greenwich by letters, those of a stated zone among them as it means them."""
    return {**ZONE_OFFSETS_H, **own_letters(timezone)}


@lru_cache
def own_letters(timezone: str | None) -> Mapping[str, float]:
    """What a zone's clock calls itself in winter and summer, and its hours east of Greenwich then."""
    if timezone is None:
        return {}
    days = [datetime(datetime.now().year, month, 1, tzinfo=ZoneInfo(timezone)) for month in (1, 7)]
    known = [(day.strftime("%Z").lower(), day.utcoffset()) for day in days]
    return {name: at.total_seconds() / 3600.0 for name, at in known if at is not None and name.isalpha()}


def named_zone(text: str) -> str | None:
    """The zone at the end of a stamp or a column's name, as in '[Europe/Berlin]'; None where none is known there."""
    found = NAMED_ZONE.search(text[-60:])
    try:
        return None if found is None else ZoneInfo(found["zone"]).key
    except (ZoneInfoNotFoundError, ValueError, OSError):
        return None


def header_offset_s(name: str, timezone: str | None = None) -> float | None:
    """The offset from UTC that a time column's name states, as in 'Time (UTC+01:00)' [s]; None where none, or where
    it is what the stated zone calls itself, which may change within the export."""
    if plain(name) in ("utc", "timeutc", "utctime"):
        return 0.0
    found = HEADER_ZONE.search(name[-40:])
    if found is None or not (found["name"] or found["offset"]):
        return None
    if found["offset"] is None:
        letters = found["name"].lower()
        hours = None if letters in own_letters(timezone) else ZONE_OFFSETS_H.get(letters)
        return None if hours is None else 3600.0 * hours
    sign, digits = (-1.0 if found["offset"][0] == "-" else 1.0), found["offset"][1:].replace(":", "")
    return sign * (3600.0 * float(digits[:2]) + 60.0 * float(digits[2:] or 0))


def of_several(name: str, timezone: str | None) -> str:
    """Letters in a time column's name that mean several zones; '' where there are none, or a zone is stated."""
    found = HEADER_ZONE.search(name[-40:])
    letters = (found["name"] or "") if found is not None and timezone is None else ""
    return letters if letters.lower() in SEVERAL else ""
