"""Raw stamps and one clock: intervals, held values, runs of equal values, straight segments, resolution."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analyzer.config import QualityLimits
from analyzer.history.series import Series, main_span
from analyzer.loop.decisions import LacksError, MissingData, Requirement, RequirementKind
from identification.record import Floats, Mask

GRID_SAMPLES = 20000  # Samples that are searched for a grid
GRID_PER_LEVEL = 10  # Samples a level that distinguish a grid from values that repeat by chance


def interval(stamp_s: Floats) -> float:
    """The sample interval of raw stamps [s]: the median spacing, or the mean if they differ by jitter only."""
    if stamp_s.size < 2:
        return math.nan
    median = float(np.median(np.diff(stamp_s)))
    even = float(f"{(stamp_s[-1] - stamp_s[0]) / (stamp_s.size - 1):.4g}")
    return even if abs(even - median) < 0.005 * median else median


def onto_clock(series: Series, clock: Floats, dt_s: float, limits: QualityLimits) -> tuple[Floats, Mask]:
    """Values held on a clock, and the gaps in which no value can be held.

    Returns
    -------
    ndarray of shape (n,), ndarray of bool, shape (n,)
        The last good value at or before each tick (the next one if there is none), and True in gaps: the value is
        older than gap_factor intervals of the tag, or not good.
    """
    good = ~series.bad
    if not good.any():
        return np.zeros(clock.size), np.ones(clock.size, dtype=bool)
    if clock.size == series.stamp_s.size and np.array_equal(clock, series.stamp_s):
        return _last_good_held(series.value, good)
    stamp, value = series.stamp_s[good], series.value[good]
    at = np.searchsorted(stamp, clock + 0.01 * dt_s, side="right") - 1
    own = max(interval(stamp), dt_s) if stamp.size > 1 else dt_s
    age = clock - stamp[np.maximum(at, 0)]
    lost = np.zeros(clock.size, dtype=bool)
    raw = np.clip(np.searchsorted(series.stamp_s, clock + 0.01 * dt_s, side="right") - 1, 0, None)
    lost |= ~good[raw] & (np.abs(clock - series.stamp_s[raw]) < 0.5 * dt_s)
    return value[np.maximum(at, 0)], (at < 0) | (age > limits.gap_factor * own) | lost


def snapped(series: dict[str, Series], pv: str) -> dict[str, Series]:
    """The same samples, with stamps that scatter by less than half a sample moved to PV's uniform clock.

    Values held on a clock would repeat or lose a sample at each slightly late stamp.
    """
    at_s = series[pv].stamp_s
    if at_s.size < 3:
        return series
    spacing = float(np.median(np.diff(at_s)))
    index = np.concatenate(([0.0], np.cumsum(np.maximum(np.round(np.diff(at_s) / spacing), 1.0))))
    dt, start = (float(v) for v in np.polyfit(index, at_s - at_s[0], 1))
    out = {}
    for tag, x in series.items():
        at = np.round((x.stamp_s - at_s[0] - start) / dt)
        near = bool(np.max(np.abs(x.stamp_s - at_s[0] - start - at * dt), initial=0.0) < 0.49 * dt)
        if not near or (x.stamp_s.size > 1 and float(np.diff(at).min()) < 1.0):
            return series
        out[tag] = Series(at_s[0] + at * dt, x.value, x.bad, x.text)
    return out


def _last_good_held(value: Floats, good: Mask) -> tuple[Floats, Mask]:
    if good.all():
        return value, ~good
    at = np.maximum.accumulate(np.where(good, np.arange(value.size), -1))
    return value[np.where(at < 0, int(np.argmax(good)), at)], ~good


@njit(cache=True)
def constant_for(value: Floats, samples: float) -> Mask:
    """True where a value is constant for at least `samples` samples, shape (n,)."""
    out = np.zeros(value.size, dtype=np.bool_)
    first = 0
    for k in range(1, value.size + 1):
        if k < value.size and value[k] == value[k - 1]:
            continue
        if k - first >= samples:
            out[first:k] = True
        first = k
    return out


def constant_stretches(value: Floats, dt_s: float, seconds: float, samples: int) -> Mask:
    """True where a value is constant for `seconds` [s] and `samples` samples, shape (n,)."""
    return constant_for(value, max(samples, seconds / dt_s))  # type: ignore[no-any-return]


@njit(cache=True)
def collinear(value: Floats) -> Mask:
    """True where a sample lies on the line between its neighbours while the trend moves, shape (n,).

    Swinging-door compression produces straight, sloping segments; steps of a coarse resolution and constants are
    straight too, but level.
    """
    out = np.zeros(value.size, dtype=np.bool_)
    largest = 0.0
    for k in range(1, value.size):
        largest = max(largest, abs(value[k] - value[k - 1]))
    for k in range(1, value.size - 1):
        before, after = value[k] - value[k - 1], value[k + 1] - value[k]
        out[k] = before != 0 and abs(after - before) <= max(1e-4 * largest, 1e-3 * abs(before))
    return out


def archived_share(value: Floats) -> float:
    """Share of samples that differ from a line through their neighbours [-]: those that compression kept."""
    level = np.zeros(value.size, dtype=np.bool_)
    level[1:-1] = (value[1:-1] == value[:-2]) & (value[1:-1] == value[2:])
    return float((~(collinear(value) | level)).mean())


def resolution(value: Floats) -> float:
    """Resolution of values, in their unit; 0 if none is found.

    It is the usual difference between occurring values; a minimum of samples per level identifies it.
    """
    most = min(value.size, GRID_SAMPLES) / GRID_PER_LEVEL
    if np.unique(value[: int(most) + 2 * GRID_PER_LEVEL]).size > most:
        return 0.0
    levels = np.unique(value[:GRID_SAMPLES])
    if levels.size < 2 or levels.size > most:
        return 0.0
    return float(np.median(np.diff(levels)))


def clock_of(pv: Series, dt_s: float, limits: QualityLimits) -> Floats:
    """PV's own stamps if they are uniform, else a uniform clock over them.

    Raises
    ------
    LacksError
        The samples are so sparse that most of that clock would be gaps.
    """
    spacing = np.diff(pv.stamp_s)
    if spacing.size and float(np.max(np.abs(spacing - dt_s))) <= 0.01 * dt_s:
        return pv.stamp_s
    count = int((pv.stamp_s[-1] - pv.stamp_s[0]) / dt_s + 1e-6) + 1
    if count > limits.ticks_per_sample * pv.stamp_s.size:
        share = 100 * pv.stamp_s.size / count
        days = (pv.stamp_s[-1] - pv.stamp_s[0]) / 86400
        raise LacksError(
            Requirement(MissingData.SAMPLES, RequirementKind.IN_A_ROW, (pv.stamp_s.size, dt_s, days, share))
        )
    return pv.stamp_s[0] + dt_s * np.arange(count)


def without_stray_ends(pv: Series) -> Series:
    """PV from its first to its last good sample, without those far from the others."""
    stamp = pv.stamp_s[~pv.bad]
    span = main_span(stamp)
    if span.stray:
        inside = slice(*np.searchsorted(pv.stamp_s, [span.first_s, np.nextafter(span.last_s, np.inf)]))
        pv = Series(pv.stamp_s[inside], pv.value[inside], pv.bad[inside])
    good = np.flatnonzero(~pv.bad)
    if good[0] == 0 and good[-1] == pv.bad.size - 1:
        return pv
    cut = slice(int(good[0]), int(good[-1]) + 1)
    return Series(pv.stamp_s[cut], pv.value[cut], pv.bad[cut])
