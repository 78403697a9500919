"""What a loop costs: error, travel, variability and the rest, hour by hour and for the night.

All figures are over good samples in automatic only, all survive gaps and constants, and what cannot be told is
None, never a good score.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from analyzer.config import FigureLimits
from analyzer.loop.oscillation import Oscillations
from identification.models import Backlash
from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation
from identification.simulation.valve import law_of, walk

HOUR_S = 3600.0
ROUNDING = 1e-9
"""Moves under this [% of OP] are rounding and turn nothing: a signal may stand exactly at the edge of the band."""


@dataclass(frozen=True, slots=True)
class Assessments:
    """Figures of one span; None where they cannot be told.

    usable_h : hours they rest on [h]; average_absolute_error_pct, variability_pct (2 sigma of e) and
    pv_variability_pct (2 sigma of PV over its mean) [%]; valve_travel_pct_per_h [%/h] of OP or, where recorded,
    of the position; reversals_per_h, crossings_per_h (of e beyond the noise band) [1/h]; noise_band_pct [% of
    span]; normal_pct, at_limits_pct, service_pct, shares of good time [%]; sp_mean_pct, pv_mean_pct,
    op_mean_pct, sp_travel_pct [% of span], which say whether two spans are comparable.
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


def crossings_of(e: Floats, use: Mask, band: float) -> int:
    """How often an error, where it may be used, goes from beyond one side of a band to beyond the other."""
    sides = e[use & (np.abs(e) > band)] > 0
    return int(np.count_nonzero(sides[1:] != sides[:-1]))


def travel_of(signal: Floats, use: Mask, step: int, deadband: float) -> tuple[float, int]:
    """Travel and reversals of every `step`-th sample of a signal beyond a deadband, shape (n,).

    Moves between usable neighbours make one path, and what lies beyond the deadband is what a stem behind such a play
    moves: what a signal moved during a gap is not known.
    """
    signal, use = signal[::step], use[::step]
    if signal.size < 2:
        return 0.0, 0
    path = np.cumsum(np.where(use[1:] & use[:-1], np.diff(signal), 0.0))
    moved = np.diff(walk(path, law_of(Backlash(deadband)), 0.0), prepend=0.0)
    ways = np.sign(moved[np.abs(moved) > ROUNDING])
    return summed(np.abs(moved)), int(np.count_nonzero(ways[1:] != ways[:-1]))


def summed(x: Floats) -> float:
    """The sum of values of shape (n,), n > 0, added one after the other: its last bit is then no matter of the
    machine's registers, and nights compare."""
    return float(np.cumsum(x)[-1])


def deviation(x: Floats) -> float:
    """Standard deviation of values of shape (n,), n > 0, in their unit."""
    return math.sqrt(summed((x - summed(x) / x.size) ** 2) / x.size)


def at_limits_share(record: LoopRecord) -> float:
    """Share of the usable time with OP at a limit [-]; in manual a limit limits nothing."""
    use = record.usable
    return float(record.mask("saturated")[use].mean()) if use.any() else 0.0


def noise_band(pv: Floats) -> float:
    """Standard deviation of the fast noise: of the differences (robust.py) over root 2."""
    if pv.size < 3:
        return 0.0
    return robust_deviation(np.diff(pv)) / math.sqrt(2)


def assess_span(record: LoopRecord, limits: FigureLimits, noise: float | None = None) -> Assessments:
    """The figures of one span of a record; `noise`, the noise band of PV [% of span], measured here where None."""
    use = record.usable
    count = int(use.sum())
    hours = count * record.dt_s / HOUR_S
    total = len(record) * record.dt_s / HOUR_S
    if count < 2 or hours < limits.least_share * min(total, 1.0):
        return Assessments(hours)
    step = max(round(limits.travel_grid_s / record.dt_s), 1)
    path, turns = travel_of(record.stem, use, step, limits.travel_deadband_pct)
    band = noise_band(record.pv[use]) if noise is None else noise
    error, pv, saturated = record.error[use], record.pv[use], record.mask("saturated")[use]
    pv_mean, spread = summed(pv) / count, 2 * deviation(pv)
    in_service = (np.abs(error) < limits.small_error_pct) & ~saturated
    good = ~record.bad
    automatic = 100 * float((good & ~record.mask("manual")).sum()) / max(float(good.sum()), 1.0)
    return Assessments(
        usable_h=hours,
        average_absolute_error_pct=summed(np.abs(error)) / count,
        valve_travel_pct_per_h=path / hours,
        reversals_per_h=turns / hours,
        variability_pct=2 * deviation(error),
        pv_variability_pct=100 * spread / abs(pv_mean) if abs(pv_mean) > spread else None,
        crossings_per_h=crossings_of(record.error, use, 2 * band) / hours,
        noise_band_pct=band,
        normal_pct=automatic,
        at_limits_pct=100 * (int(saturated.sum()) / count),
        service_pct=automatic * (int(in_service.sum()) / count),
        sp_mean_pct=summed(record.sp[use]) / count,
        pv_mean_pct=pv_mean,
        op_mean_pct=summed(record.op[use]) / count,
        sp_travel_pct=summed(np.abs(np.diff(record.sp))),
    )


def hour_edges(record: LoopRecord) -> list[tuple[int, int, float]]:
    """First and last sample (excluded) and start [s] of each clock hour that the record touches."""
    first = math.floor(record.start_s / HOUR_S)
    last = math.ceil((record.start_s + record.duration_s) / HOUR_S - 1e-9)
    starts = [h * HOUR_S for h in range(first, last)]
    at = [min(max(math.ceil((s - record.start_s) / record.dt_s - 1e-6), 0), len(record)) for s in starts]
    ends = [*at[1:], len(record)]
    return [(a, b, s) for a, b, s in zip(at, ends, starts, strict=True) if b > a]


def _hourly_oscillation(
    found: Oscillations, record: LoopRecord, start_s: float, a: int, b: int
) -> tuple[float, float]:
    """Significance and oscillating share of the samples a to b; they sum to the night's."""
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
    """The figures of each clock hour of a record; `noise`, the noise band of PV, measured here where None."""
    band = noise_band(record.pv[record.usable]) if noise is None else noise
    rows = []
    for a, b, start in hour_edges(record):
        significance, share = _hourly_oscillation(found, record, start, a, b)
        rows.append(Hour(start, assess_span(record.span(a, b), limits, band), significance, share))
    return rows
