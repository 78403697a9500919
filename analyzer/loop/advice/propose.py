"""New settings for the identified model of a verdict, its uncertainty and its load."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import AdviceLimits, Config
from analyzer.loop.cause.fitness import too_thin
from analyzer.loop.cause.verdict import Verdict
from analyzer.loop.decisions import Action, Cause
from analyzer.loop.identification.agreement import agreement
from analyzer.loop.identification.identified import (
    cautious,
    error_of_night,
    indistinguishable,
    load_of,
    load_of_night,
    recorded_error,
    tuned,
    uncertain,
)
from analyzer.loop.identification.ringing import between_samples
from analyzer.words import sentences
from analyzer.words.units import number
from identification.estimation.model import Fitted
from identification.estimation.problem import LONGEST_DEAD_TIME
from identification.models import Loop, Pid
from identification.record import Floats, LoopRecord
from tuning.frequency_response import integral_s, is_stable
from tuning.limit_cycle import confirm
from tuning.recommend import Proposal, recommend
from tuning.search import LoadedLoop

TEXTS = sentences("settings")
"""Sentences about settings that are given, or withheld."""


@dataclass(frozen=True, slots=True)
class Proposed:
    """A proposal, its loop and load [% PV], None if no search was made, the other possible loops, and the
    indistinguishable loops of tuning.search.bench."""

    proposal: Proposal
    loop: Loop | None = None
    load: Floats | None = None
    others: tuple[Loop, ...] = ()
    indistinguishable: tuple[LoadedLoop, ...] = ()


def model_of(verdict: Verdict, controller: Pid) -> Loop:
    """The closed loop of a verdict's model and the settings."""
    fit = verdict.fit
    if verdict.cause is Cause.VALVE:
        return Loop(fit.process, controller, fit.valve.valve)
    return Loop(between_samples(fit.process, fit.p, controller), controller)


def tuning_model(
    verdict: Verdict, controller: Pid, limits: AdviceLimits
) -> tuple[Loop, Fitted, tuple[Loop, ...]]:
    """The loop for the search of settings, its fit, and other possible loops: with the identified fault, also if a
    load sustains its cycle."""
    verdict = verdict.for_settings
    fit = verdict.fit
    loop = model_of(verdict, controller)
    if verdict.cause is Cause.VALVE and controller.kp:  # an integral alone is not stable before an integrator
        loop = replace(loop, process=tuned(fit, True, limits))
    return loop, fit, uncertain(fit, loop)


def propose(
    verdict: Verdict,
    controller: Pid,
    period_s: float | None,
    config: Config,
    record: LoopRecord | None = None,
) -> Proposed:
    """The tuning package's proposal on the model of a verdict, on its uncertainty, and on its residual load, in a
    whole record if that is given; if that is not the model which the verdict reports, its reason states this."""
    chosen = verdict.for_settings
    found = _proposed(chosen, controller, period_s, config, record)
    if chosen is verdict or not found.proposal.reason:
        return found
    reason = f"{TEXTS['one_friction']} {found.proposal.reason}"
    return replace(found, proposal=replace(found.proposal, reason=reason))


def _proposed(
    verdict: Verdict, controller: Pid, period_s: float | None, config: Config, record: LoopRecord | None
) -> Proposed:
    """The proposal on the model of a verdict used for settings."""
    loop = model_of(verdict, controller)
    right_way = loop.controller.sign * loop.process.slope > 0.0
    if not right_way or verdict.cause not in (Cause.VALVE, Cause.TUNING):
        return Proposed(recommend(loop, verdict.cause, limits=config.tuning))
    duration_s, dead_time_s = verdict.fit.p.duration_s, loop.process.dead_time_s
    if dead_time_s > LONGEST_DEAD_TIME * duration_s:
        shown = TEXTS["beyond_record"].format(number(dead_time_s), duration_s / 3600.0)
        return Proposed(Proposal(Action.UNDECIDED, shown))
    if verdict.cause is Cause.TUNING:
        return _for_tuning(verdict, loop, period_s, config, record)
    if not is_stable(loop):
        return Proposed(Proposal(Action.UNDECIDED, TEXTS["unstable"]))
    return _for_valve(verdict, loop, period_s, config, record)


def _for_tuning(
    verdict: Verdict, loop: Loop, period_s: float | None, config: Config, record: LoopRecord | None
) -> Proposed:
    fit = verdict.fit
    slow = loop
    if loop.controller.kp:
        lagging = cautious(fit.process, period_s)
        slow = replace(loop, process=replace(lagging, dead_time_s=loop.process.dead_time_s))
    others = (loop, *uncertain(fit, loop)[:2])
    load = tested = load_of(fit, loop.controller)
    error = recorded_error(fit, loop.controller)
    night = load if record is None else load_of_night(fit, loop.controller, record, period_s or 0.0)
    unmoved = None
    if record is not None and night.size > load.size:
        tested, error = night, error_of_night(record, loop.controller)
        if float(np.ptp(record.sp)) > 0.0 and not record.sp_estimated:
            unmoved = load_of_night(fit, loop.controller, record, period_s or 0.0, moved=False)
    thin = too_thin(fit.p.row_s, loop.controller, config) is not None
    seen = verdict.require_measured.observed
    found = recommend(slow, verdict.cause, others, tested, config.tuning, error, thin, seen, unmoved=unmoved)
    return Proposed(found, loop, load, others) if found.ms is not None else Proposed(found)


def _for_valve(
    verdict: Verdict, loop: Loop, period_s: float | None, config: Config, record: LoopRecord | None
) -> Proposed:
    """The proposal for a worn valve. The motion of a stem that jumps depends on the exact load, and a stretch has few
    of its cycles: its settings are tested under the load of the whole record."""
    evidence_nat, least_nat = verdict.require_measured.evidence, config.advice.valve_nat
    if evidence_nat < least_nat:
        return Proposed(Proposal(Action.UNDECIDED, TEXTS["hardly_told"].format(evidence_nat, least_nat)))
    model, fit, others = tuning_model(verdict, loop.controller, config.advice)
    at_rest = confirm(model).cycle is None
    if at_rest and period_s is None:
        return Proposed(Proposal(Action.REPAIR_VALVE, TEXTS["calm"]))
    load = load_of(fit, loop.controller)
    if period_s is not None and load.size >= config.tuning.least_steps:
        difference = agreement(model, fit, load).worst(config.advice)
        if difference is not None and at_rest and math.isinf(integral_s(loop.controller)):
            return Proposed(Proposal(Action.CHECK_SETTINGS, TEXTS["no_integral"]))
        if difference is not None:
            differs = TEXTS["off_by"].format(*difference) if difference[1] > 0.0 else TEXTS["no_cycle"]
            return Proposed(Proposal(Action.UNDECIDED, TEXTS["disagrees"].format(differs)))
    none = period_s is None or loop.controller.kp == 0.0  # an integral alone rings before these
    same = () if none else indistinguishable(fit, model, period_s or 0.0)
    tested, alike = load, same
    if record is not None and not none and fit.valve.slip_jump > 0.0:
        tested = load_of_night(fit, loop.controller, record, period_s or 0.0)
        alike = indistinguishable(fit, model, period_s or 0.0, record)
    found = recommend(model, verdict.cause, others, tested, config.tuning, indistinguishable=alike)
    return Proposed(found, model, load, others, same)
