"""Samples of one tag from one file, as they stand there, and how they become a Series."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analyzer.history.series import Series

NEWEST_FIRST = "series run newest first and are turned round"
REPEATED = "samples repeat a stamp; the last one counts"
CONTRADICTED = "samples contradict another file at the same stamp; the later file counts"
UNORDERED = "samples were out of order"
NO_STAMP = "samples have no readable time stamp and are left out"


@dataclass(frozen=True, slots=True)
class Raw:
    """One tag's samples in the order of the file.

    Parameters
    ----------
    stamp_s : ndarray of float, shape (n,)
        Time stamps [s since 1970-01-01 UTC]; NaN where unreadable.
    value, bad, text
        As in `Series`.
    unread : int, example : str
        As in `Series`.
    found : Counter of str
        How often something worth telling was met; each key completes the sentence "12 ...".
    """

    stamp_s: NDArray[np.float64]
    value: NDArray[np.float64]
    bad: NDArray[np.bool_]
    text: NDArray[np.object_] | None = None
    found: Counter[str] = field(default_factory=Counter)
    unread: int = 0
    example: str = ""


def settle(pieces: Sequence[Raw]) -> tuple[Series, Counter[str]]:
    """Join the pieces of one tag (one a file) into one series of strictly rising stamps.

    Parameters
    ----------
    pieces : sequence of Raw
        In the order of the files; of equal stamps the last sample counts.
    """
    if len(pieces) == 1 and _rises(pieces[0].stamp_s):
        return _series(pieces[0]), pieces[0].found
    found: Counter[str] = Counter()
    ready = [_oldest_first(_with_stamps(piece, found), found) for piece in pieces]
    for piece in pieces:
        found.update(piece.found)
    joined = ready[0] if len(ready) == 1 else _joined(ready)
    if _rises(joined.stamp_s):
        return _series(joined), found
    return _series(_sorted(joined, _origins(ready), found)), found


def _rises(stamp_s: NDArray[np.float64]) -> bool:
    return bool(
        (np.diff(stamp_s) > 0).all() and np.isfinite(stamp_s[:1]).all() and np.isfinite(stamp_s[-1:]).all()
    )


def _series(raw: Raw) -> Series:
    return Series(raw.stamp_s, raw.value, raw.bad, raw.text, raw.unread, raw.example)


def _taken(raw: Raw, index: NDArray[np.generic] | slice) -> Raw:
    text = None if raw.text is None else raw.text[index]
    return replace(
        raw,
        stamp_s=raw.stamp_s[index],
        value=raw.value[index],
        bad=raw.bad[index],
        text=text,
        found=Counter(),
    )


def _with_stamps(raw: Raw, found: Counter[str]) -> Raw:
    readable = np.isfinite(raw.stamp_s)
    if readable.all():
        return raw
    found[NO_STAMP] += int((~readable).sum())
    return _taken(raw, readable)


def _oldest_first(raw: Raw, found: Counter[str]) -> Raw:
    step = np.diff(raw.stamp_s)
    if not (step < 0).any() or (step < 0).sum() <= (step > 0).sum():
        return raw
    found[NEWEST_FIRST] += 1
    return _taken(raw, slice(None, None, -1))


def _joined(pieces: Sequence[Raw]) -> Raw:
    texts = None
    if any(piece.text is not None for piece in pieces):
        texts = np.concatenate([_texts(piece) for piece in pieces])
    return Raw(
        np.concatenate([piece.stamp_s for piece in pieces]),
        np.concatenate([piece.value for piece in pieces]),
        np.concatenate([piece.bad for piece in pieces]),
        texts,
        unread=sum(piece.unread for piece in pieces),
        example=next((piece.example for piece in pieces if piece.example), ""),
    )


def _texts(raw: Raw) -> NDArray[np.object_]:
    return np.full(len(raw.value), "", dtype=object) if raw.text is None else raw.text


def _origins(pieces: Sequence[Raw]) -> NDArray[np.int64]:
    return np.repeat(np.arange(len(pieces)), [len(piece.value) for piece in pieces])


def _sorted(raw: Raw, origin: NDArray[np.int64], found: Counter[str]) -> Raw:
    """Stable sort by stamp, then the last of each stamp; counts what was met on the way."""
    order = np.argsort(raw.stamp_s, kind="stable")
    within_file = np.diff(origin) == 0
    found[UNORDERED] += int(((np.diff(raw.stamp_s) < 0) & within_file).sum())
    raw, origin = _taken(raw, order), origin[order]
    same = np.diff(raw.stamp_s) == 0
    differ = (np.diff(raw.value) != 0) & np.isfinite(raw.value[1:]) & np.isfinite(raw.value[:-1])
    contradicted = same & (np.diff(origin) != 0) & differ
    found[REPEATED] += int((same & ~contradicted).sum())
    found[CONTRADICTED] += int(contradicted.sum())
    return _taken(raw, np.append(~same, True))
