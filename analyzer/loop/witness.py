"""Evidence of one record about valve and process, regardless of its verdict: stored with the night, so that nights
can be combined."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from analyzer.config import CauseLimits, Config
from analyzer.loop.cause.verdict import Verdict, agrees, fault_of, hidden_by_grid, jump_evidence, needed
from analyzer.loop.decisions import Cause, Fault
from analyzer.loop.identification.intervals import DECODED, slope_deviation
from analyzer.loop.identification.measure import Measured
from analyzer.loop.record.quality import Prepared
from identification.estimation.backlash_stiction import WIDTHS, width_profile
from identification.estimation.descent import LEAST_JUMP
from identification.estimation.gauss_newton import covariance
from identification.record import Floats
from identification.signals.robust import robust_deviation

Known = tuple[float, float]
"""A constant and the standard deviation of its logarithm."""


def witness(verdict: Verdict, oscillates: bool, prepared: Prepared, config: Config) -> str | None:
    """Evidence of a record, as the store keeps it (JSON): the profile of widths and the evidence required for a fault
    [nat], the evidence for a slip jump and its required value [nat], and constants with the deviation of their
    logarithms; None if nothing was fitted, or PV's grid may keep PV constant as a valve would. Compression cuts OP
    reversals so that they look like slips: there is no evidence for a jump then."""
    m, limits = verdict.for_settings.measured, config.cause
    if m is None or hidden_by_grid(m, prepared.pv_step, oscillates, limits):
        return None
    if not oscillates and not agrees(m, limits):
        m = replace(m, evidence=min(m.evidence, 0.0))
    with_valve_oscillation = oscillates and verdict.cause is Cause.VALVE
    # one friction for all slips hides their jumps
    slips = None if verdict.for_settings is verdict else verdict.measured
    whole = prepared.compressed_share <= config.lanes.straight_share
    jump = jump_evidence(slips or m, limits) if whole else (0.0, 0.0)
    values = {
        "profile": [
            round(float(x), 1) for x in _profile(m, 0.0 if with_valve_oscillation else limits.noise_widths)
        ],
        "needed": round(needed(m, limits, oscillates), 1),
        "op_range": float(f"{m.backlash.valve.stickband / m.size:.4g}") if m.size > 0 else 0.0,
        "jump": [round(x, 1) for x in jump],
        **{
            k: [float(f"{x:.4g}") for x in known]
            for k, known in _constants_of_fit(m, slips, limits, oscillates).items()
        },
    }
    return json.dumps(values, separators=(",", ":"))


def _profile(m: Measured, noise_widths: float) -> Floats:
    """The profile of widths [nat], its positive part scaled to the evidence that remains after outliers; zero for
    widths under `noise_widths` deviations of OP's noise, which sometimes crosses such a backlash."""
    found = width_profile(m.linear, m.backlash)
    crossed = (
        noise_widths * robust_deviation(np.abs(np.diff(m.problem.blocks.op, 2))) / math.sqrt(6.0) > WIDTHS
    )
    found[crossed] = 0.0
    most = float(found.max())
    if most <= 0.0 or most <= m.evidence:
        return found
    return np.where(found > 0.0, found * max(m.evidence, 0.0) / most, found)


def _constants_of_fit(
    m: Measured, slips: Measured | None, limits: CauseLimits, oscillates: bool
) -> Mapping[str, Known]:
    """Constants of the better fit: of the valve's if PV shows its fault, else of the process alone; the valve's
    constants are those identified slip by slip, if there are any."""
    worn = m.evidence >= needed(m, limits, oscillates)
    sticks = worn and fault_of(m, limits) is Fault.STICTION and m.stick_slip is not None
    fit = (m.stick_slip if sticks else m.backlash) if worn else m.linear
    assert fit is not None
    spread, found = covariance(fit, free_width=worn), {}
    if np.isfinite(spread).all() and fit.gain != 0.0:
        dead_s = fit.process.dead_time_s
        found = {
            "slope": (fit.slope, slope_deviation(fit, spread)),
            "time_constant_s": (fit.time_constant_s, math.sqrt(spread[0, 0])),
            "gain": (fit.gain, math.sqrt(spread[3, 3]) / abs(fit.gain)),
            "dead_time_s": (dead_s, math.sqrt(spread[1, 1]) / max(dead_s, 1e-9)),
        }
        if worn:
            relative = math.sqrt(spread[2, 2]) / max(fit.valve.stickband, 1e-9)
            found |= {"width": (fit.valve.stickband, relative), "slip_jump": (fit.valve.slip_jump, relative)}
    if slips is not None and slips.stick_slip is not None:
        valve = slips.stick_slip.valve
        found["width"] = valve.stickband, DECODED
        found["slip_jump"] = valve.slip_jump, math.log(LEAST_JUMP)
    return found
