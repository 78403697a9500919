"""Quality codes of historians: which scheme a column follows, and which samples are not good.

OPC DA: the low byte is 192 and above where good, 64 to 127 uncertain, below 64 bad. OPC UA: the two highest
of 32 bits are 00 good, 01 uncertain, 10 bad. Confidence (0 to 100): good from 50. Uncertain samples are not
used.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from enum import StrEnum

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from analyzer.history.names import BAD_NAMES, FLAG_NAMES, plain

GOOD_TEXTS = frozenset(
    {
        *("good", "g", "ok", "valid", "true", "normal", "good quality", "non-cascade", "cascade", "y", "yes"),
        *(
            "gut",
            "gültig",
            "ja",
            "bon",
            "bonne",
            "valide",
            "vrai",
            "oui",
            "bueno",
            "buena",
            "hyvä",
            "god",
            "goed",
        ),
    }
)
DA_GOOD, UA_UNCERTAIN, CONFIDENCE_GOOD, CONFIDENCE_FULL = 192, 0x40000000, 50, 100
PCS7_GOOD = 0x80
MOST_FLAG = 10
"""Codes below this number are a plant's own, of which 0 or 1 is good."""
NOT_BAD = frozenset(
    {"", "0", "0.0", "false", "f", "n", "no", "none", "nan", "ok", "good", "nein", "non", "ei"}
)
IS_BAD = frozenset({"1", "1.0", "true", "t", "y", "yes", "bad", "x", "ja", "oui"})
BAD_TEXTS = frozenset({
    "bad", "b", "uncertain", "u", "invalid", "error", "e", "err", "false", "n", "no", "questionable", "q", "fail",
    "failed", "not connected", "timeout", "stale", "suspect", "poor", "fault", "s", "t", "p", "schlecht", "ungültig",
    "nein", "unsicher", "mauvais", "incertain", "mal", "malo", "incierto", "huono", "dålig", "slecht",
})  # fmt: skip
"""Texts of samples that are not good; others are taken as not good too, but do not show that a column is quality."""
INTERPOLATED = 0x00020000  # flag of OPC historical access beside the DA code in the low byte
FLAGGED_INTERPOLATED = "samples are flagged as interpolated, not recorded"


HEXADECIMAL = re.compile(r"^\s*0[xX][0-9a-fA-F]{1,8}\s*$")


class Scheme(StrEnum):
    """How the codes of one quality column are meant."""

    TEXT = "texts such as Good and Bad"
    DA = "OPC DA codes, 192 and above good"
    UA = "codes with 0 good"
    CONFIDENCE = "confidence in percent, good from 50"
    FLAG = "flags, 1 good and all else bad"
    ONE_GOOD = "codes with 1 good, for most are; state --good-quality 0 if it is that"
    BAD_FLAG = "flags of what is bad: 0, false and blank good"
    PCS7 = "PCS 7 codes, 128 and above good"
    IGNITION = "Ignition codes, 192 to 255 good"


def mostly_one(columns: Iterable[pa.Array]) -> bool:
    """Whether of the codes 0 and 1 in some columns' rows most are 1."""
    number = np.concatenate([np.empty(0), *(_numbers(codes) for codes in columns)])
    return bool((number == 1).sum() > (number == 0).sum())


def scheme_of(name: str, codes: pa.Array, ones: bool | None = None) -> Scheme:
    """Decide by the column's name and all the codes that occur in it.

    Parameters
    ----------
    name : str
    codes : pyarrow.Array, shape (n,)
    ones : bool or None
        Whether of the codes 0 and 1 most are 1, as `mostly_one` has it of more rows; None: of these.
    """
    number = _numbers(codes)
    known = number[np.isfinite(number)].astype(np.int64)
    if plain(name).endswith(BAD_NAMES) and _flags(codes):
        return Scheme.BAD_FLAG
    if plain(name) == "dataintegrity":
        return Scheme.IGNITION
    if 2 * len(known) < len(codes) - codes.null_count:
        return Scheme.TEXT
    if "confidence" in plain(name):
        return Scheme.CONFIDENCE
    if plain(name).endswith(FLAG_NAMES) and set(known.tolist()) <= set(range(10)):
        return Scheme.FLAG
    small = known[(known >= 0) & (known < UA_UNCERTAIN)]
    if (known < 0).any() or (known >= UA_UNCERTAIN).any():
        return Scheme.UA
    if ((small & 0xFF) >= DA_GOOD).any():
        return Scheme.DA
    if (small == PCS7_GOOD).any() and known.max() < 0x100:
        return Scheme.PCS7
    if len(known) and known.max() < MOST_FLAG and (mostly_one([codes]) if ones is None else ones):
        return Scheme.ONE_GOOD
    return Scheme.CONFIDENCE if len(known) and known.max() == CONFIDENCE_FULL else Scheme.UA


def not_good(
    codes: pa.Array, scheme: Scheme, good: tuple[str, ...] | None
) -> tuple[NDArray[np.bool_], Counter[str]]:
    """Samples that the historian does not call good, and how often each such code was met.

    Parameters
    ----------
    codes : pyarrow.Array, shape (n,)
        Numbers or texts; a blank is bad.
    good : tuple of str or None
        Codes or texts that count as good whatever the scheme says.
    """
    encoded = codes if pa.types.is_dictionary(codes.type) else pc.dictionary_encode(codes)
    place = pc.fill_null(encoded.indices, len(encoded.dictionary)).to_numpy(zero_copy_only=False)
    kinds = pa.concat_arrays([encoded.dictionary, pa.nulls(1, encoded.dictionary.type)])
    bad = ~_good(kinds, scheme) if good is None else ~_listed(kinds, good)
    count = np.bincount(place, minlength=len(kinds))
    names = kinds.to_pylist()
    blank = np.array([name is None or str(name).strip() == "" for name in names])
    if good is None and bad[~blank].all() and 2 * count[blank].sum() > count.sum():
        bad = bad & ~blank  # codes stand only where something is wrong
    found = Counter(
        {
            f"samples have quality '{str(names[i])[:60]}', taken as bad": int(count[i])
            for i in np.flatnonzero(bad)
        }
    )
    found[FLAGGED_INTERPOLATED] = int(count[_interpolated(kinds, scheme)].sum())
    return bad[place], +found


def _sentence(code: pa.Scalar) -> str:
    return (
        f"samples have quality '{code.as_py()}', taken as bad" if code.is_valid else "samples have no quality"
    )


def _numbers(codes: pa.Array) -> NDArray[np.float64]:
    if pa.types.is_dictionary(codes.type):
        codes = codes.dictionary_decode()
    found = [int(c, 16) if isinstance(c, str) and HEXADECIMAL.match(c) else c for c in codes.to_pylist()]
    return pd.to_numeric(pd.Series(found, dtype=object), errors="coerce").to_numpy(dtype=np.float64)


def _good(kinds: pa.Array, scheme: Scheme) -> NDArray[np.bool_]:
    if scheme is Scheme.TEXT:
        return np.array([_good_text(str(text)) for text in kinds.to_pylist()])
    if scheme is Scheme.BAD_FLAG:
        return np.array([_written(code) in NOT_BAD for code in kinds.to_pylist()])
    number = _numbers(kinds)
    code = np.nan_to_num(number, nan=-1).astype(np.int64)
    if scheme is Scheme.CONFIDENCE:
        return code >= CONFIDENCE_GOOD
    if scheme in (Scheme.FLAG, Scheme.ONE_GOOD):
        return code == 1
    if scheme is Scheme.DA:
        return (code >= 0) & ((code & 0xC0) == DA_GOOD)
    if scheme is Scheme.IGNITION:
        return (code >= DA_GOOD) & (code < 0x100)
    if scheme is Scheme.PCS7:
        return (code >= PCS7_GOOD) & (code < 0x100)
    return np.isfinite(number) & ((code & 0xFFFFFFFF) < UA_UNCERTAIN) & ~((code > 0) & (code < 0x100))


def _written(code: object) -> str:
    return "" if code is None else str(code).strip().lower()


def _flags(codes: pa.Array) -> bool:
    """Whether codes say yes or no and nothing else."""
    return {_written(code) for code in codes.unique().to_pylist()} <= NOT_BAD | IS_BAD


def is_understood(codes: pa.Array, scheme: Scheme) -> bool:
    """Whether codes under a bare name are quality: texts that are known, or numbers that the scheme has."""
    kinds = {_written(code) for code in codes.unique().to_pylist()} - {""}
    if scheme is Scheme.TEXT:
        known = {k for k in kinds if _good_text(k) or k in BAD_TEXTS or k.startswith("bad")}
        return bool(kinds) and 2 * len(known) >= len(kinds)
    if scheme is Scheme.UA:
        return not kinds.isdisjoint({"0", "0.0"}) or any(k.startswith("0x") for k in kinds)
    return True


def _good_text(text: str) -> bool:
    """Whether a text is good, or one of the words that commas part is, and none of them is bad."""
    words = [word.strip() for word in re.split(r"[,;|]", text.lower())]
    good = [word in GOOD_TEXTS or word.startswith("good") for word in words]
    return any(good) and BAD_TEXTS.isdisjoint(words)


def _listed(kinds: pa.Array, good: tuple[str, ...]) -> NDArray[np.bool_]:
    wanted = {_canonical(code) for code in good}
    return np.array([_canonical(code) in wanted for code in kinds.to_pylist()])


def _canonical(code: object) -> str:
    text = str(code).strip().lower()
    return text.removesuffix(".0")


def _interpolated(kinds: pa.Array, scheme: Scheme) -> NDArray[np.bool_]:
    code = np.nan_to_num(_numbers(kinds), nan=0).astype(np.int64)
    return (scheme is Scheme.DA) & (code > 0) & ((code & INTERPOLATED) != 0)
