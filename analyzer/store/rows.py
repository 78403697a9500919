"""An assessment as rows of tables: the ranking's columns are a contract, the others follow them."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from analyzer.loop.advice import is_known
from analyzer.loop.assess import Assessment
from analyzer.loop.cause import Verdict
from analyzer.columns import HOURS, row_of
from analyzer.config import AdviceLimits
from analyzer.pages.cost import RECORDED, STATED, loss
from analyzer.loop.decisions import CAUSES, Cause, Fault, Lack, Status
from analyzer.loops.spec import LoopSpec
from analyzer.loop.oscillation import Oscillations
from analyzer.loop.tight import gain_room
from identification.estimation.hammerstein import Fit
from identification.estimation.window import Window

NOT_SHOWN = (
    *("oscillation_significance", "oscillating_pct", "osc_valve_pct", "osc_tuning_pct", "osc_load_pct"),
    *("regularity", "prominence", "correlation", "period_s", "pv_amplitude_pct"),
    *("close_first_s", "close_last_s"),
)
"""Columns that stay empty where the record cannot show whether the loop oscillates."""


def empty_row(spec: LoopSpec, night: str) -> dict[str, Any]:
    """A row in which nothing but the loop's own facts is known."""
    known = {
        "loop": spec.loop,
        "type": spec.type,
        "area": spec.area,
        "master": spec.master,
        "description": spec.description,
        "pv_unit": spec.pv_unit,
        "op_unit": spec.op_unit,
        "importance": spec.importance,
        "percent_of": STATED if spec.has_pv_range else RECORDED,
        "kp": spec.kp,
        "ti": spec.ti,
        "form": str(spec.form),
        "gain_unit": spec.gain_unit,
        "ti_unit": spec.ti_unit,
        "extra": json.dumps(dict(spec.extra)),
        "night": night,
    }
    return row_of(known)


@dataclass(frozen=True, slots=True)
class Lost:
    """Why a loop has no results: its status, the reason in words, and what the record lacks where that is known."""

    status: Status
    reason: str
    lack: Lack | None = None


def lost_row(spec: LoopSpec, night: str, lost: Lost) -> dict[str, Any]:
    """The row of a loop that was not assessed or failed, with the reason."""
    return {**empty_row(spec, night), "status": lost.status, "reason": lost.reason, "lack": lost.lack}


def _process_columns(fit: Fit, window: Window, limits: AdviceLimits) -> dict[str, float | None]:
    """Process constants; gain and time constant apart only where the time constant is well inside the window."""
    known = is_known(fit, window, limits)
    return {
        "gain": fit.gain if known else None,
        "time_constant_s": fit.time_constant_s if known else None,
        "slope_pct_per_s": fit.slope,
        "dead_time_s": fit.dead_time_s + window.half_block_s,
    }


def _model_columns(verdict: Verdict, limits: AdviceLimits) -> dict[str, float | None]:
    m = verdict.measured
    if m is None or verdict.cause not in (Cause.VALVE, Cause.TUNING):
        return {}
    if verdict.cause is Cause.TUNING:
        return _process_columns(m.linear, m.window, limits)
    if verdict.fault is Fault.STICTION and m.stick_slip is not None:
        valve = m.stick_slip.valve
        columns = {"stickband_pct": valve.stickband, "slip_jump_pct": valve.slip_jump}
        return {**_process_columns(m.stick_slip, m.window, limits), **columns}
    return {**_process_columns(m.play, m.window, limits), "backlash_pct": m.play.valve.stickband}


PER_OP = ("gain", "slope_pct_per_s", "backlash_pct", "stickband_pct", "slip_jump_pct")
"""Constants in percent of OP, or per percent of it."""


def _in_known_units(columns: dict[str, float | None], op_scaled: bool) -> dict[str, float | None]:
    """A model's constants without those that want OP in percent, where it is not."""
    return columns if op_scaled else {k: None if k in PER_OP else v for k, v in columns.items()}


def _oscillation_columns(a: Assessment) -> dict[str, Any]:
    first = a.oscillations.first
    if first is None:
        return {"oscillation_significance": 0.0, "oscillating_pct": 0.0, "periods": "[]"}
    periods = [{"period_s": o.period_s, "amplitude_pct": o.amplitude_pct} for o in a.oscillations.found]
    return {
        "oscillation_significance": first.significance,
        "oscillating_pct": first.oscillating_pct,
        "period_s": first.period_s,
        "pv_amplitude_pct": first.amplitude_pct,
        "regularity": first.rhythm.regularity,
        "prominence": first.prominence,
        "correlation": first.rhythm.first,
        "periods": json.dumps(periods),
        "spectrum": _spectrum(a.oscillations),
    }


def _spectrum(found: Oscillations) -> str | None:
    """Power in sixths of an octave as the store keeps it."""
    s, b = found.spectrum, found.bands
    if s is None or b is None or not b.line.size:
        return None
    level = 10 * np.log10(np.maximum(b.power, 1e-30) * (2.0 / s.n) ** 2)
    return json.dumps({"period_s": round(s.duration_s / float(b.line[0]), 3), "db": np.round(level).tolist()})


def night_row(a: Assessment, spec: LoopSpec, night: str, limits: AdviceLimits) -> dict[str, Any]:
    """The row of one loop and night, with every column."""
    v, m = a.verdict, a.verdict.measured
    lacking = a.needs or v.needs
    signs = [asdict(replace(s, strength=round(s.strength, 3))) for s in v.signs]
    row = {
        **empty_row(spec, night),
        **a.night.as_row(),
        "loss": loss(a.night.average_absolute_error_pct, spec.importance, spec.has_pv_range),
        **_oscillation_columns(a),
        **_in_known_units(_model_columns(v, limits), a.op_scaled),
        "status": Status.OK,
        **{f"osc_{c}_pct": v.confidence[c] for c in CAUSES},
        "cause": v.cause,
        "valve_fault": v.fault,
        "start_s": a.start_s,
        "duration_s": a.duration_s,
        "evidence": m.evidence if m else None,
        "valve_size": m.size if m else None,
        "amplification": m.amplification if m else None,
        "gain_room": gain_room(m) if m else None,
        "harris_index": a.harris,
        "settling_time_s": a.settling_s,
        "signs": json.dumps(signs),
        "lack": lacking.lack if lacking is not None else None,
        "notes": "; ".join((*a.notes, f"cause not assessed: {v.needs}") if v.needs else a.notes),
    }
    if a.close_s is not None:
        row["close_first_s"], row["close_last_s"] = a.close_s
    if a.needs is not None:
        row.update(dict.fromkeys(NOT_SHOWN), cause=Cause.UNDECIDED, valve_fault=Fault.UNDECIDED)
    return {k: _finite(v) for k, v in row_of(row).items()}


def _finite(value: Any) -> Any:
    """None for numbers that are none, so that nothing unknown reaches a table as a number."""
    if value is None or isinstance(value, str):
        return value
    return float(value) if math.isfinite(value) else None


def hour_rows(a: Assessment, night: str) -> list[dict[str, Any]]:
    """Rows of the hourly table."""
    return [
        row_of(
            {
                "loop": a.loop,
                "night": night,
                "hour_s": h.start_s,
                "oscillation_significance": h.oscillation_significance,
                "oscillating_pct": h.oscillating_pct,
                **{k: _finite(v) for k, v in h.figures.as_row().items()},
            },
            HOURS,
        )
        for h in a.hours
    ]
