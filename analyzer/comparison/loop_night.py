"""A night of a loop for the comparison under equal load: settings, constants and load, from its stored row."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from analyzer.comparison.block_bootstrap import Floats
from analyzer.loop.decisions import Cause, Fault, counts
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller
from identification.errors import InputError
from identification.models import ErrorForm, Form, Pid
from identification.signals.spectrum import PEAK_BAND


@dataclass(frozen=True, slots=True)
class LoopNight:
    """Results of one night for a loop.

    constants, logs of slope [%/(% s)], time constant and dead time [s], and deviations of the logs, shape (3,)
    each, None without a fit; sign, of the slope; width, jump, of the valve's fault [% OP]; at_fault, whether it
    has one by all nights, and faulty_this_night by this one; cycle_s, period of a cycle caused by the valve [s], 0
    for none; frequency [Hz] and level [dB of % PV per line], shape (b,), of the error without the part explained
    by the set point; duration_s; error [% PV], its recorded average; op_travel [%/h]; moves [1/h] and their size
    [% PV] of the set point; from_outside, whether a load's cycle was found; cycles, whether the loop cycles at
    all.
    """

    constants: tuple[Floats, Floats] | None
    sign: float
    width: float
    jump: float
    at_fault: bool
    faulty_this_night: bool
    cycle_s: float
    frequency: Floats
    level: Floats
    duration_s: float
    error: float
    op_travel: float
    moves: float
    size: float
    from_outside: bool
    cycles: bool

    @property
    def noise_db(self) -> float:
        """Level at the record's highest frequencies, above the control bandwidth [dB]."""
        return float(np.mean(self.level[-3:]))

    @property
    def dt_s(self) -> float:
        """Interval of the record's samples [s], within a sixth."""
        return float(1.0 / (2.0 * PEAK_BAND * self.frequency[-1]))


def pid_of(row: Mapping[str, Any], kp: float | None = None, ti: float | None = None) -> Pid | None:
    """The settings of a night's row, or others in its units, in percent and seconds; None if unknown."""
    terms = json.loads(row["controller"] or "{}")
    share, shape = terms.pop("gain_share", 1.0), ErrorForm(terms.pop("error_form", ErrorForm.LINEAR))
    spec = LoopSpec(
        row["loop"],
        **terms,
        error_form=shape,
        pv_lo=row["pv_lo"],
        pv_hi=row["pv_hi"],
        kp=row["kp"] if kp is None else kp,
        ti=row["ti"] if ti is None else ti,
        form=Form(row["form"] or "ideal"),
        gain_unit=row["gain_unit"] or "percent",
        ti_unit=row["ti_unit"] or "s",
    )
    span = None if None in (spec.pv_lo, spec.pv_hi) else float(spec.pv_hi or 0.0) - float(spec.pv_lo or 0.0)
    try:
        return controller(spec, span, share)
    except InputError:
        return None


def night_of(row: Mapping[str, Any]) -> LoopNight | None:
    """Results in a row of the table of nights; None if it has no spectrum or error of the loop."""
    if not row["spectrum"] or not row["average_absolute_error_pct"] or not row["duration_s"]:
        return None
    kept = json.loads(row["spectrum"])
    level = np.array(kept["db"], float)
    if level.size < 6:
        return None
    known, evidence = row["duration_s"], json.loads(row["witness"] or "{}")
    fault = row["valve_fault"] in (Fault.BACKLASH, Fault.STICTION)
    own = row["backlash_pct"] or row["stickband_pct"] or 0.0
    width, jump = evidence.get("width", [own])[0], evidence.get("slip_jump", [row["slip_jump_pct"] or 0.0])[0]
    valve_made = row["cause"] == Cause.VALVE and row["period_s"] is not None
    hours, moves = known / 3600.0, row["sp_moves"] or 0.0
    travel = row["sp_travel_pct"] or 0.0
    return LoopNight(
        *_constants(row, evidence),
        width if fault else 0.0,
        jump if fault else 0.0,
        fault,
        "width" in evidence,
        row["period_s"] if valve_made else 0.0,
        2.0 ** (np.arange(level.size) / 6.0) / kept["period_s"],
        level,
        known,
        row["average_absolute_error_pct"],
        row["valve_travel_pct_per_h"] or 0.0,
        moves / hours if moves else (1.0 / hours if travel else 0.0),
        travel / moves if moves else travel,
        row["cause"] == Cause.LOAD and counts(row["oscillating_pct"]),
        row["period_s"] is not None and counts(row["oscillating_pct"]),
    )


def _constants(
    row: Mapping[str, Any], evidence: Mapping[str, Any]
) -> tuple[tuple[Floats, Floats] | None, float]:
    """Logs of slope, time constant and dead time with their deviations, and the slope's sign."""
    if "slope" in evidence:
        pairs = np.array([evidence[name] for name in ("slope", "time_constant_s", "dead_time_s")], float)
    elif row["slope_pct_per_s"] and row["dead_time_s"] is not None:
        lag = row["time_constant_s"] or 0.25 * row["duration_s"]
        pairs = np.array([[row["slope_pct_per_s"], 0.2], [lag, 0.3], [row["dead_time_s"], 0.2]])
    else:
        return None, 1.0
    sign = math.copysign(1.0, pairs[0, 0])
    return (np.log(np.maximum(np.abs(pairs[:, 0]), 1e-9)), pairs[:, 1]), sign
