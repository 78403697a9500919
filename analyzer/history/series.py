"""Samples of one tag: read from one file, joined into one series, and their span of time.

Stamps far from the rest (a clock error, a last value from weeks before, a stamp of 1601) would extend a record by
years without data, so they are excluded and reported.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

APART_S = 86400.0
"""Samples further apart than this are separate clusters [s]: a day without a sample is no night's gap."""
STRAY_SHARE = 0.01
"""A first or last cluster with less than this share of the largest one's samples is stray: a quarter of an
hour next to a day, or four hours next to two weeks."""

NEWEST_FIRST = "series run newest first and are reversed"
REPEATED = "samples repeat a stamp; the last one counts"
CONTRADICTED = "samples contradict another file at the same stamp; the later file counts"
UNORDERED = "samples were out of order"
NO_STAMP = "samples have no readable time stamp and are left out"
EPOCH = datetime(1970, 1, 1)


@dataclass(frozen=True, slots=True)
class Series:
    """Samples of one tag: in the order of a file, or, as a reader returns them, oldest first and one per stamp.

    Parameters
    ----------
    stamp_s : ndarray of float, shape (n,)
        Time of each sample [s since 1970-01-01 UTC]; in the order of a file NaN where unreadable.
    value : ndarray of float, shape (n,)
        Values in the tag's own unit; NaN where the export has no number.
    bad : ndarray of bool, shape (n,)
        True where the historian marks the value as not good, or where there is no number; for a text tag,
        where there is no text.
    text : ndarray of str or None
        The texts, shape (n,), for a text tag (controller modes); else None.
    unread : int
        Values in the export that look like numbers but could not be read; bad here.
    example : str
        One of them.
    found : Counter
        Reportable problems: each key completes the sentence "12 ...".
    """

    stamp_s: NDArray[np.float64]
    value: NDArray[np.float64]
    bad: NDArray[np.bool_]
    text: NDArray[np.object_] | None = None
    unread: int = 0
    example: str = ""
    found: Counter[str] = field(default_factory=Counter, repr=False)

    def taken(self, index: NDArray[np.generic] | slice) -> Series:
        """Some of the samples, without the problems found."""
        text = None if self.text is None else self.text[index]
        return Series(
            self.stamp_s[index], self.value[index], self.bad[index], text, self.unread, self.example
        )


def joined_pieces(pieces: Sequence[Series]) -> Series:
    """Join the pieces of one tag (one per file) into one series of strictly rising stamps.

    Parameters
    ----------
    pieces : sequence of Series
        In the order of the files; of equal stamps the last sample counts.
    """
    found: Counter[str] = Counter()
    ready = [_oldest_first(piece, found) for piece in pieces]
    for piece in pieces:
        found.update(piece.found)
    joined = ready[0] if len(ready) == 1 else _end_to_end(ready)
    if not (np.diff(joined.stamp_s) > 0).all():
        origin = np.repeat(np.arange(len(ready)), [len(piece.value) for piece in ready])
        joined = _sorted_by_stamp(joined, origin, found)
    return replace(joined, found=found)


def _oldest_first(piece: Series, found: Counter[str]) -> Series:
    """The samples of a file with a stamp, reversed if the newest is first."""
    readable = np.isfinite(piece.stamp_s)
    if not readable.all():
        found[NO_STAMP] += int((~readable).sum())
        piece = piece.taken(readable)
    step = np.diff(piece.stamp_s)
    if (step < 0).sum() <= (step > 0).sum():
        return piece
    found[NEWEST_FIRST] += 1
    return piece.taken(slice(None, None, -1))


def _end_to_end(pieces: Sequence[Series]) -> Series:
    texts = None
    if any(piece.text is not None for piece in pieces):
        blank = np.array("", dtype=object)
        texts = [np.broadcast_to(blank if p.text is None else p.text, p.value.shape) for p in pieces]
    return Series(
        np.concatenate([piece.stamp_s for piece in pieces]),
        np.concatenate([piece.value for piece in pieces]),
        np.concatenate([piece.bad for piece in pieces]),
        None if texts is None else np.concatenate(texts),
        unread=sum(piece.unread for piece in pieces),
        example=next((piece.example for piece in pieces if piece.example), ""),
    )


def _sorted_by_stamp(joined: Series, origin: NDArray[np.int64], found: Counter[str]) -> Series:
    """Stable sort by stamp, then the last sample of each stamp; counts the problems found."""
    order = np.argsort(joined.stamp_s, kind="stable")
    within_file = np.diff(origin) == 0
    found[UNORDERED] += int(((np.diff(joined.stamp_s) < 0) & within_file).sum())
    joined, origin = joined.taken(order), origin[order]
    same = np.diff(joined.stamp_s) == 0
    value = joined.value
    differ = (np.diff(value) != 0) & np.isfinite(value[1:]) & np.isfinite(value[:-1])
    contradicted = same & (np.diff(origin) != 0) & differ
    found[REPEATED] += int((same & ~contradicted).sum())
    found[CONTRADICTED] += int(contradicted.sum())
    return joined.taken(np.append(~same, True))


class NoStampError(ValueError):
    """No stamp of a file can be read."""


@dataclass(frozen=True, slots=True)
class MainSpan:
    """First and last stamp of the main samples [s], and the number of samples before and after."""

    first_s: float
    last_s: float
    stray: int


def main_span(stamp_s: NDArray[np.float64]) -> MainSpan:
    """The time span of the samples, without stray ones at either end.

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
    whole = np.flatnonzero((ends - starts) >= STRAY_SHARE * (ends - starts).max())
    a, b = int(starts[whole[0]]), int(ends[whole[-1]])
    return MainSpan(float(ordered[a]), float(ordered[b - 1]), int(ordered.size - (b - a)))


def stamp_text(seconds: float) -> str:
    """A stamp [s since 1970-01-01 UTC] as text; in years if it is outside the calendar."""
    years = 1970 + seconds / (365.2425 * 86400.0)
    if not 1 <= years < 9999:
        return f"year {years:.0f}"
    return (EPOCH + timedelta(seconds=seconds)).strftime("%Y-%m-%d %H:%M:%S")
