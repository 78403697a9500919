"""What to do about a flagged loop: its identified model and settings, handed to the tuning package."""

from __future__ import annotations

from dataclasses import dataclass

from analyzer.cause import Measured, Verdict
from analyzer.history.loops_csv import LoopSpec
from analyzer.tags import as_stated
from identification.hammerstein import Fit
from identification.models import Backlash, Fopdt, Loop, Pid, Stiction, Valve
from tuning.recommend import Proposal, recommend


@dataclass(frozen=True, slots=True)
class Advice:
    """A proposal in the loop's own units.

    action as in the ranking; reason in words, empty where the finding says it all; kp_new and ti_new in the
    units and form that loops.csv states, None unless action is retune.
    """

    action: str
    reason: str = ""
    kp_new: float | None = None
    ti_new: float | None = None


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
    process = Fopdt(fit.gain, fit.time_constant_s, fit.dead_time_s)
    return Loop(process, controller, valve_of(verdict, fit))


def advise(verdict: Verdict, spec: LoopSpec, controller: Pid | None, pv_span: float) -> Advice:
    """The advice on one loop.

    Parameters
    ----------
    verdict : Verdict
    spec : LoopSpec
    controller : Pid or None
        The stated settings in percent and seconds.
    pv_span : float
        Span of PV in its own unit, for settings in engineering units.
    """
    if verdict.cause in ("none", "load"):
        return Advice("none")
    if verdict.cause == "undecided":
        return Advice("undecided")
    if verdict.measured is None or verdict.fault == "undecided" and verdict.measured.play.gain == 0:
        return Advice("repair valve")
    if controller is None:
        return Advice("undecided", "no kp and ti in loops.csv, so no new settings")
    return _stated(recommend(model_of(verdict, controller), verdict.cause), spec, pv_span)


def _stated(proposal: Proposal, spec: LoopSpec, pv_span: float) -> Advice:
    """A proposal in the units and form of the plant's controller."""
    if proposal.controller is None:
        return Advice(proposal.action, proposal.reason)
    kp, ti = as_stated(proposal.controller, spec, pv_span)
    return Advice(proposal.action, proposal.reason, kp, ti)
