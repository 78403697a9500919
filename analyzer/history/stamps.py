"""Written dates to seconds: one pattern for ISO, either order of day and month, month names, offsets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.zone_names import offsets_h

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
MONTHS = pa.array(  # three letters each: English, German, French, Spanish, Italian, Portuguese, Dutch, Swedish, ...
    [
        *("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"),
        *("jan", "feb", "mär", "apr", "mai", "jun", "jul", "aug", "sep", "okt", "nov", "dez"),
        *("jan", "fév", "mar", "avr", "mai", "jui", "jul", "aoû", "sep", "oct", "nov", "déc"),
        *("ene", "feb", "mar", "abr", "may", "jun", "jul", "ago", "sep", "oct", "nov", "dic"),
        *("gen", "feb", "mar", "apr", "mag", "giu", "lug", "ago", "set", "ott", "nov", "dic"),
        *("jan", "fev", "mar", "abr", "mai", "jun", "jul", "ago", "set", "out", "nov", "dez"),
        *("jan", "feb", "mrt", "apr", "mei", "jun", "jul", "aug", "sep", "okt", "nov", "dec"),
        *("jan", "feb", "mar", "apr", "maj", "jun", "jul", "aou", "sep", "okt", "nov", "des"),
        *("tam", "hel", "maa", "huh", "tou", "kes", "hei", "elo", "syy", "lok", "marras", "jou"),  # Finnish
        *("sty", "lut", "mar", "kwi", "maj", "cze", "lip", "sie", "wrz", "paź", "lis", "gru"),  # Polish
        *("янв", "фев", "мар", "апр", "май", "июн", "июл", "авг", "сен", "окт", "ноя", "дек"),
        *("січ", "лют", "бер", "кві", "тра", "чер", "лип", "сер", "вер", "жов", "лис", "гру"),
        *("oca", "şub", "mar", "nis", "may", "haz", "tem", "ağu", "eyl", "eki", "kas", "ara"),
        *("ian", "feb", "mar", "apr", "mai", "iun", "iul", "aug", "sep", "oct", "noi", "dec"),
        *("jan", "feb", "már", "ápr", "máj", "jún", "júl", "ágú", "sze", "okt", "nóv", "dec"),
        *("ιαν", "φεβ", "μαρ", "απρ", "μαΐ", "ιουν", "ιουλ", "αυγ", "σεπ", "οκτ", "νοε", "δεκ"),
        *("sau", "vas", "kov", "bal", "geg", "bir", "lie", "rugp", "rugs", "spa", "lap", "gru"),
        *("jan", "feb", "mrz", "apr", "мая", "cze", "lip", "avg", "sep", "okt", "nov", "dec"),
        *("led", "úno", "bře", "dub", "kvě", "čer", "čvc", "srp", "zář", "říj", "lis", "pro"),  # Czech
    ]
)
CENTURY_TURN = 70
MOST_OFFSET_S = 14 * 3600.0
"""No zone is further from UTC [s]."""


YMD, DMY, MDY, OPEN = 0, 1, 2, 3
"""Orders in which a date can be written; OPEN where two numbers below 13 leave day and month open."""


@dataclass(frozen=True, slots=True)
class Fields:
    """Parts of written stamps, arrays of shape (n,); `a`, `b`, `c` the date's parts in the order written.

    `order` is each stamp's own: one file may hold stamps of several writings. `short` is True where a year that
    stands last has two digits at most.
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
    def zoned(self) -> bool:
        """Whether any stamp states its zone."""
        return bool(self.stated.any())

    @property
    def short_year(self) -> bool:
        """Whether no year, if it stands last, has more than two digits."""
        return bool(self.short.all())

    @property
    def is_open(self) -> bool:
        """Whether the writing leaves open which number is the day."""
        return bool((self.readable & (self.order == OPEN)).any())


def fields(texts: pa.Array, timezone: str | None = None) -> Fields | None:
    """Take written stamps apart; None where not one of them can be read.

    Parameters
    ----------
    texts : pyarrow.Array of str, shape (n,)
    timezone : str or None
        IANA name of the stated zone, whose letters behind stamps mean what they mean there.
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
        _number(part["c"]),
        clock_s,
        offset_s,
        _readable(parts, part, known) & shown & (np.abs(offset_s) <= MOST_OFFSET_S),
        pc.not_equal(part["z"], "").to_numpy(zero_copy_only=False),
        _written_order(part),
        pc.less_equal(pc.utf8_length(part["c"]), 2).to_numpy(zero_copy_only=False),
    )


def _readable(parts: pa.Array, part: dict[str, pa.Array], known: Mapping[str, float]) -> NDArray[np.bool_]:
    """Stamps that the pattern knows, and whose zone is none of letters or words that mean nothing."""
    letters = pc.match_substring_regex(part["z"], "^[A-Z]+$")
    meant = pc.or_(pc.invert(letters), pc.is_in(pc.utf8_lower(part["z"]), value_set=pa.array(known)))
    told = pc.and_(pc.is_valid(parts), meant)
    if pc.any(pc.not_equal(part["n"], "")).as_py():
        words = pc.and_(pc.match_substring(part["n"], " "), pc.equal(part["z"], ""))
        told = pc.and_(told, pc.invert(words))
    return np.asarray(told.to_numpy(zero_copy_only=False))


def seconds(parts: Fields, day_first: bool, year_first: bool = False) -> NDArray[np.float64]:
    """Seconds since 1970-01-01 of the stamps, offsets removed; NaN where unreadable or no such date."""
    undecided = DMY if day_first else MDY
    order = np.where(parts.order == OPEN, YMD if year_first else undecided, parts.order)
    year = np.where(order == YMD, parts.a, parts.c)
    month = np.where(order == MDY, parts.a, parts.b)
    day = np.select([order == YMD, order == DMY], [parts.c, parts.a], parts.b)
    short = np.where(order == YMD, parts.order == OPEN, parts.short)
    century = np.where(year < CENTURY_TURN, 2000, 1900)
    year = np.where(short & (year < 100), year + century, year)
    valid = parts.readable & (month >= 1) & (month <= 12) & (day >= 1)
    first = ((year - 1970) * 12 + np.clip(month, 1, 12) - 1).astype("datetime64[M]")
    days = first.astype("datetime64[D]").astype(np.int64) + day - 1
    next_first = (first + 1).astype("datetime64[D]").astype(np.int64)
    return np.where(valid & (days < next_first), days * 86400.0 + parts.clock_s - parts.offset_s, np.nan)


def midnights_told(second: NDArray[np.float64], parts: Fields) -> NDArray[np.float64]:
    """Stamps of one file [s], whose 24:00 ends its day, or begins it where only so the stamps run on."""
    midnight = parts.clock_s == 86400.0
    if not midnight.any():
        return second
    begins = second - 86400.0 * midnight
    return begins if _turns(begins) < _turns(second) else second


def _turns(second: NDArray[np.float64]) -> int:
    """Steps against the run of the stamps."""
    step = np.diff(second)
    return int(min((step < 0).sum(), (step > 0).sum()))


def may_be_year_first(parts: Fields) -> bool:
    """Whether all dates may have a year of two digits in front: 24-11-21 as 21 November 2024."""
    either = parts.readable & (parts.order == OPEN)
    b, c = parts.b[either], parts.c[either]
    short = (c < 100).all() and parts.short_year
    return bool(
        either.any() and short and (b >= 1).all() and (b <= 12).all() and (c >= 1).all() and (c <= 31).all()
    )


def days_seen(parts: Fields) -> bool | None:
    """True where a first number above 12 shows day first, False where a second one does not, else None."""
    either = parts.readable & (parts.order == OPEN)
    first, second = (parts.a[either] > 12).any(), (parts.b[either] > 12).any()
    return None if first == second else bool(first)


def days_by_gaps(parts: Fields) -> bool | None:
    """True where read day first the stamps run without a leap, False where month first they do, None where alike."""
    day, month = (_largest_gap(parts, first) for first in (True, False))
    return None if day == month else day < month


def _largest_gap(parts: Fields, day_first: bool) -> float:
    second = np.unique(seconds(parts, day_first))
    steps = np.diff(second[np.isfinite(second)])
    return float(steps.max()) if len(steps) else 0.0


def _written_order(part: dict[str, pa.Array]) -> NDArray[np.int8]:
    """The order of each stamp, as far as its writing tells."""
    digits_a, digits_b = (pc.utf8_is_digit(part[name]).to_numpy(zero_copy_only=False) for name in "ab")
    long_a = pc.equal(pc.utf8_length(part["a"]), 4).to_numpy(zero_copy_only=False)
    written = np.select([long_a & digits_a, ~digits_a, ~digits_b], [YMD, MDY, DMY], OPEN)
    return written.astype(np.int8)


def _number(texts: pa.Array) -> NDArray[np.int64]:
    filled = pc.if_else(pc.equal(texts, ""), "0", texts)
    return pc.cast(filled, pa.int64()).to_numpy(zero_copy_only=False)


def _number_or_month(texts: pa.Array) -> NDArray[np.int64]:
    digits = pc.utf8_is_digit(texts)
    numbers = _number(pc.if_else(digits, texts, "0"))
    if pc.all(pc.or_(digits, pc.equal(texts, ""))).as_py():
        return numbers
    short = pc.replace_substring_regex(pc.utf8_lower(texts), "^jui[ln].*", "jul")
    short = pc.if_else(pc.starts_with(pc.utf8_lower(texts), "juin"), "jun", short)
    short = pc.replace_substring_regex(short, "^červenec.*", "čvc")
    short = pc.replace_substring_regex(
        short, "^marras.*", "nov"
    )  # Finnish; three letters of it are March elsewhere
    long = pc.match_substring_regex(short, "^(?:ιου|rug)")
    place = pc.index_in(pc.utf8_slice_codeunits(short, 0, 3), MONTHS)
    place = pc.if_else(long, pc.index_in(pc.utf8_slice_codeunits(short, 0, 4), MONTHS), place)
    months = pc.fill_null(place, -1).to_numpy(zero_copy_only=False).astype(np.int64)
    return np.where(months < 0, numbers, months % 12 + 1)


def _clock(part: dict[str, pa.Array]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Time of day [s], 12 h clocks by their first letter; and where a clock shows it, midnight of a
    day's end and leap seconds among them."""
    hour, minute, second = (_number(part[name]) for name in "hms")
    letter = pc.utf8_lower(part["p"])
    noon = pc.equal(letter, "p").to_numpy(zero_copy_only=False)
    twelve_hours = pc.not_equal(letter, "").to_numpy(zero_copy_only=False)
    shown = (hour < np.where(twelve_hours & ~noon, 13, 24)) & (minute < 60) & (second <= 60)
    shown |= (hour == 24) & (minute == 0) & (second == 0) & ~twelve_hours
    hour = np.where(twelve_hours, hour % 12 + 12 * noon, hour)
    fraction = pc.cast(pc.binary_join_element_wise("0.", part["f"], "0", ""), pa.float64())
    return 3600 * hour + 60 * minute + second + fraction.to_numpy(zero_copy_only=False), shown


def _offset(zone: pa.Array, known: Mapping[str, float]) -> NDArray[np.float64]:
    """Offset from UTC [s]; 0 where none is written."""
    place = pc.index_in(pc.utf8_lower(zone), value_set=pa.array(known)).to_numpy(zero_copy_only=False)
    hours = np.array([*known.values(), 0.0])
    named = hours[np.where(np.isnan(place), len(known), np.nan_to_num(place)).astype(int)]
    digits = pc.replace_substring_regex(zone, r"^[A-Z]+$|[+:-]", "")
    hour, minute = (
        _number(pc.utf8_slice_codeunits(digits, 0, 2)),
        _number(pc.utf8_slice_codeunits(digits, 2, 4)),
    )
    west = pc.starts_with(zone, "-").to_numpy(zero_copy_only=False)
    return 3600.0 * named + np.where(west, -1.0, 1.0) * (3600 * hour + 60 * minute)
