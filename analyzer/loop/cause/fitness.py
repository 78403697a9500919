"""Missing data of trends for identifying a cause, or for new settings."""

from __future__ import annotations

import numpy as np

from analyzer.config import Config, QualityLimits
from analyzer.loop.decisions import MissingData, Requirement, RequirementKind
from analyzer.loop.oscillation.detection import Oscillation
from analyzer.loop.oscillation.figures import at_limits_share
from analyzer.loop.record.quality import Prepared, op_range
from identification.controller.switching import switching
from identification.limits import RecorderLimits
from identification.mismatch.recording import least_jump
from identification.models import Pid
from identification.record import LoopRecord

HELD, MOVES = 4, 20
"""Least samples of a constant PV, and least moves of OP in all of them, that show to what it responds; ours."""
AGAINST = 0.1
"""Share of OP moves of unusual sign while PV is constant, from which OP responds to an unrecorded PV;
ours. It is 0 for sensors that stick by .3 to 3 %. It is .17 to .5 in 34 of 37 loops recorded by exception
in benchmarks/world (seeds 621, 622)."""


def unfit_for_cause(
    prepared: Prepared, oscillation: Oscillation | None, config: Config
) -> Requirement | None:
    """Missing data of these trends for a cause; None if one can be identified.

    oscillation : None if the loop does not oscillate, or this is unknown.
    """
    record, q = prepared.record, config.quality
    if not prepared.op_known:
        return Requirement(MissingData.OP, RequirementKind.OP)
    if float(np.ptp(record.op)) == 0.0:
        return Requirement(MissingData.MOVING_OP, RequirementKind.MOVING_OP)
    two = switching(record.op, record.usable)
    if two is not None:
        return Requirement(MissingData.SWITCHES, RequirementKind.SWITCHES, (two.low, two.high, two.switches))
    jumps = pv_that_jumps(record, config.explain.recorder)
    return jumps or compressed(prepared, oscillation, q) or at_limits(record, q)


def pv_that_jumps(record: LoopRecord, limits: RecorderLimits) -> Requirement | None:
    """Requirement of a PV that is constant and then jumps, as behind a sticking valve, although the sensor causes it;
    None of any other, as of a PV of which the historian alone left out small changes."""
    measured = record.pv[~record.bad]
    jump, constant = least_jump(measured, limits), float(np.mean(np.diff(measured) == 0.0))
    if jump and responds_to_more(record):
        return None
    return (
        Requirement(MissingData.FINER, RequirementKind.PV_AS_MEASURED, (100.0 * constant, jump))
        if jump > 0.0
        else None
    )


def responds_to_more(record: LoopRecord) -> bool:
    """Whether OP responds to a PV that the record does not show, while the recorded one is constant.

    A controller behind a sticking sensor has its integral alone then: OP moves by the sign of the error, always. A
    filter of PV acts in the first half of a constant PV, which does not count. Without a set point no error is known.
    """
    if record.sp_estimated:
        return False
    k, held = np.arange(len(record)), np.diff(record.pv, prepend=np.nan) == 0.0
    last = np.maximum.accumulate(np.where(held, 0, k))
    after = np.minimum.accumulate(np.where(held, len(record), k)[::-1])[::-1]
    late = held & (2 * (k - last) >= after - last) & (after - last >= HELD) & ~record.bad
    moved = np.diff(record.op, prepend=record.op[:1]) * record.error
    forth = moved[late & (moved != 0.0)] > 0.0
    share = float(np.mean(forth)) if forth.size >= MOVES else 0.0
    return min(share, 1.0 - share) > AGAINST


def compressed(prepared: Prepared, oscillation: Oscillation | None, q: QualityLimits) -> Requirement | None:
    """Requirement of trends that a historian compressed; None if it did not, or kept enough of each cycle."""
    if prepared.compressed_share <= q.straight_share:
        return None
    straight_pct = 100 * prepared.compressed_share
    if oscillation is None:
        return Requirement(MissingData.UNCOMPRESSED, RequirementKind.UNCOMPRESSED, (straight_pct,))
    points = prepared.archived_share * oscillation.period_s / prepared.record.dt_s
    if points >= q.archived_points:
        return None
    return Requirement(
        MissingData.UNCOMPRESSED, RequirementKind.ARCHIVED, (q.archived_points, points, straight_pct)
    )


def at_limits(record: LoopRecord, q: QualityLimits) -> Requirement | None:
    """Requirement of a record with OP at a limit for most of the time; None for others."""
    saturated = at_limits_share(record)
    if saturated <= q.saturated_share:
        return None
    return Requirement(MissingData.OP_OFF_LIMITS, RequirementKind.OFF_LIMITS, (100 * saturated,))


def unfit_for_settings(prepared: Prepared, config: Config) -> Requirement | None:
    """Missing data of these trends for new settings; None if the trends themselves are sufficient."""
    if not prepared.op_scaled:
        return op_range(prepared.scale, prepared.record.op)
    return compressed(prepared, None, config.quality)


def too_thin(dt_s: float, controller: Pid | None, config: Config) -> Requirement | None:
    """Sampling required for new settings if the controller acts several times between two samples, unrecorded."""
    samples = config.settings.ti_samples
    if controller is None or dt_s <= controller.ti_s / samples:
        return None
    return Requirement(
        MissingData.FASTER, RequirementKind.OF_SETTINGS, (controller.ti_s / samples, controller.ti_s, dt_s)
    )
