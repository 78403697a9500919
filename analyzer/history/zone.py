"""Local clock to UTC: the hour that autumn repeats and the hour that spring leaves out."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pandas as pd
from numpy.typing import NDArray

MISSING_HOUR = "samples stand in the hour that the time zone leaves out in spring and are left out"
REPEATED_HOUR = "samples stand in the hour that the time zone repeats in autumn; told apart by their order"


def to_utc(local_s: NDArray[np.float64], zone: str) -> tuple[NDArray[np.float64], Counter[str]]:
    """Seconds of a local clock to seconds of UTC.

    Parameters
    ----------
    local_s : ndarray, shape (n,)
        Local wall clock [s since 1970-01-01 00:00 local], in the order of the file; NaN stays NaN.
    zone : str
        IANA name.

    Returns
    -------
    ndarray, shape (n,)
        [s since 1970-01-01 UTC]; NaN in the hour that does not exist.
    Counter
        Samples in repeated and in missing hours.
    """
    falling = np.nansum(np.sign(np.diff(local_s))) < 0
    ordered = local_s[::-1] if falling else local_s
    summer, winter = _offset_readings(ordered, zone)
    twice = np.isfinite(summer) & (summer != winter)
    utc = np.where(_second_pass(ordered, twice), winter, summer)
    missing = int((np.isfinite(ordered) & np.isnan(utc)).sum())
    found = +Counter({REPEATED_HOUR: int(twice.sum()), MISSING_HOUR: missing})
    return (utc[::-1] if falling else utc), found


def _offset_readings(
    local_s: NDArray[np.float64], zone: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both readings of every stamp: with summer time where the hour is doubtful, and without."""
    index = pd.DatetimeIndex((np.nan_to_num(local_s) * 1e6).round().astype("datetime64[us]"))
    readings = []
    for summer in (True, False):
        doubtful = np.full(len(index), summer)
        utc = (
            index.tz_localize(zone, ambiguous=doubtful, nonexistent="NaT").tz_convert("UTC").tz_localize(None)
        )
        offset_s = (utc - index).total_seconds().to_numpy()
        readings.append(local_s + offset_s)
    return readings[0], readings[1]


def _second_pass(local_s: NDArray[np.float64], twice: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True within a repeated hour from where the clock jumped back."""
    back = np.zeros(len(local_s), dtype=bool)
    back[1:] = (np.diff(local_s) < 0) & twice[1:] & twice[:-1]
    jumps = np.cumsum(back)
    starts = twice & ~np.append(False, twice[:-1])
    before = np.maximum.accumulate(np.where(starts, jumps, 0))
    return twice & (jumps > before)
