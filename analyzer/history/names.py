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
    "statuscode", "status", "qual", "dataquality", "opcquality", "validity", "isgood", "good", "valid", "isvalid",
    "samplequality", "valuequality", "valuestatus", "datastatus", "pointstatus", "goodness", "opcstatus",
    "qualität", "qualitaet", "datenqualität", "status", "güte", "qualité", "qualite", "calidad", "qualità",
    "qualita", "kvalitet", "laatu", "kwaliteit", "jakość", "qualidade", "gültig", "gueltig",
)  # fmt: skip
FLAG_NAMES = ("isgood", "good", "valid", "isvalid", "validity", "gültig", "gueltig")
"""Quality columns in which 1 or true says that the sample is good."""
_QUALITIES = (
    r"data ?quality|quality(?: ?code| ?detail)?|qstatus|status|confidence|qual|validity|is ?good|is ?valid|valid"
    r"|qualität|qualitaet|qualité|calidad"
)
QUALITY_ENDING = re.compile(rf"^(?P<tag>.+?)[ ._:/-]?\(?(?:{_QUALITIES})\)?$", re.IGNORECASE)
UNIT_IN_NAME = re.compile(
    r"[\s_(\[.,-]+(?P<unit>ms|msec|s|sec|secs|seconds?|sek|sekunden|min|mins|minutes?|minuten|h|hr|hrs|hours?|std"
    r"|stunden|d|days?|tage)[)\].]*$",
    re.IGNORECASE,
)
UNITS = {
    "ms": "ms",
    "s": "s",
    "se": "s",
    "mi": "min",
    "h": "h",
    "st": "h",
    "d": "d",
    "ta": "d",
    "ho": "h",
    "hr": "h",
}
BARE_ENDINGS = frozenset({"pv", "sp", "op", "mv", "out", "mode", "pos", "position", "sv", "meas", "spt"})


def plain(name: str) -> str:
    """Name without case, units in brackets, blanks and underscores: ' Time_Stamp (UTC)' is 'timestamp'."""
    return re.sub(r"\(.*?\)|\[.*?\]|[\s_\-\"']", "", name).lower()


def time_unit(name: str) -> str:
    """The unit that a time column's name states, as in 'Time (min)' or 't_h': ms, s, min, h or d; '' where none."""
    found = UNIT_IN_NAME.search(name)
    if found is None:
        return ""
    unit = found["unit"].lower()
    return UNITS.get("ms" if unit.startswith("ms") else unit[:2], UNITS.get(unit[:1], ""))


def without_unit(name: str) -> str:
    """A time column's name without the unit that stands behind it."""
    return UNIT_IN_NAME.sub("", name)


def is_stamp(name: str) -> bool:
    """Whether a column is named as stamps are, with or without a unit behind the name."""
    return plain(name) in STAMP_NAMES or plain(without_unit(name)) in (
        *STAMP_NAMES,
        "t",
        "elapsed",
        "elapsedtime",
    )


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
