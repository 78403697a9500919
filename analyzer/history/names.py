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
    "datum", "timestampseconds", "timesecond", "tsms", "tsus", "tsns", "epoch", "epochms", "unixtime", "unix",
    "filetime", "ticks", "datenum", "serial", "julian", "julianday", "jd",
    "aika", "aikaleima", "pvm", "tid", "tidpunkt", "tidsstämpel", "dato", "tijd", "tijdstip", "horodatage", "heure",
    "dateheure", "fecha", "fechahora", "hora", "data", "dataora", "ora", "datahora", "czas", "dataczas", "čas", "cas",
    "datumačas",
)  # fmt: skip
CLOCK_NAMES = (
    "time", "timeofday", "clock", "zeit", "uhrzeit", "heure", "hora", "ora", "klo", "kello", "kl", "tid", "tijd",
    "czas", "čas",
)  # fmt: skip
FRACTIONS = {
    "ms": 1e-3, "msec": 1e-3, "millis": 1e-3, "millitm": 1e-3, "milliseconds": 1e-3, "millisecond": 1e-3,
    "timems": 1e-3, "us": 1e-6, "microseconds": 1e-6, "ns": 1e-9, "nanoseconds": 1e-9, "timestampnanooffset": 1e-9,
    "timenano": 1e-9, "offsetinnanos": 1e-9, "nanos": 1e-9,
}  # fmt: skip
"""Columns that hold the rest of a stamp below the second, and their unit [s]."""
TAG_NAMES = (
    "tagname", "tag", "tagid", "fulltagname", "pointname", "point", "pointid", "itemid", "itemname", "item",
    "varname", "variable", "signal", "tagpath", "itempath", "fullpath", "path", "parameter", "log", "logname",
    "alias", "series", "seriesname", "timeseriesid", "propertyalias", "channel", "sensor", "messstelle",
    "bezeichnung", "kennzeichen", "metric", "metricname", "field", "name", "variabel", "muuttuja", "positio",
)  # fmt: skip
VALUE_NAMES = (
    "value", "iptrendvalue", "val", "varvalue", "pointvalue", "tagvalue", "floatvalue", "reading", "wert",
    "messwert", "arvo", "valeur", "valor", "valore", "värde", "verdi", "waarde", "wartość", "hodnota",
)  # fmt: skip
QUALITY_NAMES = (
    "opcquality", "qualitydetail", "iptrendqstatus", "qstatus", "quality", "confidence", "qualitycode",
    "statuscode", "status", "qual", "dataquality", "opcquality", "validity", "isgood", "good", "valid", "isvalid",
    "samplequality", "valuequality", "valuestatus", "datastatus", "pointstatus", "goodness", "opcstatus",
    "qualität", "qualitaet", "datenqualität", "status", "güte", "qualité", "qualite", "calidad", "qualità",
    "qualita", "kvalitet", "laatu", "kwaliteit", "jakość", "qualidade", "gültig", "gueltig", "q", "dataintegrity",
    "bad", "isbad", "error", "iserror", "err", "fault", "isfault", "invalid", "questionable", "questionableflag",
)  # fmt: skip
BAD_NAMES = ("bad", "isbad", "error", "err", "fault", "invalid", "questionable", "questionableflag")
"""Quality columns in which 1 or true says that the sample is not good."""
FLAG_NAMES = ("isgood", "good", "valid", "isvalid", "validity", "gültig", "gueltig")
"""Quality columns in which 1 or true says that the sample is good."""
_QUALITIES = (
    r"(?:data|opc)? ?quality(?:[ _]?code|[ _]?detail)?|qstatus|status(?:[ _]?code)?|confidence|qual|q|validity"
    r"|(?:is[ _]?)?(?:good|valid|bad|error|fault|invalid)|err|questionable"
    r"|qualität|qualitaet|qualité|qualita|calidad|güte|gueltig|gültig|laatu|kvalitet|kwaliteit|jakość"
)
QUALITY_ENDING = re.compile(rf"^(?P<tag>.+?)[ ._:/|#-]?\(?(?:{_QUALITIES})\)?$", re.IGNORECASE)
QUALITY_BEGINNING = re.compile(
    rf"^(?:{_QUALITIES})(?: of)?[ ._:/|#-]*[(\[]?(?P<tag>.+?)[)\]]?$", re.IGNORECASE
)
LONGEST = 200
"""Characters of a name that are looked at: no tag has more, and patterns take the square of a name's length."""
UNIT_IN_NAME = re.compile(
    r"(?:^|[\s_(\[.,-]+)(?P<unit>ms|msec|s|sec|secs|seconds?|sek|sekunden|min|mins|minutes?|minuten|h|hr|hrs|hours?|std"
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
ELAPSED_NAMES = ("t", "elapsed", "elapsedtime", "")
"""Names of clocks that count from the start; a unit alone is one."""
REMARKS = frozenset({
    "annotated", "annotation", "annotations", "substituted", "comment", "comments", "remark", "marker",
})  # fmt: skip
"""Columns beside the values that are neither."""
BARE_ENDINGS = frozenset({
    "pv", "sp", "op", "mv", "out", "mode", "pos", "position", "sv", "meas", "spt", "setp", "setpoint", "cv", "co",
    "output", "sollwert", "soll", "istwert", "ist", "stellgröße", "stellgrösse", "stellgroesse", "stellwert",
})  # fmt: skip


def plain(name: str) -> str:
    """Name without case, units in brackets, blanks and underscores: ' Time_Stamp (UTC)' is 'timestamp'."""
    return re.sub(r"\([^()]*\)|\[[^\[\]]*\]|[\s_\-\"']", "", name[:LONGEST]).lower()


def time_unit(name: str) -> str:
    """The unit that a time column's name states, as in 'Time (min)' or 't_h': ms, s, min, h or d; '' where none."""
    found = UNIT_IN_NAME.search(name[:LONGEST])
    if found is None:
        return ""
    unit = found["unit"].lower()
    return UNITS.get("ms" if unit.startswith("ms") else unit[:2], UNITS.get(unit[:1], ""))


def without_unit(name: str) -> str:
    """A time column's name without the unit that stands behind it."""
    return UNIT_IN_NAME.sub("", name[:LONGEST])


def is_stamp(name: str) -> bool:
    """Whether a column is named as stamps are, with or without a unit behind the name."""
    if not plain(name):
        return False
    return plain(name) in STAMP_NAMES or plain(without_unit(name)) in (*STAMP_NAMES, *ELAPSED_NAMES)


def first_named(names: Sequence[str], wanted: Iterable[str]) -> int | None:
    """Index of the column whose plain name comes first in `wanted`, or None."""
    plains = [plain(name) for name in names]
    return next((plains.index(name) for name in wanted if name in plains), None)


def check_once(path: Path, names: Sequence[str]) -> None:
    """Raise InputError where a column's name stands twice, for then its tag is not clear."""
    name, count = max(Counter(names).items(), key=lambda item: item[1], default=("", 1))
    if count > 1:
        raise InputError(f"{path}: column '{name}' stands twice", "each tag once", "rename or remove one")


def with_loop(names: Sequence[str], stem: str) -> tuple[str, ...]:
    """Full tags: bare columns such as 'PV' and 'OP' belong to the loop that the file is named for, and a lone column
    of values to the tag that it is named for."""
    if len(names) == 1 and plain(names[0]) in VALUE_NAMES:
        return (stem,)
    if not names or not all(plain(name) in BARE_ENDINGS for name in names):
        return tuple(names)
    return tuple(f"{stem}.{plain(name).upper()}" for name in names)
