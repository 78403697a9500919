"""Finding of one loop in one night, from its assessment and the advice on it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import AdviceLimits
from analyzer.loop.advice.advise import Advice
from analyzer.loop.assess import Assessment
from analyzer.loop.cause.verdict import Verdict
from analyzer.loop.cost import RECORDED, STATED, loss
from analyzer.loop.decisions import (
    Action,
    Cause,
    Cell,
    Fault,
    Finding,
    OscillationFigures,
    Remedy,
    Requirement,
    Status,
)
from analyzer.loop.identification.identified import gain_room
from analyzer.loop.identification.intervals import intervals, is_known
from analyzer.loop.identification.measure import Measured
from analyzer.loop.oscillation.detection import Oscillations
from analyzer.loop.oscillation.setpoint_moves import as_row
from analyzer.loops.spec import LoopSpec

Known = dict[str, Cell]
AS_STATED = (
    *("type", "area", "master", "ratio_of", "split_of", "override_with", "description", "pv_unit", "op_unit"),
    *("importance", "kp", "ti", "gain_unit", "ti_unit"),
)
"""Columns of loops.csv that are columns of a finding."""
PER_OP = ("gain", "slope_pct_per_s", "backlash_pct", "stickband_pct", "slip_jump_pct")
"""Constants in percent of OP, or per percent of it."""


def stated(spec: LoopSpec) -> Known:
    """Facts of a loop stated in loops.csv, by column."""
    return {
        **{name: getattr(spec, name) for name in AS_STATED},
        "percent_of": STATED if spec.has_pv_range else RECORDED,
        "form": str(spec.form),
        "extra": json.dumps(dict(spec.extra)),
    }


@dataclass(frozen=True, slots=True)
class FailedLoop:
    """Reason for a loop without results: its status, and the missing data or the error that ended it."""

    status: Status
    why: Requirement

    def of(self, spec: LoopSpec, night: str, **known: Cell) -> Finding:
        """The same as a finding, with further known columns."""
        return Finding(
            spec.loop, night, self.status, self.why, self.why.lack, known={**stated(spec), **known}
        )


def concluded(
    a: Assessment, advice: Advice, spec: LoopSpec, night: str, limits: AdviceLimits, **known: Cell
) -> Finding:
    """Finding of an assessed loop: spec, with the settings in force at the night's end; known, further columns."""
    v = a.verdict
    lacks = a.needs or v.needs
    due = advice.due if advice.action is Action.REPAIR_VALVE else None
    shown = a.needs is None  # the record can show whether the loop oscillates
    return Finding(
        spec.loop,
        night,
        Status.OK,
        lacking=lacks,
        lack=advice.lack or (lacks.lack if lacks else None),
        swing=_swing(a.oscillations) if shown else None,
        cause=v.cause if shown else Cause.UNDECIDED,
        fault=v.fault if shown else Fault.UNDECIDED,
        confidence={c: pct for c, pct in v.confidence.items() if math.isfinite(pct)} if shown else {},
        signs=tuple(replace(s, strength=round(s.strength, 3)) for s in v.signs),
        remedy=Remedy(advice.action, advice.reason, advice.kp_new, advice.ti_new, due),
        known={
            **stated(spec),
            **a.night.as_row(),
            "loss": loss(a.night.average_absolute_error_pct, spec.importance, spec.has_pv_range),
            **(_cycle_known(a) if shown else {}),
            **_measured(a, limits),
            **_cycles_of(advice),
            **(a.shared.as_row() if a.shared is not None else {}),
            **(_of_half(v, limits) if spec.split_of else {}),
            **known,
        },
    )


def _swing(found: Oscillations) -> OscillationFigures:
    first = found.first
    if first is None:
        return OscillationFigures()
    return OscillationFigures(first.significance, first.oscillating_pct, first.period_s, first.amplitude_pct)


def _cycle_known(a: Assessment) -> Known:
    """Regularity of the most significant oscillation, the periods of all, and the ends of its last ten."""
    first, found = a.oscillations.first, a.oscillations.found
    spectrum = _spectrum_kept(a.oscillations)
    out: Known = {"periods": "[]", "spectrum": spectrum}
    if first is not None:
        periods = [{"period_s": o.period_s, "amplitude_pct": o.amplitude_pct} for o in found]
        out = {
            "regularity": first.rhythm.regularity,
            "prominence": first.prominence,
            "correlation": first.rhythm.first,
            "periods": json.dumps(periods),
            "spectrum": spectrum,
        }
    return out if a.close_s is None else {**out, "close_first_s": a.close_s[0], "close_last_s": a.close_s[1]}


def _spectrum_kept(found: Oscillations) -> str | None:
    """Power in sixths of an octave, as the store keeps it."""
    s, b = found.spectrum, found.bands
    if s is None or b is None or not b.line.size:
        return None
    level = 10 * np.log10(np.maximum(b.power, 1e-30) * (2.0 / s.n) ** 2)
    return json.dumps({"period_s": round(s.duration_s / float(b.line[0]), 3), "db": np.round(level).tolist()})


def _measured(a: Assessment, limits: AdviceLimits) -> Known:
    """Measures of the verdict, its model, and notes."""
    v, m = a.verdict, a.verdict.measured
    out: Known = {
        "start_s": a.start_s,
        "duration_s": a.duration_s,
        "harris_index": a.harris,
        **as_row(a.moves),
        "notes": "; ".join(
            (*a.notes, f"cause not assessed: {v.needs}") if v.needs and m is None else a.notes
        ),
    }
    if m is not None:
        out |= {
            "evidence": m.evidence,
            "valve_size": m.size,
            "amplification": m.amplification,
            "gain_room": gain_room(m),
        }
    model = _model_known(v, limits)
    return {**out, **(model if a.op_scaled else {k: x for k, x in model.items() if k not in PER_OP})}


def _model_known(verdict: Verdict, limits: AdviceLimits) -> Mapping[str, float | None]:
    """The reported constants; gain and time constant separately only if the latter is well inside the fitted rows."""
    m = verdict.measured
    if m is None:
        return {}
    if verdict.cause is not Cause.VALVE and verdict.fault in (Fault.BACKLASH, Fault.STICTION):
        return _process_known(verdict, limits) | _valve_width(verdict.fault, m)
    return _process_known(verdict, limits)


def _valve_width(fault: Fault, m: Measured) -> dict[str, float | None]:
    """The width of a faulty valve if the cause is another one."""
    if fault is Fault.STICTION and m.stick_slip is not None:
        valve = m.stick_slip.valve
        return {"stickband_pct": valve.stickband, "slip_jump_pct": valve.slip_jump}
    return {"backlash_pct": m.backlash.valve.stickband}


def _process_known(verdict: Verdict, limits: AdviceLimits) -> dict[str, float | None]:
    """Constants of the process, and of the valve that causes the cycle."""
    if verdict.cause not in (Cause.VALVE, Cause.TUNING):
        return {}
    m, fit = verdict.measured, verdict.fit
    is_identified, valve = is_known(fit, limits), fit.valve
    process: dict[str, float | None] = {
        "gain": fit.gain if is_identified else None,
        "time_constant_s": fit.time_constant_s if is_identified else None,
        "slope_pct_per_s": fit.slope,
        "dead_time_s": fit.process.dead_time_s,
    }
    if verdict.cause is Cause.TUNING:
        return process
    if m is not None and fit is m.stick_slip:
        return {**process, "stickband_pct": valve.stickband, "slip_jump_pct": valve.slip_jump}
    return {**process, "backlash_pct": valve.stickband}


def _of_half(verdict: Verdict, limits: AdviceLimits) -> Known:
    """Response speed of the process to a half of a split range without a valve fault, if set point moves determine it
    well."""
    m = verdict.measured
    if m is None or not m.excited or verdict.cause is not Cause.NONE:
        return {}
    slope = intervals(m.linear, False, limits)["slope_pct_per_s"]
    least, most = sorted((abs(slope.low), abs(slope.high)))
    one_way = slope.low * slope.high > 0.0
    return {"half_slope": slope.value} if one_way and most < limits.half_within * least else {}


def _cycles_of(advice: Advice) -> Known:
    """Limit cycles in simulation at the present (predicted) and at the new (expected) settings."""
    out: Known = {}
    for name, cycle in (("predicted", advice.before), ("expected", advice.after)):
        if cycle is not None:
            out |= {f"{name}_period_s": cycle.period_s, f"{name}_pv_amplitude_pct": cycle.pv_amplitude}
    return out
