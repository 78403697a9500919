"""Written dates to seconds: one pattern for ISO, either order of day and month, month names, offsets.

Dates of exports, of which a whole file tells what stands first where the writing leaves it open; and a time that a
person wrote in changes.csv, in loops.csv or on the command line.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.names import WORDS
from analyzer.history.plant_clock import UTC_NAME
from analyzer.history.plant_clock import utc_seconds as utc_s
from analyzer.history.zones import offsets_h
from analyzer.limits import HISTORY
from identification.errors import InputError

LETTER = r"[^\x00-@\[-`{-\x7f]"
"""A letter of a month's name: whatever is no other ASCII character. The class of all letters of Unicode would make a
pattern that takes a hundred times as long to build, and it is built for each column."""
PATTERN = (
    r"^\s*(?:(?:Mon|Tue|Wed|Thu|Fri|Sat|Sun)[a-z]*\.?,?\s+)?"
    rf"(?P<a>\d{{1,4}}|{LETTER}{{3,12}})\.?[-/. ]\s*(?P<b>\d{{1,2}}|{LETTER}{{3,12}})\.?[-/. ,]\s*"
    r"(?P<c>\d{4}|\d{2}|\d)"
    r"(?:[T ,]+(?:klo )?(?P<h>\d{1,2})[:.](?P<m>\d\d)(?:[:.](?P<s>\d\d)(?:[.,:;](?P<f>\d+))?)?"
    r"\s*(?:(?P<p>[AaPp])(?:\.?[Mm]\.?|\s*$))?)?"
    r"\s*[(\[]?(?:UTC|GMT)?\s*(?P<z>[A-Z]{1,5}|[+-]\d\d(?::?\d\d)?)?[)\]]?"
    r"(?:\s*[(\[]?(?P<n>[A-Z][A-Za-z]+/[A-Za-z_/]+|[A-Z][A-Za-z]+(?: [A-Za-z]+)+)[)\]]?)?\s*$"
)
REARRANGED = (
    (r"^(\d{4})(\d\d)(\d\d)[T ]?(\d\d):?(\d\d):?(\d\d)", r"\1-\2-\3 \4:\5:\6"),  # ISO without marks
    (rf"^{LETTER}{{2,12}}\.?,? +({LETTER}|\d+[-/.]|\d+ {LETTER})", r"\1"),  # a day of the week
    (  # ctime
        rf"^({LETTER}{{3,12}}\.?) +(\d{{1,2}}) +(\d{{1,2}}:\d\d:\d\d(?:[.,]\d+)?) +([A-Z]+ |[+-]\d{{4}} )?(\d{{4}})$",
        r"\1 \2 \5 \3 \4",
    ),
    (r"^(\d{1,2}:\d\d(?::\d\d)?(?:[.,]\d+)?),? +(\S.*\d{4})$", r"\2 \1"),  # the time of day first
    (r"[年月년월] ?(\d)", r"-\1"),
    (r"[일日]", ""),
    (r" (\d{1,2})[时時시] ?(\d\d)[分분] ?(?:(\d\d)[秒초])?$", r" \1:\2:\3"),
    (r"(\d)(?:st|nd|rd|th)\b", r"\1"),
    (r" (?:de|del) ", " "),
    (r",? (?:at|um|à|kl\.?) (\d{1,2}[:.])", r" \1"),
)
"""Writings that are brought into the form of the pattern, and what they become."""
MONTHS = {begins: int(month) for month, words in WORDS["months"].items() for begins in words}
LONGEST_MONTH = max(map(len, MONTHS))
FIRST = {"year": 0, "day": 1, "month": 2}
"""Orders in which a date can be written, by the part that stands first."""
YEAR, DAY, MONTH = FIRST.values()
OPEN = 3
"""The order of a date whose writing leaves it open, for two numbers stand in front."""
SHOWN = 40
"""Characters of a time that an error shows."""
DAY_FIRST_ZONES = ("Europe/", "Africa/", "Australia/", "Asia/")
"""Zones in which dates have the day first where figures alone would read either way."""
WITHOUT_LEAP = "so read, the stamps run without a leap"
EXAMPLE = "a time such as 2026-03-09 08:00 or 2026-03-09T08:00:00Z"


@dataclass(frozen=True, slots=True)
class Fields:
    """Parts of written stamps, arrays of shape (n,); `a`, `b`, `c` the date's parts in the order written.

    `order` is each stamp's own: one file may hold stamps of several writings. `stated` is True where a stamp states
    its zone, `short` where a year that stands last has two digits at most.
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
        """Where the writing leaves open which number is the day."""
        return np.asarray(self.readable & (self.order == OPEN))

    @property
    def year_may_begin(self) -> NDArray[np.bool_]:
        """Where a year of two digits may stand in front: 24-11-21 as 21 November 2024."""
        fits = (self.b >= 1) & (self.b <= 12) & (self.c >= 1) & (self.c <= 31)
        return np.asarray(self.open & self.short & fits)


def fields(texts: pa.Array, timezone: str | None = None) -> Fields | None:
    """Take written stamps apart, shape (n,); None where not one of them can be read.

    Letters behind stamps mean what they mean in the stated zone (IANA name), else what they mean everywhere.
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
        _number_or_month(part["a"]),
        _number_or_month(part["b"]),
        _whole_numbers(part["c"]),
        clock_s,
        offset_s,
        _readable(parts, part, known) & shown & (np.abs(offset_s) <= HISTORY.offset_s),
        _numpy(pc.not_equal(part["z"], "")),
        _written_order(part),
        _numpy(pc.less_equal(pc.utf8_length(part["c"]), 2)),
    )


def _numpy(array: pa.Array) -> NDArray[Any]:
    return np.asarray(array.to_numpy(zero_copy_only=False))


def _readable(parts: pa.Array, part: dict[str, pa.Array], known: Mapping[str, float]) -> NDArray[np.bool_]:
    """Stamps that the pattern knows, and whose zone is none of letters or words that mean nothing."""
    letters = pc.match_substring_regex(part["z"], "^[A-Z]+$")
    meant = pc.or_(pc.invert(letters), pc.is_in(pc.utf8_lower(part["z"]), value_set=pa.array(known)))
    told = pc.and_(pc.is_valid(parts), meant)
    if pc.any(pc.not_equal(part["n"], "")).as_py():
        words = pc.and_(pc.match_substring(part["n"], " "), pc.equal(part["z"], ""))
        told = pc.and_(told, pc.invert(words))
    return _numpy(told)


def stamp_seconds(parts: Fields, first: str = "month") -> NDArray[np.float64]:
    """Seconds since 1970-01-01 of the stamps, offsets removed; NaN where unreadable or no such date.

    `first` (of `FIRST`) stands first in dates whose writing leaves it open.
    """
    order = np.where(parts.order == OPEN, FIRST[first], parts.order)
    year = np.where(order == YEAR, parts.a, parts.c)
    month = np.where(order == MONTH, parts.a, parts.b)
    day = np.select([order == YEAR, order == DAY], [parts.c, parts.a], parts.b)
    short = np.where(order == YEAR, parts.order == OPEN, parts.short)
    century = np.where(year < HISTORY.century_turn, 2000, 1900)
    year = np.where(short & (year < 100), year + century, year)
    valid = parts.readable & (month >= 1) & (month <= 12) & (day >= 1)
    begins = ((year - 1970) * 12 + np.clip(month, 1, 12) - 1).astype("datetime64[M]")
    days = begins.astype("datetime64[D]").astype(np.int64) + day - 1
    next_begins = (begins + 1).astype("datetime64[D]").astype(np.int64)
    return np.where(valid & (days < next_begins), days * 86400.0 + parts.clock_s - parts.offset_s, np.nan)


def midnights_told(second: NDArray[np.float64], parts: Fields) -> NDArray[np.float64]:
    """Stamps of one file [s], whose 24:00 ends its day, or begins it where only so the stamps run on."""
    midnight = parts.clock_s == 86400.0
    if not midnight.any():
        return second
    begins = second - 86400.0 * midnight
    steps = np.diff([begins, second])
    turns = np.minimum((steps < 0).sum(axis=1), (steps > 0).sum(axis=1))
    return begins if turns[0] < turns[1] else second


def _written_order(part: dict[str, pa.Array]) -> NDArray[np.int8]:
    """The order of each stamp, as far as its writing tells."""
    digits_a, digits_b = (_numpy(pc.utf8_is_digit(part[name])) for name in "ab")
    long_a = _numpy(pc.equal(pc.utf8_length(part["a"]), 4))
    written = np.select([long_a & digits_a, ~digits_a, ~digits_b], [YEAR, MONTH, DAY], OPEN)
    return written.astype(np.int8)


def _whole_numbers(texts: pa.Array) -> NDArray[np.int64]:
    return _numpy(pc.cast(pc.if_else(pc.equal(texts, ""), "0", texts), pa.int64()))


def _number_or_month(texts: pa.Array) -> NDArray[np.int64]:
    """Numbers, and months by their names; 0 for what is neither."""
    if pc.all(pc.or_(pc.utf8_is_digit(texts), pc.equal(texts, ""))).as_py():
        return _whole_numbers(texts)
    kinds = pc.dictionary_encode(texts)
    meant = [int(t) if t.isdecimal() else _month(t.lower()) for t in kinds.dictionary.to_pylist()]
    return np.array(meant, dtype=np.int64)[_numpy(kinds.indices)]


def _month(name: str) -> int:
    begins = (name[:n] for n in range(LONGEST_MONTH, 0, -1))
    return next((MONTHS[b] for b in begins if b in MONTHS), 0)


def _clock(part: dict[str, pa.Array]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Time of day [s], 12 h clocks by their first letter; and where a clock shows it, midnight of a
    day's end and leap seconds among them."""
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


@dataclass(frozen=True, slots=True)
class DateOrder:
    """What stands first ('day', 'month' or 'year'), what decided it, and whether that is sure: else another file may
    decide."""

    first: str
    why: str
    sure: bool = True


def date_order(parts: Fields, example: str, timezone: str | None) -> DateOrder:
    """The order of all dates of a file, one of which is `example`, in a stated zone.

    Where nothing in them tells, the month first may lie ahead of us, or the day first be usual in the zone.
    """
    date = example.split(" ")[0]
    pointed = "." in date
    by_year = _with_short_year(parts, pointed and "-" not in date and "/" not in date)
    if by_year is not None:
        return by_year
    shown = shown_order(parts)
    if shown is not None:
        return shown
    if pointed:
        return DateOrder("day", "dates with points; no day above 12 occurs")
    limit = time.time() + HISTORY.ahead_s
    ahead = [bool((stamp_seconds(parts, first) > limit).any()) for first in ("day", "month")]
    usual = timezone is not None and timezone.startswith(DAY_FIRST_ZONES)
    day = ahead[1] if ahead[0] != ahead[1] else usual
    first, other = ("day", "month") if day else ("month", "day")
    return DateOrder(first, f"every date fits both orders; state --{other}-first if so", sure=False)


def shown_order(parts: Fields) -> DateOrder | None:
    """The order that a number above 12 shows, or else that in which alone the stamps run without a leap; or None."""
    first, second = ((part[parts.open] > 12).any() for part in (parts.a, parts.b))
    if first != second:
        return DateOrder(
            "day" if first else "month", f"the {'first' if first else 'second'} number exceeds 12"
        )
    known = (np.unique(stamp_seconds(parts, order)) for order in ("day", "month"))
    day, month = (np.max(np.diff(second[np.isfinite(second)]), initial=0.0) for second in known)
    return None if day == month else DateOrder("day" if day < month else "month", WITHOUT_LEAP)


def _with_short_year(parts: Fields, pointed: bool) -> DateOrder | None:
    """What is decided of dates with years of two digits that may stand in front; None where they do not.

    Dates with points have the year in front only where no other reading fits as well; of others that read several
    ways the latest counts, for exports are of late.
    """
    if not parts.open.any() or not parts.short.all() or (parts.open & ~parts.year_may_begin).any():
        return None
    limit = time.time() + HISTORY.ahead_s
    readings = {first: stamp_seconds(parts, first) for first in ("year", "day", "month")}
    possible = {
        k: found for k, found in readings.items() if np.isfinite(found).all() and found.max() <= limit
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
    why = "the year may stand in front or behind; state --date-format if it is not so"
    return DateOrder(first, why, sure=False)


def parse_time(text: str, where: str, zone: str = UTC_NAME, day_first: bool | None = None) -> float:
    """A time that a person wrote as seconds since 1970-01-01 UTC; one that states no zone is of the plant's clock.

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
    parts = fields(pa.array(trimmed, pa.string()))
    readable = np.zeros(len(texts), dtype=bool) if parts is None else parts.readable
    for at in np.flatnonzero(~readable)[:1]:
        raise InputError(f"{where[at]}: time {trimmed[at][:SHOWN]!r}", EXAMPLE, "correct the time")
    if parts is None:
        return np.empty(0)
    day, sure = _stated_order(parts, trimmed, day_first)
    local_s = np.where(day, stamp_seconds(parts, "day"), stamp_seconds(parts, "month"))
    with np.errstate(invalid="ignore"):
        of_our_time = (local_s >= HISTORY.stated_from_s) & (local_s < HISTORY.stated_to_s)
    for at in np.flatnonzero(~sure | ~of_our_time)[:1]:
        seen = f"{where[at]}: time {trimmed[at][:SHOWN]!r}"
        if not sure[at]:
            raise InputError(f"{seen} reads two ways", EXAMPLE, "write the year first, with four digits")
        raise InputError(f"{seen} is no such day", EXAMPLE, "correct the time")
    at_s = zip(local_s.tolist(), parts.stated.tolist(), strict=True)
    epoch = datetime(1970, 1, 1)
    return np.array([s if stated else utc_s(epoch + timedelta(seconds=s), zone) for s, stated in at_s])


def _stated_order(
    parts: Fields, texts: Sequence[str], stated: bool | None
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether the day stands first in each date, shape (n,), and whether that is sure."""
    either = parts.order == OPEN
    if stated is not None:
        return either & stated, np.ones(len(texts), dtype=bool)
    above = (parts.a > 12) != (parts.b > 12)
    pointed = np.array(["." in text.split(" ")[0] for text in texts]) | (parts.a == parts.b)
    return either & np.where(above, parts.a > 12, pointed), ~either | (
        ~parts.year_may_begin & (above | pointed)
    )
