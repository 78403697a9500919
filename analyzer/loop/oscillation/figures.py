"""Performance figures of a loop: error, travel, variability and others, per hour and for the night.

All figures use only good samples in automatic, all tolerate gaps and constants, and an unknown figure is None, never
a good score.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit

from analyzer.config import FigureLimits
from analyzer.history.plant_clock import HOUR_S
from analyzer.loop.oscillation.detection import Oscillations
from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation

ROUNDING = 1e-9
"""Moves under this [% of OP] are rounding and no reversal: a signal may lie exactly at the edge of the band."""


@dataclass(frozen=True, slots=True)
class Assessments:
    """Figures of one span; None if unknown.

    usable_h : hours used [h]; average_absolute_error_pct, variability_pct (2 sigma of e) and pv_variability_pct (2
    sigma of PV over its mean) [%]; valve_travel_pct_per_h [%/h] of OP or, if recorded, of the position;
    reversals_per_h, crossings_per_h (of e beyond the noise band) [1/h]; noise_band_pct [% of span]; normal_pct,
    at_limits_pct, service_pct, shares of good time [%]; sp_mean_pct, pv_mean_pct, op_mean_pct, sp_travel_pct [% of
    span], which show whether two spans are comparable.
    """

    usable_h: float
    average_absolute_error_pct: float | None = None
    valve_travel_pct_per_h: float | None = None
    reversals_per_h: float | None = None
    variability_pct: float | None = None
    pv_variability_pct: float | None = None
    crossings_per_h: float | None = None
    noise_band_pct: float | None = None
    normal_pct: float | None = None
    at_limits_pct: float | None = None
    service_pct: float | None = None
    sp_mean_pct: float | None = None
    pv_mean_pct: float | None = None
    op_mean_pct: float | None = None
    sp_travel_pct: float | None = None

    def as_row(self) -> Mapping[str, float | None]:
        """The figures by name."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Hour:
    """One hour of a loop: its start [s since 1970-01-01 UTC], figures, and oscillation.

    oscillation_significance [% h] of that hour and oscillating_pct [%] add up to the night's.
    """

    start_s: float
    figures: Assessments
    oscillation_significance: float
    oscillating_pct: float


class Trends(NamedTuple):
    """Set point, PV and OP of a span [% of span], and where OP is at a limit, shape (n,) each."""

    sp: Floats
    pv: Floats
    op: Floats
    saturated: Mask


class Sums(NamedTuple):
    """Over the samples that are good and in automatic: means of |e|, SP, PV and OP, standard deviations of e and PV
    [% of span], shares of time at limits and in good service [-], and number of crossings of the noise band by e; the
    set point's travel over the whole span."""

    absolute_error: float
    sp: float
    pv: float
    op: float
    error_deviation: float
    pv_deviation: float
    at_limits: float
    service: float
    crossings: int
    sp_travel: float


@njit(cache=True)
def crossings_of(e: Floats, use: Mask, band: float) -> int:
    """Number of crossings of an error, over usable samples, from beyond one side of a band to beyond the other."""
    side, count = 0, 0
    for k in range(e.size):
        if not use[k] or abs(e[k]) <= band:
            continue
        now = 1 if e[k] > 0 else -1
        count += side == -now
        side = now
    return count


@njit(cache=True)
def travel_of(signal: Floats, use: Mask, step: int, deadband: float) -> tuple[float, int]:
    """Travel and reversals of every `step`-th sample of a signal beyond a deadband, shape (n,).

    Moves between usable neighbours form one path: moves of a signal during a gap are unknown.
    """
    half, x, stem = 0.5 * deadband, 0.0, 0.0
    path, direction, turns = 0.0, 0.0, 0
    for k in range(step, signal.size, step):
        if use[k] and use[k - step]:
            x += signal[k] - signal[k - step]
        if abs(x - stem) <= half:
            continue
        new = x - half if x > stem else x + half
        moved = new - stem
        stem = new
        path += abs(moved)
        if abs(moved) > ROUNDING:
            now = 1.0 if moved > 0 else -1.0
            turns += direction == -now
            direction = now
    return path, turns


@njit(cache=True)
def sums_of(x: Trends, use: Mask, small_error: float, band: float) -> Sums:
    """Sums over the usable samples, at least one.

    small_error : limit of the error in good service; band : limit beyond which the error has a sign [% of span].
    """
    count, size, e, pv, op, sp, limits, service = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0
    for k in range(x.pv.size):
        if use[k]:
            error = x.sp[k] - x.pv[k]
            count += 1
            size, e, pv = size + abs(error), e + error, pv + x.pv[k]
            op, sp = op + x.op[k], sp + x.sp[k]
            limits += x.saturated[k]
            service += abs(error) < small_error and not x.saturated[k]
    e, pv, ee, vv = e / count, pv / count, 0.0, 0.0
    for k in range(x.pv.size):
        if use[k]:
            ee += (x.sp[k] - x.pv[k] - e) ** 2
            vv += (x.pv[k] - pv) ** 2
    sides = crossings_of(x.sp - x.pv, use, band)
    moved = np.abs(np.diff(x.sp)).sum()
    spread = math.sqrt(ee / count), math.sqrt(vv / count)
    shares = limits / count, service / count
    return Sums(
        size / count, sp / count, pv, op / count, spread[0], spread[1], shares[0], shares[1], sides, moved
    )


def at_limits_share(record: LoopRecord) -> float:
    """Share of the usable time with OP at a limit [-]; limits in manual do not count."""
    use = record.usable
    return float(record.mask("saturated")[use].mean()) if use.any() else 0.0


def noise_band(pv: Floats) -> float:
    """Standard deviation of the fast noise: of the differences (robust.py) over root 2."""
    if pv.size < 3:
        return 0.0
    return robust_deviation(np.diff(pv)) / math.sqrt(2)


def assess_span(record: LoopRecord, limits: FigureLimits, noise: float | None = None) -> Assessments:
    """The figures of one span of a record; `noise`, the noise band of PV [% of span], measured here if None."""
    use = record.usable
    count = int(use.sum())
    hours = count * record.dt_s / HOUR_S
    total = len(record) * record.dt_s / HOUR_S
    if count < 2 or hours < limits.least_share * min(total, 1.0):
        return Assessments(hours)
    step = max(round(limits.travel_grid_s / record.dt_s), 1)
    path, turns = travel_of(record.stem, use, step, limits.travel_deadband_pct)
    band = noise_band(record.pv[use]) if noise is None else noise
    trends = Trends(record.sp, record.pv, record.op, record.mask("saturated"))
    sums = sums_of(trends, use, limits.small_error_pct, 2 * band)
    spread = 2 * sums.pv_deviation
    good = ~record.bad
    automatic = 100 * float((good & ~record.mask("manual")).sum()) / max(float(good.sum()), 1.0)
    return Assessments(
        usable_h=hours,
        average_absolute_error_pct=sums.absolute_error,
        valve_travel_pct_per_h=path / hours,
        reversals_per_h=turns / hours,
        variability_pct=2 * sums.error_deviation,
        pv_variability_pct=100 * spread / abs(sums.pv) if abs(sums.pv) > spread else None,
        crossings_per_h=sums.crossings / hours,
        noise_band_pct=band,
        normal_pct=automatic,
        at_limits_pct=100 * sums.at_limits,
        service_pct=automatic * sums.service,
        sp_mean_pct=sums.sp,
        pv_mean_pct=sums.pv,
        op_mean_pct=sums.op,
        sp_travel_pct=sums.sp_travel,
    )


def hour_edges(record: LoopRecord) -> list[tuple[int, int, float]]:
    """First and last sample (excluded) and start [s] of each clock hour of the record."""
    first = math.floor(record.start_s / HOUR_S)
    last = math.ceil((record.start_s + record.duration_s) / HOUR_S - 1e-9)
    starts = [h * HOUR_S for h in range(first, last)]
    at = [min(max(math.ceil((s - record.start_s) / record.dt_s - 1e-6), 0), len(record)) for s in starts]
    ends = [*at[1:], len(record)]
    return [(a, b, s) for a, b, s in zip(at, ends, starts, strict=True) if b > a]


def _hourly_oscillation(
    found: Oscillations, record: LoopRecord, start_s: float, a: int, b: int
) -> tuple[float, float]:
    """Significance and oscillating share of the samples a to b; their sums are the night's."""
    if found.first is None or found.active is None or found.level is None:
        return 0.0, 0.0
    dt = found.active_dt_s
    skipped = len(record) * record.dt_s - found.active.size * dt
    first = max(round((a * record.dt_s - skipped) / dt), 0)
    last = max(round((b * record.dt_s - skipped) / dt), first)
    on = found.active[first:last]
    if on.size == 0:
        return 0.0, 0.0
    amplitude = found.first.amplitude_pct
    hours = float(on.sum()) * dt / HOUR_S
    return amplitude * max(found.first.rhythm.first, 0.0) * hours, 100 * float(on.mean())


def hourly(
    record: LoopRecord, found: Oscillations, limits: FigureLimits, noise: float | None = None
) -> list[Hour]:
    """The figures of each clock hour of a record; `noise`, the noise band of PV, measured here if None."""
    band = noise_band(record.pv[record.usable]) if noise is None else noise
    rows = []
    for a, b, start in hour_edges(record):
        significance, share = _hourly_oscillation(found, record, start, a, b)
        figures = assess_span(record.span(a, b), limits, band)
        if a > 0 and figures.sp_travel_pct is not None:  # such a move is between two hours' samples
            moved = abs(float(record.sp[a] - record.sp[a - 1]))
            figures = replace(figures, sp_travel_pct=figures.sp_travel_pct + moved)
        rows.append(Hour(start, figures, significance, share))
    return rows
