"""The figures of lanes: from samples as logged, so that a loop that cannot be assessed, for example all in manual,
still has its lane."""

from __future__ import annotations

import math

import numpy as np

from analyzer.config import Config, LaneLimits
from analyzer.history.plant_clock import HOUR_S
from analyzer.loop.oscillation.figures import hour_edges, noise_band
from analyzer.loop.record.quality import Prepared
from identification.models import Pid
from identification.record import LoopRecord
from identification.signals.correlation import SMOOTHING, correlation_time
from identification.signals.setpoint_response import moves

AVERAGING = "level"
"""Loop type that is slow on purpose: a level buffers flow."""
PARTS, PART_TI = 8, 20.0
"""Largest number of parts of a record for the correlation time, and the least length of one in integral times. While
set point or load are on a ramp, any PI loop has a constant error. In benchmarks/world (seeds 665 to 667)
eight of 24 loops without a fault are called sluggish by a day with three ramps of the load. By its parts
one is. Of 24 sluggish loops 18 and 12 are called so; on a day without ramps 11 and 10."""


def _percent(part: np.ndarray, whole: np.ndarray) -> float | None:
    return 100.0 * float(part[whole].mean()) if whole.any() else None


def _lasting_error(record: LoopRecord, limits: LaneLimits) -> float | None:
    """The typical hour's mean error, without ramps of a programme; None without a recorded set point or without an
    hour that is half usable."""
    if record.sp_estimated:
        return None
    moving = moves(record.sp)
    holds = moving.mean() <= limits.programme  # a slave's set point is never constant
    use, error = record.usable & ~(moving & holds), record.error
    hours = [
        abs(float(error[a:b][use[a:b]].mean()))
        for a, b, _ in hour_edges(record)
        if use[a:b].sum() * record.dt_s >= limits.hour_share * HOUR_S
    ]
    return float(np.median(hours)) if hours else None


def _memory(prepared: Prepared, controller: Pid | None, kind: str, config: Config) -> float | None:
    """The error's correlation time in Ti, the median over parts of the record; None if it is not meaningful, because
    the loop is at its set point within the resolution or noise of PV, or because compression would increase it."""
    record, use = prepared.record, prepared.record.usable
    if controller is None or kind == AVERAGING or prepared.compressed_share > config.lanes.straight_share:
        return None
    if float(use.mean()) < config.quality.usable_share:
        return None
    averaged = max(SMOOTHING * controller.ti_s / record.dt_s, 1.0)
    noise = config.lanes.noise * noise_band(record.pv) / math.sqrt(averaged)
    floor = max(config.lanes.at_set_point, prepared.pv_step, noise)
    if float(np.median(np.abs(record.error[use]))) <= floor:
        return None
    count = int(np.clip(len(record) * record.dt_s / (PART_TI * controller.ti_s), 1.0, PARTS))
    parts = zip(np.array_split(record.error, count), np.array_split(use, count), strict=True)
    times = (correlation_time(error, good, record.dt_s, controller.ti_s) for error, good in parts)
    found = [x for x in times if x is not None]
    return float(np.median(found)) / controller.ti_s if found else None


def standing(
    prepared: Prepared, controller: Pid | None, kind: str, config: Config
) -> dict[str, float | None]:
    """The figures of one prepared record by column; None if unknown.

    manual_pct, at_limits_pct : shares of the good time [%], the latter of that in automatic if there is any;
    frozen_pct : share of the time in which PV is constant while OP moves [%]; lasting_error_pct : median over the
    hours of the size of the hour's mean error [% of span]; error_memory_ti : correlation time of the error in Ti [-].
    Without a controller, the settings in force, no loop is sluggish; `kind` is the loop's type.
    """
    record, op = prepared.record, prepared.op_known
    scaled = op and prepared.op_scaled
    good, use = ~record.bad, record.usable
    return {
        "manual_pct": _percent(record.mask("manual"), good) if op else None,
        "at_limits_pct": _percent(record.mask("saturated"), use if use.any() else good) if scaled else None,
        "frozen_pct": 100.0 * float(record.mask("stale").mean()) if op else None,
        "lasting_error_pct": _lasting_error(record, config.lanes),
        "error_memory_ti": _memory(prepared, controller, kind, config),
    }
