"""Written dates to seconds: one pattern for ISO, either order of day and month, month names, offsets and zones.

For dates of exports, and for times that a user wrote in changes.csv, in loops.csv or on the command line.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import lru_cache
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.plant_clock import UTC_NAME
from analyzer.history.plant_clock import utc_seconds as utc_s
from analyzer.history.table import WORDS, plain
from identification.errors import InputError

STATED_FROM_S = 0.0  # Times before it are no changes of settings, counted from 1970 [s]
STATED_TO_S = 4102444800.0  # Times from it on are no changes of settings [s]: the year 2100
CENTURY_TURN = 70  # Years of two figures from which on they are of the 1900s: no export is older
OFFSET_S = 50400.0  # Largest offset from UTC in a stamp [s]. Source: no zone is further: 14 h

LETTER = r"[^\x00-@\[-`{-\x7f]"
"""A letter of a month's name: any character except other ASCII ones. The class of all Unicode letters would make a
pattern that takes a hundred times as long to build, and it is built for each column."""
PATTERN = (
    r"^\s*(?:(?:Mon|Tue|Wed|Thu|Fri|Sat|Sun)[a-z]*\.?,?\s+)?"
    rf"(?P<a>\d{{1,4}}|{LETTER}{{3,12}})\.?[-/. ]\s*(?P<b>\d{{1,2}}|{LETTER}{{3,12}})\.?[-/. ,]\s*"
    r"(?P<c>\d{4}|\d{2}|\d)"
    r"(?:[T ,]+(?:klo )?(?P<h>\d{1,2})[:.](?P<m>\d\d)(?:[:.](?P<s>\d\d)(?:[.,:;](?P<f>\d+))?)?"
    r"\s*(?:(?P<p>[AaPp])(?:\.?[Mm]\.?|\s*$))?)?"
    r"\s*[(\[]?(?:UTC|GMT)?\s*(?P<z>[A-Z]{1,5}|[+-]\d\d(?::?\d\d)?)?[)\]]?"
    r"(?:\s*[(\[]?(?P<n>[A-Z][A-Za-z]+/[A-Za-z_/]+|[A-Z][A-Za-z]*\.?(?: [A-Za-z.]+)+)[)\]]?)?\s*$"
)
REARRANGED = [(way["written"].replace("LETTER", LETTER), way["meant"]) for way in WORDS["rearranged"]]
"""Formats that are converted to the form of the pattern, and the results."""
CROATIAN = dict(zip(WORDS["croatian"]["names"], WORDS["croatian"]["months"], strict=True))
CROATIAN_ALONE = tuple(WORDS["croatian"]["alone"])
CROATIAN_ZONES = frozenset(WORDS["croatian"]["zones"])
MONTHS = {begins: int(month) for month, words in WORDS["months"].items() for begins in words}
LONGEST_MONTH = max(map(len, MONTHS))
FIRST = {"year": 0, "day": 1, "month": 2}
"""Orders of a date, by the first part."""
YEAR, DAY, MONTH = FIRST.values()
OPEN = 3
"""The order of an ambiguous date, with two numbers in front."""
SHOWN = 40
"""Characters of a time in an error message."""
EXAMPLE = "a time such as 2026-03-09 08:00 or 2026-03-09T08:00:00Z"
HEADER_ZONE = re.compile(
    r"(?:^|[\s(\[_])(?P<name>(?i:UTC|GMT|Z|CEST|CET|EEST|EET)|[A-Z]{3,5})?"
    r"\s*(?P<offset>[+-]\d{1,2}(?::?\d\d)?)?[)\]]?\s*$"
)
NAMED_ZONE = re.compile(r"(?P<zone>[A-Z][A-Za-z]+/[A-Za-z_]+(?:/[A-Za-z_]+)?)[)\]]?\s*$")
"""A zone of the database of time zones at the end of a stamp or a column's name."""
ZONE_WORDS = {words.lower(): zone for words, zone in WORDS["zone_words"].items()}
WORDED_ZONE = re.compile(
    r"(?P<words>[A-Z][A-Za-z.]*(?: [A-Z][A-Za-z.]*)*) (?:Standard|Summer|Daylight) Time[)\]]?\s*$"
)
OFFSETS_H = {name: float(hours) for hours, names in WORDS["zone_letters"]["hours"].items() for name in names}
SEVERAL = frozenset(WORDS["zone_letters"]["several"])


@lru_cache
def offsets_h(timezone: str | None) -> Mapping[str, float]:
    """Hours east of Greenwich by letters, including those of a stated zone in its own meaning."""
    return {**OFFSETS_H, **own_letters(timezone)}


@lru_cache
def own_letters(timezone: str | None) -> Mapping[str, float]:
    """Abbreviations of a zone in winter and summer, and its hours east of Greenwich then."""
    if timezone is None:
        return {}
    days = [datetime(datetime.now().year, month, 1, tzinfo=ZoneInfo(timezone)) for month in (1, 7)]
    known = [(day.strftime("%Z").lower(), day.utcoffset()) for day in days]
    return {name: at.total_seconds() / 3600.0 for name, at in known if at is not None and name.isalpha()}


def named_zone(text: str) -> str | None:
    """The zone at the end of a stamp or a column's name, as in '[Europe/Berlin]' or 'W. Europe Standard Time'; None
    if no known zone is there."""
    worded = WORDED_ZONE.search(text[-60:])
    for k in range(len(words := worded["words"].split(" ")) if worded is not None else 0):
        if (zone := ZONE_WORDS.get(" ".join(words[k:]).lower())) is not None:
            return zone
    found = NAMED_ZONE.search(text[-60:])
    try:
        return None if found is None else ZoneInfo(found["zone"]).key
    except (ZoneInfoNotFoundError, ValueError, OSError):
        return None


def header_zone(name: str, timezone: str | None = None) -> tuple[float | None, str]:
    """The offset from UTC in a time column's name, as in 'Time (UTC+01:00)' [s]; None if there is none, or if it is
    an abbreviation of the stated zone, which may change within the export. And letters there that mean several zones;
    '' if there are none, or a zone is stated."""
    if plain(name) in ("utc", "timeutc", "utctime"):
        return 0.0, ""
    found = HEADER_ZONE.search(name[-40:])
    letters = "" if found is None else found["name"] or ""
    several = letters if timezone is None and letters.lower() in SEVERAL else ""
    if found is None or found["offset"] is None:
        own = letters.lower() in own_letters(timezone)
        hours = None if own else OFFSETS_H.get(letters.lower())
        return None if hours is None else 3600.0 * hours, several
    sign, digits = (-1.0 if found["offset"][0] == "-" else 1.0), found["offset"][1:].replace(":", "")
    return sign * (3600.0 * float(digits[:2]) + 60.0 * float(digits[2:] or 0)), several


@dataclass(frozen=True, slots=True)
class Fields:
    """Parts of written stamps, arrays of shape (n,); `a`, `b`, `c` the date's parts in the order written.

    `order` is that of each stamp, because one file may have several formats. `stated` is True where a stamp states
    its zone, `short` where the last part is a year of at most two digits.
    """

    a: NDArray[np.int64]
    b: NDArray[np.int64]
    c: NDArray[np.int64]
    clock_s: NDArray[np.float64]
    offset_s: NDArray[np.float64]
    readable: NDArray[np.bool_]
    stated: NDArray[np.bool_]
    order: NDArray[np.int8]
    short: NDArray[np.bool_]

    @property
    def open(self) -> NDArray[np.bool_]:
        """Where it is ambiguous which number is the day."""
        return np.asarray(self.readable & (self.order == OPEN))

    @property
    def year_may_begin(self) -> NDArray[np.bool_]:
        """Where a year of two digits may be first: 24-11-21 as 21 November 2024."""
        fits = (self.b >= 1) & (self.b <= 12) & (self.c >= 1) & (self.c <= 31)
        return np.asarray(self.open & self.short & fits)


def fields(texts: pa.Array, timezone: str | None = None) -> Fields | None:
    """Parse written stamps, shape (n,); None if none of them can be read.

    Letters after stamps have their meaning in the stated zone (IANA name), else their general meaning.
    """
    parts = pc.extract_regex(texts, PATTERN)
    if parts.null_count > texts.null_count:
        other = texts
        for written, meant in REARRANGED:
            other = pc.replace_substring_regex(other, written, meant)
        parts = pc.extract_regex(pc.if_else(pc.is_valid(parts), texts, other), PATTERN)
    if parts.null_count == len(parts):
        return None
    part = {name: pc.fill_null(pc.struct_field(parts, name), "") for name in "abchmsfpzn"}
    known = offsets_h(timezone)
    offset_s = _offset(part["z"], known)
    clock_s, shown = _clock(part)
    return Fields(
        _number_or_month(part["a"], timezone),
        _number_or_month(part["b"], timezone),
        _whole_numbers(part["c"]),
        clock_s,
        offset_s,
        _readable(parts, part, known) & shown & (np.abs(offset_s) <= OFFSET_S),
        _numpy(pc.not_equal(part["z"], "")),
        _written_order(part),
        _numpy(pc.less_equal(pc.utf8_length(part["c"]), 2)),
    )


def _numpy(array: pa.Array) -> NDArray[Any]:
    return np.asarray(array.to_numpy(zero_copy_only=False))


def _readable(parts: pa.Array, part: dict[str, pa.Array], known: Mapping[str, float]) -> NDArray[np.bool_]:
    """Stamps that match the pattern, without unknown letters or words as zone."""
    letters = pc.match_substring_regex(part["z"], "^[A-Z]+$")
    meant = pc.or_(pc.invert(letters), pc.is_in(pc.utf8_lower(part["z"]), value_set=pa.array(known)))
    readable = pc.and_(pc.is_valid(parts), meant)
    if pc.any(pc.not_equal(part["n"], "")).as_py():
        words = pc.and_(pc.match_substring(part["n"], " "), pc.equal(part["z"], ""))
        kinds = pc.unique(part["n"])
        unknown = kinds.filter(pa.array([named_zone(text) is None for text in kinds.to_pylist()]))
        words = pc.and_(words, pc.is_in(part["n"], value_set=unknown))
        readable = pc.and_(readable, pc.invert(words))
    return _numpy(readable)


def stamp_seconds(parts: Fields, first: str = "month") -> NDArray[np.float64]:
    """Seconds since 1970-01-01 of the stamps, offsets removed; NaN where unreadable or no such date.

    `first` (of `FIRST`) is the first part of ambiguous dates.
    """
    order = np.where(parts.order == OPEN, FIRST[first], parts.order)
    year = np.where(order == YEAR, parts.a, parts.c)
    month = np.where(order == MONTH, parts.a, parts.b)
    day = np.select([order == YEAR, order == DAY], [parts.c, parts.a], parts.b)
    short = np.where(order == YEAR, parts.order == OPEN, parts.short)
    century = np.where(year < CENTURY_TURN, 2000, 1900)
    year = np.where(short & (year < 100), year + century, year)
    valid = parts.readable & (month >= 1) & (month <= 12) & (day >= 1)
    begins = ((year - 1970) * 12 + np.clip(month, 1, 12) - 1).astype("datetime64[M]")
    days = begins.astype("datetime64[D]").astype(np.int64) + day - 1
    next_begins = (begins + 1).astype("datetime64[D]").astype(np.int64)
    return np.where(valid & (days < next_begins), days * 86400.0 + parts.clock_s - parts.offset_s, np.nan)


def with_midnights(second: NDArray[np.float64], parts: Fields) -> NDArray[np.float64]:
    """Stamps of one file [s]; 24:00 is the end of its day, or its beginning if only then the stamps increase."""
    midnight = parts.clock_s == 86400.0
    if not midnight.any():
        return second
    begins = second - 86400.0 * midnight
    steps = np.diff([begins, second])
    turns = np.minimum((steps < 0).sum(axis=1), (steps > 0).sum(axis=1))
    return begins if turns[0] < turns[1] else second


def _written_order(part: dict[str, pa.Array]) -> NDArray[np.int8]:
    """The order of each stamp, as far as it is unambiguous."""
    digits_a, digits_b = (_numpy(pc.utf8_is_digit(part[name])) for name in "ab")
    long_a = _numpy(pc.equal(pc.utf8_length(part["a"]), 4))
    written = np.select([long_a & digits_a, ~digits_a, ~digits_b], [YEAR, MONTH, DAY], OPEN)
    return written.astype(np.int8)


def _whole_numbers(texts: pa.Array) -> NDArray[np.int64]:
    return _numpy(pc.cast(pc.if_else(pc.equal(texts, ""), "0", texts), pa.int64()))


def _number_or_month(texts: pa.Array, timezone: str | None) -> NDArray[np.int64]:
    """Numbers, and months by their names; 0 for others."""
    if pc.all(pc.or_(pc.utf8_is_digit(texts), pc.equal(texts, ""))).as_py():
        return _whole_numbers(texts)
    kinds = pc.dictionary_encode(texts)
    names = [name.lower() for name in kinds.dictionary.to_pylist()]
    croatian = timezone in CROATIAN_ZONES or any(name.startswith(CROATIAN_ALONE) for name in names)
    known = {**MONTHS, **CROATIAN} if croatian else MONTHS
    meant = [int(name) if name.isdecimal() else _month(name, known) for name in names]
    return np.array(meant, dtype=np.int64)[_numpy(kinds.indices)]


def _month(name: str, known: Mapping[str, int]) -> int:
    begins = (name[:n] for n in range(LONGEST_MONTH, 0, -1))
    return next((known[b] for b in begins if b in known), 0)


def _clock(part: dict[str, pa.Array]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Time of day [s], 12 h clocks by their first letter; and where it is valid, including midnight at the end of a
    day and leap seconds."""
    hour, minute, second = (_whole_numbers(part[name]) for name in "hms")
    letter = pc.utf8_lower(part["p"])
    noon = _numpy(pc.equal(letter, "p"))
    twelve_hours = _numpy(pc.not_equal(letter, ""))
    shown = (hour < np.where(twelve_hours & ~noon, 13, 24)) & (minute < 60) & (second <= 60)
    shown |= (hour == 24) & (minute == 0) & (second == 0) & ~twelve_hours
    hour = np.where(twelve_hours, hour % 12 + 12 * noon, hour)
    fraction = pc.cast(pc.binary_join_element_wise("0.", part["f"], "0", ""), pa.float64())
    return 3600 * hour + 60 * minute + second + _numpy(fraction), shown


def _offset(zone: pa.Array, known: Mapping[str, float]) -> NDArray[np.float64]:
    """Offset from UTC [s]; 0 where none is written."""
    place = pc.index_in(pc.utf8_lower(zone), value_set=pa.array(known))
    named = np.array([*known.values(), 0.0])[_numpy(pc.fill_null(place, len(known)))]
    digits = pc.replace_substring_regex(zone, r"^[A-Z]+$|[+:-]", "")
    hour, minute = (_whole_numbers(pc.utf8_slice_codeunits(digits, k, k + 2)) for k in (0, 2))
    west = _numpy(pc.starts_with(zone, "-"))
    return 3600.0 * named + np.where(west, -1.0, 1.0) * (3600 * hour + 60 * minute)


def parse_time(text: str, where: str, zone: str = UTC_NAME, day_first: bool | None = None) -> float:
    """A time written by a user as seconds since 1970-01-01 UTC; without a stated zone on the plant's clock.

    Parameters
    ----------
    text : str
        ISO, or a format of exports; dates with points have the day first.
    where : str
        Location for the error message.
    zone : str
        The plant's time zone.
    day_first : bool or None
        Order of dates such as 03/04/2026; None: unknown, and such dates are rejected.

    Raises
    ------
    InputError
        It is no time, is ambiguous, or is outside 1970 to 2099.
    """
    return float(parse_times([text], [where], zone, day_first)[0])


def parse_times(
    texts: Sequence[str], where: Sequence[str], zone: str = UTC_NAME, day_first: bool | None = None
) -> NDArray[np.float64]:
    """The same for one or more times at once, shape (n,); the first invalid or ambiguous one raises."""
    trimmed = [text.strip() for text in texts]
    parts = fields(pa.array(trimmed, pa.string()))

    def refused(at: int, why: str = "", remedy: str = "correct the time") -> InputError:
        return InputError(f"{where[at]}: time {trimmed[at][:SHOWN]!r}{why}", EXAMPLE, remedy)

    if parts is None or not parts.readable.all():
        raise refused(0 if parts is None else int(np.argmin(parts.readable)))
    either, above = parts.order == OPEN, (parts.a > 12) != (parts.b > 12)
    pointed = np.array(["." in text.split(" ")[0] for text in trimmed]) | (parts.a == parts.b)
    day = either & (np.where(above, parts.a > 12, pointed) if day_first is None else day_first)
    unsure = either & (day_first is None) & (parts.year_may_begin | ~(above | pointed))
    local_s = np.where(day, stamp_seconds(parts, "day"), stamp_seconds(parts, "month"))
    with np.errstate(invalid="ignore"):
        of_our_time = (local_s >= STATED_FROM_S) & (local_s < STATED_TO_S)
    for at in np.flatnonzero(unsure | ~of_our_time)[:1].tolist():
        if unsure[at]:
            raise refused(at, " reads two ways", "write the year first, with four digits")
        raise refused(at, " is no such day")
    at_s = zip(local_s.tolist(), parts.stated.tolist(), strict=True)
    epoch = datetime(1970, 1, 1)
    return np.array([s if stated else utc_s(epoch + timedelta(seconds=s), zone) for s, stated in at_s])
