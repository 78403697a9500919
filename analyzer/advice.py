"""What to do about a flagged loop: its identified model and settings, handed to the tuning package."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from analyzer.cause import Verdict
from analyzer.history.loops_csv import LoopSpec
from analyzer.measure import Measured
from analyzer.tags import as_stated
from identification.descent import covariance
from identification.hammerstein import Fit, Window, process_of
from identification.models import Backlash, Fopdt, Loop, Pid, Stiction, Valve
from tuning.limit_cycle import Cycle
from tuning.linear import is_stable
from tuning.recommend import Proposal, recommend
from tuning.search import rounded, scaled_valve

UNSTABLE = (
    "The identified loop would be unstable at the present settings, which the bounded cycle contradicts: the process "
    "is not known well enough for new settings."
)
CALM = "The loop does not oscillate, so new settings would bring nothing; the valve's fault remains."


@dataclass(frozen=True, slots=True)
class Advice:
    """A proposal in the loop's own units.

    action as in the ranking; reason in words, empty where the finding says it all; kp_new and ti_new in the
    units and form that loops.csv states, None unless action is retune; before and after, the limit cycles that
    simulation finds at the present and at the new settings, None where there is none.
    """

    action: str
    reason: str = ""
    kp_new: float | None = None
    ti_new: float | None = None
    before: Cycle | None = None
    after: Cycle | None = None


def chosen_fit(verdict: Verdict) -> Fit:
    """The fit that a verdict rests on."""
    m = _measured(verdict)
    if verdict.cause != "valve":
        return m.linear
    return m.stick_slip if verdict.fault == "stiction" and m.stick_slip is not None else m.play


def _measured(verdict: Verdict) -> Measured:
    if verdict.measured is None:
        raise ValueError("a verdict without a model has no fit")
    return verdict.measured


def valve_of(verdict: Verdict, fit: Fit) -> Valve:
    """The valve of a verdict's model, None where it is not at fault."""
    if verdict.cause != "valve":
        return None
    if verdict.fault == "stiction":
        return Stiction(fit.valve.stickband, fit.valve.slip_jump, slides=fit.valve.tolerance >= 0)
    return Backlash(fit.valve.stickband)


def model_of(verdict: Verdict, controller: Pid) -> Loop:
    """The closed loop that a verdict's model and the settings make."""
    fit = chosen_fit(verdict)
    process = process_of(_measured(verdict).window, fit)
    return Loop(process, controller, valve_of(verdict, fit))


def uncertain(window: Window, fit: Fit, loop: Loop, samples: int = 6, seed: int = 0) -> tuple[Loop, ...]:
    """Loops drawn from the fit's covariance, of the same controller."""
    rng = np.random.default_rng(seed)
    dead_time_s = fit.dead_time_s + window.half_block_s
    mean = np.array([math.log(fit.time_constant_s), dead_time_s, fit.valve.stickband, fit.gain])
    spread = covariance(window, fit, free_width=loop.valve is not None)
    draws = rng.multivariate_normal(mean, spread, size=samples, method="svd")
    out = []
    for log_t, dead, width, gain in draws:
        t = math.exp(min(max(log_t, mean[0] - 2.3), mean[0] + 2.3))
        gain = gain if gain * fit.gain > 0 else 0.3 * fit.gain
        process = Fopdt(float(gain), t, max(float(dead), 0.0))
        factor = max(float(width), 0.2 * fit.valve.stickband) / max(fit.valve.stickband, 1e-9)
        out.append(Loop(process, loop.controller, scaled_valve(loop.valve, factor)))
    return tuple(out)


def cautious(process: Fopdt, period_s: float | None) -> Fopdt:
    """A process with its time constant raised to two periods at the same slope.

    A cycle tells gain over time constant; a time constant much beyond the period cannot be told from it, and an
    integral time after one that is too short makes a loop swing that should be calmed.
    """
    t = max(process.time_constant_s, 2.0 * (period_s or 0.0))
    return Fopdt(process.slope * t, t, process.dead_time_s)


def advise(
    verdict: Verdict, spec: LoopSpec, controller: Pid | None, pv_span: float, period_s: float | None
) -> Advice:
    """The advice on one loop.

    Parameters
    ----------
    verdict : Verdict
    spec : LoopSpec
    controller : Pid or None
        The stated settings in percent and seconds.
    pv_span : float
        Span of PV in its own unit, for settings in engineering units.
    period_s : float or None
        Period of the oscillation [s], None where there is none.
    """
    if verdict.cause in ("none", "load"):
        return Advice("none")
    if verdict.cause == "undecided":
        return Advice("undecided")
    if verdict.measured is None or (verdict.fault == "undecided" and verdict.measured.play.gain == 0):
        return Advice("repair valve")
    if controller is None:
        return Advice("undecided", "no kp and ti in loops.csv, so no new settings")
    return _stated(propose(verdict, controller, period_s), spec, pv_span)


def propose(verdict: Verdict, controller: Pid, period_s: float | None) -> Proposal:
    """The tuning package's proposal on the model of a verdict and on its uncertainty."""
    fit, loop = chosen_fit(verdict), model_of(verdict, controller)
    others = uncertain(_measured(verdict).window, fit, loop)
    if verdict.cause == "tuning":
        slow = replace(loop, process=cautious(process_of(_measured(verdict).window, fit), period_s))
        return recommend(slow, verdict.cause, (loop, *others[:2]))
    if not is_stable(loop):
        return Proposal("undecided", UNSTABLE)
    if period_s is None:
        return Proposal("repair valve", CALM)
    return recommend(loop, verdict.cause, others)


def _stated(proposal: Proposal, spec: LoopSpec, pv_span: float) -> Advice:
    """A proposal in the units and form of the plant's controller."""
    cycles = [c.cycle if c is not None else None for c in (proposal.before, proposal.after)]
    if proposal.controller is None:
        return Advice(proposal.action, proposal.reason, before=cycles[0])
    kp, ti = as_stated(proposal.controller, spec, pv_span)
    return Advice(proposal.action, proposal.reason, rounded(kp), rounded(ti), *cycles)
