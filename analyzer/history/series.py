"""Samples of one tag: as they stand in one file (`Raw`), as a reader returns them (`Series`), and their span of time.

Stamps far from the rest (a clock that was wrong once, a last value from weeks before, a stamp of 1601) would stretch
a record over years of nothing, so they are set aside and told.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

NEWEST_FIRST = "series run newest first and are turned round"
REPEATED = "samples repeat a stamp; the last one counts"
CONTRADICTED = "samples contradict another file at the same stamp; the later file counts"
UNORDERED = "samples were out of order"
NO_STAMP = "samples have no readable time stamp and are left out"
EPOCH = datetime(1970, 1, 1)
APART_S = 86400.0
"""Samples further apart than this [s] are separate clusters; ours: a day without a sample is no night's gap."""
LEAST_SHARE = 0.01
"""A first or last cluster with less than this share of the largest one's samples is stray [-]; ours: a quarter of an
hour beside a day, or four hours beside two weeks."""


@dataclass(frozen=True, slots=True)
class Series:
    """Raw samples of one tag, oldest first, one per stamp.

    Parameters
    ----------
    stamp_s : ndarray of float, shape (n,)
        Time of each sample [s since 1970-01-01 UTC], strictly rising.
    value : ndarray of float, shape (n,)
        Values in the tag's own unit; NaN where the export holds no number.
    bad : ndarray of bool, shape (n,)
        True where the historian says that the value is not good, or where there is no number; of a text tag,
        where there is no text.
    text : ndarray of str or None
        The texts, shape (n,), where the tag is a text tag (controller modes); else None.
    unread : int
        Values in the export that look like numbers and could not be understood; bad here.
    example : str
        One of them.
    """

    stamp_s: NDArray[np.float64]
    value: NDArray[np.float64]
    bad: NDArray[np.bool_]
    text: NDArray[np.object_] | None = None
    unread: int = 0
    example: str = ""


@dataclass(frozen=True, slots=True)
class Raw(Series):
    """One tag's samples in the order of the file; stamps may be NaN where unreadable.

    `found` counts what is worth telling: each key completes the sentence "12 ...".
    """

    found: Counter[str] = field(default_factory=Counter)

    def taken(self, index: NDArray[np.generic] | slice) -> Raw:
        """Some of the samples, and nothing of what was found."""
        text = None if self.text is None else self.text[index]
        return Raw(self.stamp_s[index], self.value[index], self.bad[index], text, self.unread, self.example)


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


def _with_stamps(raw: Raw, found: Counter[str]) -> Raw:
    readable = np.isfinite(raw.stamp_s)
    if readable.all():
        return raw
    found[NO_STAMP] += int((~readable).sum())
    return raw.taken(readable)


def _oldest_first(raw: Raw, found: Counter[str]) -> Raw:
    step = np.diff(raw.stamp_s)
    if not (step < 0).any() or (step < 0).sum() <= (step > 0).sum():
        return raw
    found[NEWEST_FIRST] += 1
    return raw.taken(slice(None, None, -1))


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
    raw, origin = raw.taken(order), origin[order]
    same = np.diff(raw.stamp_s) == 0
    differ = (np.diff(raw.value) != 0) & np.isfinite(raw.value[1:]) & np.isfinite(raw.value[:-1])
    contradicted = same & (np.diff(origin) != 0) & differ
    found[REPEATED] += int((same & ~contradicted).sum())
    found[CONTRADICTED] += int(contradicted.sum())
    return raw.taken(np.append(~same, True))


class NoStampError(ValueError):
    """Not one stamp of a file can be read."""


@dataclass(frozen=True, slots=True)
class MainSpan:
    """First and last stamp of the samples that belong together [s], and how many lie before and after."""

    first_s: float
    last_s: float
    stray: int


def main_span(stamp_s: NDArray[np.float64]) -> MainSpan:
    """The span of time in which the samples lie, without stray ones at either end.

    Parameters
    ----------
    stamp_s : ndarray, shape (n,)
        [s]; in any order, NaN where unreadable, at least one finite.

    Raises
    ------
    NoStampError
        No stamp is finite.
    """
    known = stamp_s[np.isfinite(stamp_s)]
    if known.size == 0:
        raise NoStampError
    first, last = float(known.min()), float(known.max())
    if last - first <= APART_S:
        return MainSpan(first, last, 0)
    ordered = known if bool((np.diff(known) >= 0).all()) else np.sort(known)
    cuts = np.flatnonzero(np.diff(ordered) > APART_S) + 1
    starts, ends = np.r_[0, cuts], np.r_[cuts, ordered.size]
    whole = np.flatnonzero((ends - starts) >= LEAST_SHARE * (ends - starts).max())
    a, b = int(starts[whole[0]]), int(ends[whole[-1]])
    return MainSpan(float(ordered[a]), float(ordered[b - 1]), int(ordered.size - (b - a)))


def stamp_text(seconds: float) -> str:
    """A stamp [s since 1970-01-01 UTC] in words; in years where it is beyond any calendar."""
    years = 1970 + seconds / (365.2425 * 86400.0)
    if not 1 <= years < 9999:
        return f"year {years:.0f}"
    return (EPOCH + timedelta(seconds=seconds)).strftime("%Y-%m-%d %H:%M:%S")
