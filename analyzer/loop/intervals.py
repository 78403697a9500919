"""Constants of a fitted loop with their 90 % intervals, as `triage tune` tells them."""

from __future__ import annotations

import math

import numpy as np

from analyzer.config import AdviceLimits
from analyzer.loop.advice import lag_factor
from identification.estimation.covariance import (
    DECODED,
    JUMPING,
    LATER,
    LEAST_BAND,
    LEAST_BLOCK,
    LEAST_JUMP,
    LEAST_SHARE,
    SLOPE_ALONE,
    SOONER,
    WIDER,
    half_width,
    reaching,
)
from identification.estimation.gauss_newton import covariance
from identification.estimation.hammerstein import Fit
from identification.estimation.window import Window
from identification.models import Estimate
from identification.simulation.valve import StemLaw


def intervals(fit: Fit, valve: bool, limits: AdviceLimits) -> dict[str, Estimate]:
    """Estimates of a fit with 90 % intervals from the curvature of the likelihood and the scatter of its scores.

    Gain and time constant are left out where the record tells their ratio alone (advice.lag_factor). Of a
    valve that jumps PV tells jump times slope; only slips beyond the first of a half cycle part the two, so both
    are told within wide limits. proofs/coverage.md says how often the intervals hold the truth.
    """
    spread = np.sqrt(np.maximum(np.diag(covariance(fit, free_width=valve)), 0.0))
    t, window = fit.time_constant_s, fit.window
    factor = lag_factor(fit, valve, limits)
    if valve and factor is None:
        spread = spread * SLOPE_ALONE
    out = {"slope_pct_per_s": _slope(fit, valve, SLOPE_ALONE if valve and factor is None else 1.0)}
    if factor is not None:
        wide = max(factor ** _lag_wider(fit, valve), 1.0 + LEAST_SHARE)
        out["gain"] = _around(fit.gain, half_width(spread[3], LEAST_SHARE * abs(fit.gain)), "%/%")
        out["time_constant_s"] = Estimate(t, t / wide, t * wide, "s")
    dead_s = fit.process.dead_time_s
    out["dead_time_s"] = _around(dead_s, half_width(spread[1], LEAST_BLOCK * window.dt_s), "s", least=0.0)
    if valve and window.decoded:
        spread[2] = DECODED * fit.valve.stickband
    if valve:
        name = "backlash_pct" if fit.valve.slip_jump == 0 else "stickband_pct"
        out[name] = _around(fit.valve.stickband, half_width(spread[2]), "% of OP", least=0.0)
        if fit.valve.slip_jump > 0:
            out |= _jumping(window, fit.valve, out)
    return out


def _lag_wider(fit: Fit, valve: bool) -> float:
    """Times wider that a time constant is told; behind play the deviations are those of its errors."""
    if not valve:
        return WIDER
    return WIDER * JUMPING if fit.valve.slip_jump > 0 else 1.0


def _jumping(window: Window, valve: StemLaw, found: dict[str, Estimate]) -> dict[str, Estimate]:
    """What is told of a valve that jumps, within what PV leaves open.

    Slip jump from half of the found one to the whole stickband, slope and gain by what their product with the jump
    leaves; a stem that lets go later is as good as a process that answers later by the time OP takes for that.
    """
    jump, band = valve.slip_jump, valve.stickband
    out = {"slip_jump_pct": Estimate(jump, jump / LEAST_JUMP, band, "% of OP")}
    for name in ("slope_pct_per_s", "gain"):
        if name in found:
            out[name] = reaching(found[name], found[name].value * jump / band, found[name].value * LEAST_JUMP)
    out["stickband_pct"] = reaching(found["stickband_pct"], band / LEAST_BAND)
    travel = float(np.abs(np.diff(window.op_blocks)).sum())
    later_s = 0.5 * band * (1.0 - 1.0 / LEAST_BAND) * window.duration_s / max(travel, 1e-9)
    dead = found["dead_time_s"]
    sooner_s = SOONER * (dead.value - dead.low)
    out["dead_time_s"] = reaching(dead, max(dead.value - sooner_s, 0.0), dead.value + LATER * later_s)
    return out


def _slope(fit: Fit, valve: bool, wider: float) -> Estimate:
    """Gain over time constant with its interval; the errors of the two are strongly correlated."""
    c = covariance(fit, free_width=valve)
    relative = c[3, 3] / fit.gain**2 + c[0, 0] - 2 * c[0, 3] / fit.gain
    deviation = wider * math.sqrt(max(relative, 0.0))
    return _around(fit.slope, abs(fit.slope) * half_width(deviation, LEAST_SHARE), "%/(% s)")


def _around(value: float, half: float, unit: str, least: float = -math.inf) -> Estimate:
    return Estimate(value, max(value - half, least), value + half, unit)
