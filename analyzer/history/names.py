"""What the columns of exports are called, whichever historian wrote them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from identification.errors import InputError

STAMP_NAMES = (
    "timestamp", "datetime", "iptrendtime", "tstamp", "dateandtime", "date/time", "sampletime", "timestring",
    "timeutc", "utctime", "utc", "localtime", "time", "ts", "date", "zeitstempel", "datumzeit", "zeit",
    "datum",
)  # fmt: skip
CLOCK_NAMES = ("time", "timeofday", "clock", "zeit", "uhrzeit", "heure", "hora")
TAG_NAMES = (
    "tagname", "tag", "tagid", "fulltagname", "pointname", "point", "pointid", "itemid", "itemname", "item",
    "varname", "variable", "signal", "tagpath", "name",
)  # fmt: skip
VALUE_NAMES = (
    "value", "iptrendvalue", "val", "varvalue", "pointvalue", "tagvalue", "floatvalue", "reading", "wert",
)  # fmt: skip
QUALITY_NAMES = (
    "opcquality", "qualitydetail", "iptrendqstatus", "qstatus", "quality", "confidence", "qualitycode",
    "statuscode", "status", "qual",
)  # fmt: skip
QUALITY_ENDING = re.compile(r"^(?P<tag>.+?)[ ._:/-]?\(?(?:quality|qstatus|status|confidence|qual)\)?$", re.I)
BARE_ENDINGS = frozenset({"pv", "sp", "op", "mv", "out", "mode", "pos", "position", "sv", "meas", "spt"})


def plain(name: str) -> str:
    """Name without case, units in brackets, blanks and underscores: ' Time_Stamp (UTC)' is 'timestamp'."""
    return re.sub(r"\(.*?\)|\[.*?\]|[\s_\-\"']", "", name).lower()


def first_named(names: Sequence[str], wanted: Iterable[str]) -> int | None:
    """Index of the column whose plain name comes first in `wanted`, or None."""
    plains = [plain(name) for name in names]
    return next((plains.index(name) for name in wanted if name in plains), None)


def quality_partners(names: Sequence[str]) -> dict[str, str]:
    """Value column to its quality column, in wide tables: 'FIC101.PV' to 'FIC101.PV.quality' and the like."""
    present = set(names)
    matches = ((name, QUALITY_ENDING.match(name)) for name in names)
    return {m["tag"]: name for name, m in matches if m and m["tag"] in present}


def check_once(path: Path, names: Sequence[str]) -> None:
    """Raise InputError where a column's name stands twice, for then its tag is not clear."""
    name, count = max(Counter(names).items(), key=lambda item: item[1], default=("", 1))
    if count > 1:
        raise InputError(f"{path}: column '{name}' stands twice", "each tag once", "rename or remove one")


def with_loop(names: Sequence[str], stem: str) -> tuple[str, ...]:
    """Full tags: bare columns such as 'PV' and 'OP' belong to the loop that the file is named for."""
    if not names or not all(plain(name) in BARE_ENDINGS for name in names):
        return tuple(names)
    return tuple(f"{stem}.{plain(name).upper()}" for name in names)
