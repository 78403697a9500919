"""Zones as letters or hours, behind stamps and in the names of their columns."""

from __future__ import annotations

import re

from analyzer.history.names import plain

HEADER_ZONE = re.compile(
    r"(?:^|[\s(\[_])(?P<name>UTC|GMT|Z|CEST|CET|EEST|EET)?\s*(?P<offset>[+-]\d{1,2}(?::?\d\d)?)?[)\]]?\s*$",
    re.IGNORECASE,
)
ZONE_OFFSETS_H = {
    "z": 0.0, "utc": 0.0, "gmt": 0.0, "wet": 0.0, "west": 1.0, "bst": 1.0, "cet": 1.0, "met": 1.0, "mez": 1.0,
    "cest": 2.0, "mest": 2.0, "mesz": 2.0, "eet": 2.0, "eest": 3.0, "msk": 3.0, "jst": 9.0, "est": -5.0, "edt": -4.0,
    "cdt": -5.0, "mst": -7.0, "mdt": -6.0, "pst": -8.0, "pdt": -7.0,
}  # fmt: skip
"""Hours east of Greenwich of zones by the letters that stand behind stamps; those that mean several are left out."""


def header_offset_s(name: str) -> float | None:
    """The offset from UTC that a time column's name states, as in 'Time (UTC+01:00)' [s]; None where none."""
    if plain(name) in ("utc", "timeutc", "utctime"):
        return 0.0
    found = HEADER_ZONE.search(name[-40:])
    if found is None or not (found["name"] or found["offset"]):
        return None
    if found["offset"] is None:
        return 3600.0 * ZONE_OFFSETS_H[found["name"].lower()]
    sign, digits = (-1.0 if found["offset"][0] == "-" else 1.0), found["offset"][1:].replace(":", "")
    return sign * (3600.0 * float(digits[:2]) + 60.0 * float(digits[2:] or 0))
