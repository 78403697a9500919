"""Stamps far from the rest: a clock that was wrong once, a last value from weeks before, a stamp of 1601.

They would stretch a record over years of nothing, so they are set aside and told.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

EPOCH = datetime(1970, 1, 1)
APART_S = 86400.0
"""Samples further apart than this [s] are separate clusters; ours: a day without a sample is no night's gap."""
LEAST_SHARE = 0.01
"""A first or last cluster with less than this share of the largest one's samples is stray [-]; ours: a quarter of an
hour beside a day, or four hours beside two weeks."""


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
