"""Values in exports: numbers, texts among numbers, blanks, text tags."""

from __future__ import annotations

import math
import re
from collections import Counter

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from analyzer.history.series import Series
from analyzer.history.table import WORDS, distinct, is_text, numbers

NUMBER_LENGTH = 100  # Length of a number at most [characters]

BLANK = "cells are blank: no value (a historian that reports by exception leaves unchanged values blank)"
ERROR_TEXTS = frozenset(WORDS["values"]["none"])
ERROR_SHAPES = re.compile(
    r"^(?:\?+|\[-?\d+\].*|#.*|[+-]?1?\.?#(?:qnan|snan|ind|inf).*|[+-]?1\.#.*|<.*>)$", re.IGNORECASE
)
"""Texts that a historian writes for a missing value."""
MINUS = str.maketrans({"\u2212": "-", "\u2013": "-", "\u2012": "-", "\ufe63": "-", "\uff0d": "-"})
"""Characters used as a minus sign."""
MINUS_BEHIND = re.compile(r"^([\d.,' \u00a0\u2007\u2009\u202f]*\d[.,]?)\s?-$")
"""A number followed by its minus."""
SPACES = re.compile("[\u00a0\u2007\u2009\u202f' ]")
"""Thousands separators, besides comma and point."""
NUMBER = re.compile(r"^[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?$")
GROUPED = {
    ".": re.compile(r"^[+-]?\d{1,3}(?:,\d{3})+(?:\.\d+)?$"),
    ",": re.compile(r"^[+-]?\d{1,3}(?:\.\d{3})+(?:,\d+)?$"),
}
"""Numbers with thousands separators, by decimal mark."""
SPACED = re.compile(r"^[+-]?\d{1,3}(?: \d{3})+(?:[.,]\d+)?$")
COMMA_FRACTION = re.compile(r"^[+-]?\d+,(?:\d{1,2}|\d{4,})(?:[eE][+-]?\d+)?$|^[+-]?0,\d+$")
"""An unambiguous decimal comma."""
WITH_UNIT = re.compile(r"^(?P<number>[+-]?[\d.,]*\d(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.,+-][^\d]{0,11})$")
SHOWN = 60
"""Characters of a text in notes."""
LIKE_NUMBER = re.compile(r"^[^\w]*\d")
"""A text that begins like a number, and was probably meant as one."""


def values(stamp_s: NDArray[np.float64], column: pa.Array, decimal: str) -> Series:
    """The samples of one column of values: bad where neither number nor mode text.

    Parameters
    ----------
    stamp_s : ndarray, shape (n,)
        Their stamps [s since 1970-01-01 UTC].
    column : pyarrow.Array, shape (n,)
        Numbers, or texts that may contain numbers.
    decimal : str
        Decimal mark of numbers in text.
    """
    if is_text(column.type):
        return _from_texts(stamp_s, column, decimal)
    value = numbers(column)
    bad = ~np.isfinite(value)
    if bad.any():
        value = np.where(bad, np.nan, value)
    return Series(stamp_s, value, bad, found=+Counter({BLANK: column.null_count}))


def _from_texts(stamp_s: NDArray[np.float64], column: pa.Array, decimal: str) -> Series:
    """Samples from texts: every distinct text is read once; the samples refer to it by index."""
    cells, place, count = distinct(column)
    kinds = [str(text or "").strip() for text in cells.to_pylist()]
    number, notes = parsed(kinds, decimal)
    read = np.isfinite(number)
    blank = np.array([text == "" for text in kinds])
    error = np.array([text.lower() in ERROR_TEXTS or ERROR_SHAPES.match(text) is not None for text in kinds])
    error, word = error & ~read, ~(read | blank | error)
    found = _as_bad(kinds, count, error) + Counter({BLANK: int(count[blank].sum())})
    found.update({note: int(count[read].sum()) for note in notes})
    unread = word & np.array([LIKE_NUMBER.match(text) is not None for text in kinds])
    lost, example = int(count[unread].sum()), next((kinds[i] for i in np.flatnonzero(unread)), "")
    if count[word].sum() * 2 > count[~blank & ~error].sum() and not lost:
        text = np.array(kinds, dtype=object)
        return Series(stamp_s, number[place], (blank | error)[place], text[place], found=found)
    found.update(_as_bad(kinds, count, word))
    return Series(stamp_s, number[place], ~read[place], None, lost, example, found)


def parsed(texts: list[str], decimal: str) -> tuple[NDArray[np.float64], list[str]]:
    """Texts as numbers, shape (n,), NaN for others; and sentences on how they were read, without their count.

    A minus may be any dash, thousands may be grouped, a unit may follow if it is the same everywhere, and an
    unambiguous decimal comma decides for the column.
    """
    plain = [MINUS_BEHIND.sub(r"-\1", text.translate(MINUS)) for text in texts]
    plain, unit = _without_unit(plain)
    notes = [f"values have the unit '{unit}' behind the number"] if unit else []
    if decimal == "." and any(COMMA_FRACTION.match(text) for text in plain):
        decimal = ","
        notes.append("values are read with a decimal comma")
    read = [_number_and_grouping(text, decimal) for text in plain]
    if any(grouped for _, grouped in read):
        mark = "comma" if decimal == "," else "point"
        notes.append(f"values are read with grouped thousands and a decimal {mark}")
    return np.array([number for number, _ in read], dtype=np.float64), notes


def _number_and_grouping(text: str, decimal: str) -> tuple[float, bool]:
    """A text as a number, NaN if it is none, and whether its thousands are grouped."""
    if len(text) > NUMBER_LENGTH:
        return math.nan, False
    spaced = SPACES.sub(" ", text)
    grouped = bool(SPACED.match(spaced)) or bool(GROUPED[decimal].match(text))
    if grouped:
        text = spaced.replace(" ", "").replace("." if decimal == "," else ",", "")
    text = text.replace(",", ".") if decimal == "," else text
    number = float(text) if NUMBER.match(text) else math.nan
    return (number, grouped) if math.isfinite(number) else (math.nan, False)


def _without_unit(texts: list[str]) -> tuple[list[str], str]:
    """The texts without a unit that follows every number, and that unit; unchanged if there is none."""
    found = [WITH_UNIT.match(text) for text in texts]
    units = {m["unit"].strip() for m in found if m is not None}
    bare = any(NUMBER.match(text.replace(",", ".")) for text in texts)
    if len(units) != 1 or bare or sum(m is not None for m in found) * 2 < len(texts) - texts.count(""):
        return texts, ""
    return [text if m is None else m["number"] for text, m in zip(texts, found, strict=True)], units.pop()


def _as_bad(kinds: list[str], count: NDArray[np.int64], which: NDArray[np.bool_]) -> Counter[str]:
    """Count of each kind of bad text, in words."""
    found: Counter[str] = Counter()
    for i in np.flatnonzero(which & (count > 0)):
        found[f"values are the text '{kinds[i][:SHOWN]}', taken as bad"] += int(count[i])
    return found
