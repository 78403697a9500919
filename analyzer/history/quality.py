"""Quality of samples: columns of quality codes, their scheme, and which samples are not good.

OPC DA: the low byte is 192 and above where good, 64 to 127 uncertain, below 64 bad. OPC UA: the two highest of 32
bits are 00 good, 01 uncertain, 10 bad. Confidence (0 to 100): good from 50. Uncertain samples are not used.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from enum import StrEnum

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.table import COLUMNS, NAME_LENGTH, WORDS, Table, any_of, distinct, plain

FLAGS = 10  # Quality codes below this number are a plant's own, of which 0 or 1 is good

QUALITY_OF = (
    re.compile(rf"^(?P<tag>.+?)[ ._:/|#-]?\(?(?:{any_of('quality')})\)?$", re.IGNORECASE),
    re.compile(rf"^(?:{any_of('quality')})(?: of)?[ ._:/|#-]*[(\[]?(?P<tag>.+?)[)\]]?$", re.IGNORECASE),
)
"""Names of quality columns that include the tag, as prefix or suffix."""
GOOD, BAD, NOT_BAD, IS_BAD = (
    frozenset(WORDS["quality"][kind]) for kind in ("good", "bad", "not_bad", "is_bad")
)
DA_GOOD, UA_UNCERTAIN, CONFIDENCE_GOOD, CONFIDENCE_FULL = 192, 0x40000000, 50, 100
PCS7_GOOD = 0x80
INTERPOLATED = 0x00020000
"""Flag of OPC historical access next to the DA code in the low byte."""
FLAGGED_INTERPOLATED = "samples are flagged as interpolated, not recorded"
HEXADECIMAL = re.compile(r"^\s*0[xX][0-9a-fA-F]{1,8}\s*$")


class Scheme(StrEnum):
    """Meaning of the codes of one quality column."""

    TEXT = "texts such as Good and Bad"
    DA = "OPC DA codes, 192 and above good"
    UA = "codes with 0 good"
    CONFIDENCE = "confidence in percent, good from 50"
    FLAG = "flags, 1 good and all else bad"
    ONE_GOOD = "codes with 1 good, because most samples have 1; state --good-quality 0 if 0 is good"
    BAD_FLAG = "flags of what is bad: 0, false and blank good"
    PCS7 = "PCS 7 codes, 128 and above good"
    IGNITION = "Ignition codes, 192 to 255 good"


Codes = NDArray[np.int64]
IS_GOOD: Mapping[Scheme, Callable[[Codes], NDArray[np.bool_]]] = {
    Scheme.DA: lambda code: (code >= 0) & ((code & 0xC0) == DA_GOOD),
    Scheme.UA: lambda code: ((code & 0xFFFFFFFF) < UA_UNCERTAIN) & ~((code > 0) & (code < 0x100)),
    Scheme.CONFIDENCE: lambda code: code >= CONFIDENCE_GOOD,
    Scheme.FLAG: lambda code: code == 1,
    Scheme.ONE_GOOD: lambda code: code == 1,
    Scheme.PCS7: lambda code: (code >= PCS7_GOOD) & (code < 0x100),
    Scheme.IGNITION: lambda code: (code >= DA_GOOD) & (code < 0x100),
}
"""Which numbers are good; a text that is no number is good in none."""


def ones_prevail(columns: Iterable[pa.Array]) -> bool:
    """Whether most of the codes 0 and 1 in some columns' rows are 1."""
    number = np.concatenate([np.empty(0), *(_numbers(codes) for codes in columns)])
    return bool((number == 1).sum() > (number == 0).sum())


def scheme_of(name: str, codes: pa.Array, ones: bool | None = None) -> Scheme:
    """Determine the scheme from the column's name and all codes in it.

    `ones` : whether most of the codes 0 and 1 are 1, from `ones_prevail` over more rows; None: from these codes.
    """
    number, name = _numbers(codes), plain(name)
    known = number[np.isfinite(number)].astype(np.int64)
    if name.endswith(COLUMNS["bad_flag"]) and {*_codes_seen(codes)} <= NOT_BAD | IS_BAD:
        return Scheme.BAD_FLAG
    if name == "dataintegrity":
        return Scheme.IGNITION
    if 2 * len(known) < len(codes) - codes.null_count:
        return Scheme.TEXT
    if "confidence" in name:
        return Scheme.CONFIDENCE
    if name.endswith(COLUMNS["good_flag"]) and set(known.tolist()) <= set(range(10)):
        return Scheme.FLAG
    if (known < 0).any() or (known >= UA_UNCERTAIN).any():
        return Scheme.UA
    if ((known & 0xFF) >= DA_GOOD).any():
        return Scheme.DA
    if (known == PCS7_GOOD).any() and known.max() < 0x100:
        return Scheme.PCS7
    if len(known) and known.max() < FLAGS and (ones_prevail([codes]) if ones is None else ones):
        return Scheme.ONE_GOOD
    return Scheme.CONFIDENCE if len(known) and known.max() == CONFIDENCE_FULL else Scheme.UA


def not_good(
    codes: pa.Array, scheme: Scheme, good: tuple[str, ...] | None
) -> tuple[NDArray[np.bool_], Counter[str]]:
    """Samples that are not good according to the historian, shape (n,), and the count of each such code.

    `good` are codes or texts that count as good in any scheme, None: as in the scheme; a blank is bad, unless codes
    are written only for errors.
    """
    kinds, place, count = distinct(codes)
    names = kinds.to_pylist()
    if good is None:
        bad = ~_good(kinds, scheme)
    else:
        listed = {_code_text(code).removesuffix(".0") for code in good}
        bad = np.array([str(name).strip().lower().removesuffix(".0") not in listed for name in names])
    blank = np.array([name is None or str(name).strip() == "" for name in names])
    if good is None and bad[~blank].all() and 2 * count[blank].sum() > count.sum():
        bad = bad & ~blank
    text = "samples have quality '{:.60}', taken as bad"
    found = Counter({text.format(str(names[i])): int(count[i]) for i in np.flatnonzero(bad)})
    if scheme is Scheme.DA:
        code = np.nan_to_num(_numbers(kinds), nan=0).astype(np.int64)
        found[FLAGGED_INTERPOLATED] = int(count[(code > 0) & ((code & INTERPOLATED) != 0)].sum())
    return bad[place], +found


def quality_columns(
    table: Table, free: Sequence[int], stated: Collection[str] = ()
) -> tuple[dict[int, int], list[str]]:
    """Value column to quality column of a wide table, by position, and sentences on columns that are not understood.

    `free` are the columns other than the time's; `stated` are names of tags, which are not quality.

    A quality column is named after its tag (FIC101.PV_Q, Qual FIC101.PV), or is right of its values under a repeated
    bare name (Status), or is the only one of its kind and applies to the whole row.
    """
    names = table.names
    by_name = {names[i]: i for i in reversed(free)}
    named = {i: by_name[tag] for i in free if (tag := _tag_of(names[i], by_name)) is not None}
    found = {tag: i for i, tag in named.items() if _is_coded(table, i)}
    found = {tag: i for tag, i in found.items() if names[i] not in stated}
    bare = [i for i in free if plain(names[i]) in COLUMNS["quality"] and i not in found.values()]
    bare = [i for i in bare if names[i] not in stated]
    if len(bare) > 1:  # e.g. an error of the loop is a signal
        bare = [i for i in bare if not _has_fractions(table, i)]
    values = [i for i in free if i not in bare and i not in found.values()]
    if len(bare) > 1:
        return {**{i - 1: i for i in bare if i - 1 in values}, **found}, []
    for i in bare:
        if _is_coded(table, i):
            return {**dict.fromkeys(values, i), **found}, []
        if _few_kinds(table.head([i])[0]):
            note = f"column '{names[i]}' looks like quality and is not understood: its codes are not used"
            return found, [f"{note}; name those that are good with --good-quality if it is"]
    return found, []


def _tag_of(name: str, others: Mapping[str, int]) -> str | None:
    """The other column after which a quality column is named."""
    if len(name) > NAME_LENGTH:
        return None
    tags = (match["tag"] for pattern in QUALITY_OF if (match := pattern.match(name)) is not None)
    return next((tag for tag in tags if tag in others and tag != name), None)


def _has_fractions(table: Table, i: int) -> bool:
    """Whether a column has numbers that are not whole."""
    values = table.head([i])[0].drop_null()
    return pa.types.is_floating(values.type) and not pc.all(pc.equal(values, pc.floor(values))).as_py()


def _is_coded(table: Table, i: int) -> bool:
    """Whether a column named as quality has codes: few kinds, whole numbers or known texts.

    A loop's flow may have the name Q.
    """
    codes = table.head([i])[0].drop_null()
    if len(codes) == 0:
        return True
    if _has_fractions(table, i) or not _few_kinds(codes):
        return False
    scheme, kinds = scheme_of(table.names[i], codes), {*_codes_seen(codes)} - {""}
    if scheme is Scheme.TEXT:
        known = {k for k in kinds if _good_text(k) or k in BAD or k.startswith("bad")}
        return bool(kinds) and 2 * len(known) >= len(kinds)
    return scheme is not Scheme.UA or any(k in ("0", "0.0") or k.startswith("0x") for k in kinds)


def _few_kinds(codes: pa.Array) -> bool:
    """Whether a column has few distinct values, as codes have."""
    return len(codes) > 0 and len(codes.unique()) <= max(len(codes) // 10, 8)


def _numbers(codes: pa.Array) -> NDArray[np.float64]:
    if pa.types.is_dictionary(codes.type):
        codes = codes.dictionary_decode()
    found = [int(c, 16) if isinstance(c, str) and HEXADECIMAL.match(c) else c for c in codes.to_pylist()]
    return pd.to_numeric(pd.Series(found, dtype=object), errors="coerce").to_numpy(dtype=np.float64)


def _good(kinds: pa.Array, scheme: Scheme) -> NDArray[np.bool_]:
    if scheme in (Scheme.TEXT, Scheme.BAD_FLAG):
        texts = map(_code_text, kinds.to_pylist())
        return np.array([_good_text(t) if scheme is Scheme.TEXT else t in NOT_BAD for t in texts])
    number = _numbers(kinds)
    return np.isfinite(number) & IS_GOOD[scheme](np.nan_to_num(number, nan=-1).astype(np.int64))


def _good_text(text: str) -> bool:
    """Whether a text is good, or has a good word between commas and no bad one."""
    words = [word.strip() for word in re.split(r"[,;|]", text.lower())]
    return BAD.isdisjoint(words) and any(word in GOOD or word.startswith("good") for word in words)


def _code_text(code: object) -> str:
    return "" if code is None else str(code).strip().lower()


def _codes_seen(codes: pa.Array) -> list[str]:
    return [_code_text(code) for code in codes.unique().to_pylist()]
