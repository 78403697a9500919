"""The constants of a fit within 90 %."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from analyzer.config import AdviceLimits
from identification.estimation.between_samples import scans_per_row
from identification.estimation.descent import (
    INTERVALS_WIDER,
    LEAST_BAND,
    LEAST_JUMP,
    NINETY,
    half_width,
    reaching,
)
from identification.estimation.gauss_newton import covariance
from identification.estimation.model import Fitted
from identification.estimation.problem import Problem
from identification.models import Estimate, Pid
from identification.record import Floats
from identification.simulation.valve import StemLaw


class BetweenRows(NamedTuple):
    """Relative standard deviations of what is identified behind a faulty valve that are due to OP between the rows of
    a record, beyond those of the fit: width, slope, gain and time constant [-]."""

    width: float
    slope: float
    gain: float
    lag: float


DRAWN, ALONE, JUMPS = (
    BetweenRows(0.05, 0.05, 0.065, 0.045),
    BetweenRows(0.08, 0.05, 0.065, 0.045),
    BetweenRows(0.1, 0.05, 0.065, 0.11),
)
"""The same where OP between the rows is simulated, where the rows alone are fitted, and behind a valve that jumps:
benchmarks/world, seeds 54 to 60, every 10 s. In 54 to 57 rms errors of 20 loops with backlash whose OP is simulated
are 4.9 % in the width, 6.5 % in the slope, 9 % in the gain and 5.6 % in the time constant; of six fitted to rows
alone 11 % in the width; of 17 whose valve jumps 14 % in stickband and 15 % in time constant. Intervals are
INTERVALS_WIDER wider."""
SLOPE_ALONE = 2.0
"""Further factor if a cycling record shows only gain over time constant: of 68 vessels that integrate and
cycle (proofs/coverage.py, seed 603) errors are 2.1 times those of processes that settle (604), in the same
deviations, at noise models of 8 to 110 lags and blocks of one to ten samples alike."""
JUMPING = 1.25
"""Further factor for the time constant behind a valve that jumps: of 114 such loops of dry friction (seeds 1,
11, 606) 82 % were held without it."""
SOONER = 2.5
"""Factor by which the lower end of the dead time behind a jumping valve is extended: of 71 such loops (seed
606) a fifth have a dead time shorter than the interval without it, none a longer one."""
LATER = 0.6
"""Part of the dead time that the smallest stickband would add, by which the upper end is extended: 94 in 100
of the same lie within half of the way up."""
LEAST_SHARE = 0.02
"""Least half width of slope, gain and time constant relative to their value, because data in blocks are no
exact model. In nine of ten of 60 loops with set point moves (seed 605) slopes err by at most 2.1 %, with
reported deviations of .4 %."""
LEAST_BLOCK = 0.025
"""Least half width of a dead time [blocks]: on the same loops they err by .01 to .06 blocks."""
DECODED = 0.05
"""Relative standard deviation of a stickband refined slip by slip. Source: as its slips scatter
(slip_beam.py)."""


def is_known(fit: Fitted, limits: AdviceLimits) -> bool:
    """Whether the time constant is well inside the stretch, so that it differs from an integrator's."""
    return fit.time_constant_s < limits.longest_share * fit.p.duration_s


def lag_factor(fit: Fitted, valve: bool, limits: AdviceLimits) -> float | None:
    """Factor from the time constant to its 90 % limits [-]; None if the record gives only gain over time constant."""
    spread = math.sqrt(max(float(covariance(fit, free_width=valve)[0, 0]), 0.0))
    factor = math.exp(min(NINETY * spread, 20.0))
    return factor if is_known(fit, limits) and factor < limits.most_factor else None


def intervals(fit: Fitted, valve: bool, limits: AdviceLimits, law: Pid | None = None) -> dict[str, Estimate]:
    """Estimates of a fit with 90 % intervals from the curvature of the likelihood and the scatter of its scores.

    law, the controller, whose moves between the rows of a record are unknown; None: its scan is not faster than they
    are. Gain and time constant are left out if the record gives only their ratio (lag_factor). For a valve that jumps
    PV gives jump times slope; only slips beyond the first of a half cycle separate the two, so both have wide
    intervals. proofs/coverage.md gives the coverage of the intervals, proofs/sampling.md that in slow rows.
    """
    whole = covariance(fit, free_width=valve)
    t, problem, unseen = fit.time_constant_s, fit.p, _between_rows(fit, valve, law)
    factor = lag_factor(fit, valve, limits)
    wider = SLOPE_ALONE if valve and factor is None else 1.0
    spread = wider * np.sqrt(np.maximum(np.diag(whole), 0.0))
    deviation = math.hypot(wider * slope_deviation(fit, whole), unseen.slope)
    out = {
        "slope_pct_per_s": _around(fit.slope, abs(fit.slope) * half_width(deviation, LEAST_SHARE), "%/(% s)")
    }
    if factor is not None:
        wide = max(math.log(factor) * _lag_wider(fit, valve), math.log(1.0 + LEAST_SHARE))
        wide = math.exp(math.hypot(wide, half_width(unseen.lag)))
        gain = math.hypot(spread[3], unseen.gain * fit.gain)
        out["gain"] = _around(fit.gain, half_width(gain, LEAST_SHARE * abs(fit.gain)), "%/%")
        out["time_constant_s"] = Estimate(t, t / wide, t * wide, "s")
    unseen_pct = unseen.width * fit.valve.stickband
    late = math.hypot(spread[1], _time_of(unseen_pct, problem))
    late = half_width(late, LEAST_BLOCK * problem.dt_s)
    out["dead_time_s"] = _around(fit.process.dead_time_s, late, "s", least=0.0)
    if valve:
        known = DECODED * fit.valve.stickband if problem.blocks.decoded else spread[2]
        name = "backlash_pct" if fit.valve.slip_jump == 0 else "stickband_pct"
        half = half_width(math.hypot(known, unseen_pct))
        out[name] = _around(fit.valve.stickband, half, "% of OP", least=0.0)
        if fit.valve.slip_jump > 0:
            out |= _jumping(problem, fit.valve, out)
    return out


def _between_rows(fit: Fitted, valve: bool, law: Pid | None) -> BetweenRows:
    """What OP between the rows of a record adds to the deviations of a fit behind a faulty valve."""
    if not valve or (fit.p.blocks.steps == 1 and scans_per_row(law, fit.p.row_s) == 1):
        return BetweenRows(0.0, 0.0, 0.0, 0.0)
    if fit.valve.slip_jump > 0:
        return JUMPS
    return DRAWN if fit.p.blocks.steps > 1 else ALONE


def _time_of(width: float, problem: Problem) -> float:
    """Time in which OP travels a width [% of OP]: a wider backlash responds later by it [s]."""
    travel = float(np.abs(np.diff(problem.inputs.op)).sum())
    return width * problem.duration_s / max(travel, 1e-9)


def _lag_wider(fit: Fitted, valve: bool) -> float:
    """Factor on the interval of a time constant; with backlash the deviations are those of its errors."""
    if not valve:
        return INTERVALS_WIDER
    return INTERVALS_WIDER * JUMPING if fit.valve.slip_jump > 0 else 1.0


def _jumping(problem: Problem, valve: StemLaw, found: dict[str, Estimate]) -> dict[str, Estimate]:
    """Intervals of a valve that jumps, from the uncertainty that PV leaves.

    Slip jump from half of the found one to the whole stickband, slope and gain from their product with the jump; a
    stem that slips later is equivalent to a process that responds later by the time OP takes for that.
    """
    jump, band = valve.slip_jump, valve.stickband
    most = max(found["stickband_pct"].high, band)
    out = {"slip_jump_pct": Estimate(jump, jump / LEAST_JUMP, most, "% of OP")}
    for name in ("slope_pct_per_s", "gain"):
        if name in found:
            value = found[name].value
            out[name] = reaching(found[name], value * jump / band, value * LEAST_JUMP)
    out["stickband_pct"] = reaching(found["stickband_pct"], band / LEAST_BAND)
    later_s = _time_of(0.5 * band * (1.0 - 1.0 / LEAST_BAND), problem)
    dead = found["dead_time_s"]
    sooner_s = SOONER * (dead.value - dead.low)
    low, high = max(dead.value - sooner_s, 0.0), dead.value + LATER * later_s
    out["dead_time_s"] = reaching(dead, low, high)
    return out


def slope_deviation(fit: Fitted, spread: Floats) -> float:
    """Relative deviation of gain over time constant [-], whose errors are correlated; spread, covariance of (log T,
    L, stickband, gain), shape (4, 4)."""
    relative = spread[3, 3] / fit.gain**2 + spread[0, 0] - 2.0 * spread[0, 3] / fit.gain
    return math.sqrt(max(relative, 0.0))


def _around(value: float, half: float, unit: str, least: float = -math.inf) -> Estimate:
    return Estimate(value, max(value - half, least), value + half, unit)
