"""Values as they stand in exports: numbers, texts among numbers, blanks, text tags."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.clock import is_text

BLANK = "cells are blank: no value (a historian that reports by exception leaves unchanged values blank)"
ERROR_TEXTS = frozenset({
    "i/o timeout", "bad input", "bad", "bad data", "bad quality", "no data", "pt created",
    "point created", "scan off", "scan timeout", "calc failed", "calc crash", "calc off",
    "resize to show all values", "no good data for calculation", "not connect", "not connected",
    "comm fail", "comm error", "conf error", "configure", "intf shut", "shutdown", "out of serv",
    "out of service", "over range", "under range", "over ucl", "under lcl", "invalid", "invalid float",
    "invalid data", "data loss", "access denied", "no access", "no result", "no sample", "no alarm data",
    "not available", "unavailable", "unknown", "error", "failed", "failure", "timeout", "disconnected",
    "equip fail", "trace off", "doubtful", "sampled bad", "arc off-line", "arc offline", "dcs failed",
    "ptfailed", "nan", "-nan", "null", "none", "na", "n/a", "nil", "inf", "-inf", "+inf", "infinity",
    "-infinity", "-", "--", "---", "*", "***", "x",
})  # fmt: skip
ERROR_SHAPES = re.compile(
    r"^(?:\?+|\[-?\d+\].*|#.*|[+-]?1?\.?#(?:qnan|snan|ind|inf).*|[+-]?1\.#.*|<.*>)$", re.IGNORECASE
)


@dataclass(frozen=True, slots=True)
class Values:
    """Arrays of shape (n,): `value` NaN where no number, `bad` where neither number nor mode text."""

    value: NDArray[np.float64]
    bad: NDArray[np.bool_]
    text: NDArray[np.object_] | None
    found: Counter[str]


def is_error_text(text: str) -> bool:
    """True where a historian writes this text in place of a value that it does not have."""
    return text.lower() in ERROR_TEXTS or ERROR_SHAPES.match(text) is not None


def values(column: pa.Array, decimal: str = ".") -> Values:
    """Numbers, bad samples and texts of one column of values.

    Parameters
    ----------
    column : pyarrow.Array, shape (n,)
        Numbers, or texts that may hold numbers.
    decimal : str
        Decimal mark of numbers that stand as text.
    """
    if is_text(column.type):
        return _from_texts(column, decimal)
    if pa.types.is_dictionary(column.type):
        column = column.dictionary_decode()
    value = _numbers(column)
    bad = ~np.isfinite(value)
    if bad.any():
        value = np.where(bad, np.nan, value)
    return Values(value, bad, None, +Counter({BLANK: column.null_count}))


def _numbers(column: pa.Array) -> NDArray[np.float64]:
    if pa.types.is_null(column.type):
        return np.full(len(column), np.nan)
    if not pa.types.is_floating(column.type):
        column = pc.cast(column, pa.float64(), safe=False)
    return column.to_numpy(zero_copy_only=False).astype(np.float64, copy=False)


def _from_texts(column: pa.Array, decimal: str) -> Values:
    """Every distinct text is read once; the samples refer to it by number."""
    encoded = column if pa.types.is_dictionary(column.type) else pc.dictionary_encode(column)
    place = pc.fill_null(encoded.indices, len(encoded.dictionary)).to_numpy(zero_copy_only=False)
    kinds = [str(text).strip() for text in encoded.dictionary.to_pylist()] + [""]
    count = np.bincount(place, minlength=len(kinds))
    number = _parsed(kinds, decimal)
    blank = np.array([text == "" for text in kinds])
    error = np.array([is_error_text(text) for text in kinds]) & ~np.isfinite(number)
    word = ~np.isfinite(number) & ~blank & ~error
    found = _found(kinds, count, blank, error)
    if count[word].sum() * 2 > count[~blank & ~error].sum():
        text = np.array(kinds, dtype=object)
        return Values(number[place], (blank | error)[place], text[place], found)
    found.update(_found(kinds, count, np.zeros_like(blank), word))
    return Values(number[place], ~np.isfinite(number[place]), None, found)


def _parsed(texts: list[str], decimal: str) -> NDArray[np.float64]:
    written = pd.Series(texts, dtype=object)
    if decimal != ".":
        written = written.str.replace(decimal, ".", regex=False)
    number = pd.to_numeric(written, errors="coerce").to_numpy(dtype=np.float64)
    return np.where(np.isfinite(number), number, np.nan)


def _found(
    kinds: list[str], count: NDArray[np.int64], blank: NDArray[np.bool_], error: NDArray[np.bool_]
) -> Counter[str]:
    found: Counter[str] = Counter()
    for i in np.flatnonzero(error & (count > 0)):
        found[f"values are the text '{kinds[i]}', taken as bad"] += int(count[i])
    found[BLANK] += int(count[blank].sum())
    return +found
