"""Missing data of trends for identifying a cause, or for new settings."""

from __future__ import annotations

import numpy as np

from analyzer.config import Config, QualityLimits
from analyzer.loop.assessments import at_limits_share
from analyzer.loop.decisions import MissingData, Requirement, RequirementKind
from analyzer.loop.oscillation import Oscillation
from analyzer.loop.quality import Prepared, op_range
from identification.controller.switching import switching
from identification.limits import RecorderLimits
from identification.mismatch.recording import least_jump
from identification.models import Pid
from identification.record import LoopRecord


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
    None of any other."""
    measured = record.pv[~record.bad]
    jump, stands = least_jump(measured, limits), float(np.mean(np.diff(measured) == 0.0))
    return (
        Requirement(MissingData.FINER, RequirementKind.PV_AS_MEASURED, (100.0 * stands, jump))
        if jump > 0.0
        else None
    )


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
