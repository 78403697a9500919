"""Cause of a loop's oscillation: valve, tuning or load, each a model of the same record with its likelihood.

1. Valve: backlash (or stick-slip) on the recorded OP followed by a lag explains PV better than the lag alone.
2. Tuning: the identified process with the control law rings at the observed period, and the cycle is no more regular
   than noise through such a resonance, which keeps neither its size nor its phase (Rice 1945).
3. Load: the load has a line that keeps its phase, and the cycle keeps its size.

The models are compared under one load, a smooth one (ringing.py). A valve also needs evidence under a free noise
model, and a width that is a large share of OP's travel, or evidence in the whole record (worn_valve.py), which also
shows a worn valve in loops that cycle for another cause. Where no model leads by the penalty of its constants the
cause is undecided. A loop that does not oscillate can only have a valve fault. For a valve fault each slip is tested:
does the valve stick at distances that scatter, instead of backlash?
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import CauseLimits
from analyzer.loop.cause.signs import WEAK, signs_of
from analyzer.loop.cause.worn_valve import WornValve
from analyzer.loop.decisions import (
    CAUSES,
    Cause,
    Fault,
    MissingData,
    Requirement,
    RequirementKind,
    Sign,
    SignKind,
)
from analyzer.loop.identification.measure import Measured
from analyzer.loop.identification.ringing import Regularity, Ringing, between_samples
from analyzer.loop.oscillation.detection import Oscillation
from analyzer.loop.record.quality import Prepared
from identification.errors import NotAssessedError
from identification.estimation.between_samples import scans_per_row
from identification.estimation.model import Fitted
from identification.estimation.smooth_load import as_fit
from identification.models import Backlash, Loop
from tuning.describing import describe
from tuning.frequency_response import loop_response

NO_MODEL = Requirement(None, RequirementKind.MODEL)
CAUSE_IN_MANUAL = Requirement(MissingData.MANUAL_TEST, RequirementKind.CAUSE_IN_MANUAL)
OTHERS = 2
"""Number of further periods of the error at which a periodic load is searched for; ours."""
SIGN_TEST = 1.645
"""Excess of agreeing half-cycles, in standard errors, of one in twenty valves without a fault (normal quantile)."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The cause of one loop's oscillation.

    cause; confidence [%] of each cause; fault of the valve; signs; needs : the missing data for a cause, None if
    there are none; measured; dead : the valve no longer moves PV at all; steady : the same by one friction for all
    slips, if the friction was then identified slip by slip.
    """

    cause: Cause
    confidence: dict[Cause, float]
    fault: Fault
    signs: tuple[Sign, ...] = ()
    needs: Requirement | None = None
    measured: Measured | None = None
    dead: bool = False
    steady: Verdict | None = None

    @property
    def require_measured(self) -> Measured:
        """The measures; NotAssessedError, with the missing data, if there are none."""
        if self.measured is None:
            raise NotAssessedError(str(self.needs or NO_MODEL))
        return self.measured

    @property
    def fit(self) -> Fitted:
        """The fit of the verdict, the valve's if that is at fault; NotAssessedError if there is none."""
        m = self.require_measured
        if self.cause is not Cause.VALVE:
            return m.linear
        return m.stick_slip if self.fault is Fault.STICTION and m.stick_slip is not None else m.backlash

    @property
    def identified_between_rows(self) -> bool:
        """Whether the loop is identified at any sampling: its ringing causes the cycle, or the valve does, fitted
        with OP between the rows from control law and scan."""
        if self.cause is Cause.VALVE and self.measured is not None:
            return scans_per_row(self.measured.controller, self.fit.p.row_s) > 1
        return self.cause is Cause.TUNING and any(s.kind is SignKind.RINGING for s in self.signs)

    @property
    def for_settings(self) -> Verdict:
        """The verdict whose model settings are searched on: that of one friction for all slips."""
        return self if self.steady is None or self.cause is not Cause.VALVE else self.steady


NO_CAUSE = Verdict(Cause.NONE, dict.fromkeys(CAUSES, 0.0), Fault.NONE)


def not_assessed(needs: Requirement | None) -> Verdict:
    """The verdict without a cause, with its requirement."""
    return Verdict(Cause.UNDECIDED, dict.fromkeys(CAUSES, 0.0), Fault.UNDECIDED, needs=needs)


def _ramp(x: float, low: float, high: float) -> float:
    """0 below low, 1 above high, linear between."""
    return min(max((x - low) / (high - low), 0.0), 1.0)


def needed(m: Measured, limits: CauseLimits, oscillating: bool) -> float:
    """Evidence required of these measures [nat]."""
    return limits.needed(m.backlash.count, m.excited, oscillating)


def _crossed(m: Measured, limits: CauseLimits, oscillating: bool) -> bool:
    """Whether OP moves far enough to move a stem with a fault of the width found: over its whole range with tails in
    a cycle; over its usual range in a calm loop, whose tails are kicks of its set point. OP of a valve that rarely
    slips stays within its stickband, so the whole range counts there too."""
    whole = oscillating or fault_of(m, limits) is Fault.STICTION
    return m.backlash.valve.stickband <= limits.widest * float(np.ptp(m.problem.blocks.op)) and (
        whole or m.size <= 1.0
    )


def shows_fault(m: Measured, limits: CauseLimits, oscillating: bool) -> bool:
    """Whether PV shows a valve fault: enough evidence, a process gain of the controller's sign, and a width that OP
    has crossed."""
    wrong_way = m.controller is not None and m.controller.sign * m.backlash.gain < 0
    return m.evidence >= needed(m, limits, oscillating) and not wrong_way and _crossed(m, limits, oscillating)


def agrees(m: Measured, limits: CauseLimits) -> bool:
    """Whether no single load explains the evidence of a calm loop: its stretches agree, or set point moves, which no
    load follows, suffice."""
    return m.steady >= limits.steady or m.response_nat >= needed(m, limits, False)


def quiet_signs(m: Measured, limits: CauseLimits) -> tuple[Sign, ...]:
    """Signs of a valve fault in a loop that does not oscillate.

    The stretches between moves of the stem must agree; for a fault that is narrow relative to OP's range, as in a
    loop of a programme, they are a separate sign. Few moves, unless the set point caused them, need more evidence to
    be distinguished from steps of the load.
    """
    if not agrees(m, limits):
        return ()
    few = m.moves < limits.few_moves and not m.excited
    least = needed(m, limits, False) * (limits.quiet_factor if few else 1.0)
    if not shows_fault(m, limits, False) or m.evidence < least or (m.moves < limits.moves and not m.excited):
        return ()
    sure = 0.5 + 0.5 * _ramp(m.evidence, least, 4 * least)
    signs = [Sign(Cause.VALVE, sure, SignKind.CALM_EVIDENCE, (m.evidence,))]
    width = m.backlash.valve.stickband
    if m.size < limits.size and m.steady >= limits.steady_alone and width >= limits.plain_width:
        signs.append(
            Sign(Cause.VALVE, 0.6 + 0.4 * _ramp(m.steady, limits.steady_alone, 10.0), SignKind.AGAIN)
        )
    if m.size >= limits.size:
        wide = 0.6 + 0.4 * _ramp(m.size, limits.size, 0.7)
        signs.append(Sign(Cause.VALVE, wide, SignKind.CALM_WIDTH, (m.size,)))
    return tuple(signs)


def combined(signs: Iterable[Sign]) -> float:
    """Confidence [%]: the signs taken as independent, none of them certain by itself (0.9 at most)."""
    return 100.0 * (1.0 - math.prod(1.0 - 0.9 * sign.strength for sign in signs))


def fault_of(m: Measured, limits: CauseLimits) -> Fault:
    """Backlash or stiction, by the evidence of a slip jump beyond backlash."""
    found, clear = jump_evidence(m, limits)
    if found > clear:
        return Fault.STICTION
    return Fault.BACKLASH if m.stick_slip is None or found < 0.5 * clear else Fault.UNDECIDED


def jump_evidence(m: Measured, limits: CauseLimits) -> tuple[float, float]:
    """Evidence for a slip jump and its required value [nat], zero if none was searched for."""
    if m.stick_slip is None:
        return 0.0, 0.0
    clear = max(limits.evidence_jump, limits.jump_share * m.evidence)
    share = m.stick_slip.valve.slip_jump / max(m.stick_slip.valve.stickband, 1e-9)
    return min(m.jump, 10.0 * clear) if share >= limits.least_jump else 0.0, clear


def judge(
    m: Measured, oscillation: Oscillation | None, limits: CauseLimits, worn_valve: WornValve | None = None
) -> Verdict:
    """The cause of the cycle: that whose model is more likely than the others, and than a smooth load, by the penalty
    of its constants. If a measure is unknown no cause is named. worn_valve : the valve in the whole record,
    None if it was not examined."""
    if oscillation is None:
        return _quiet(m, limits, worn_valve)
    if m.ringing is None or any(math.isnan(x) for x in (m.evidence, m.jump, m.size, m.kurtosis)):
        return replace(not_assessed(None), measured=m)
    if m.has_clock(limits) and m.evidence < limits.joint_evidence:
        return _has_clock(m, oscillation, limits)
    seen_as = Regularity(
        oscillation.rhythm.first, m.kurtosis, m.saturated >= limits.at_limit, oscillation.cycles
    )
    worn = _may_be_cause(m, m.ringing, limits, worn_valve)
    if m.ringing.is_tight(seen_as, m.evidence if worn else 0.0, limits):
        return _rings(m, m.ringing, limits)
    wide = m.size >= limits.least_size  # a narrower fault raises no doubt about a load
    gains, none = m.ringing.gains(m.evidence if wide else 0.0, worn, seen_as, limits)
    first, second = sorted(gains, key=lambda c: gains[c], reverse=True)[:2]
    lead = gains[first] - max(gains[second], none)
    confidence, signs = _chances(gains, limits), signs_of(m, oscillation, limits)
    if lead < m.ringing.penalty:
        undecided = Verdict(Cause.UNDECIDED, confidence, Fault.NONE, signs, measured=m)
        return cap_confidence(undecided, 0.9 * limits.named_pct)
    why = Sign(first, confidence[first] / 100.0, SignKind.LIKELIER, (str(first), lead))
    fault = fault_of(m, limits) if first is Cause.VALVE else Fault.NONE
    return Verdict(first, confidence, fault, (why, *signs), measured=m)


def _has_clock(m: Measured, oscillation: Oscillation, limits: CauseLimits) -> Verdict:
    """The verdict on a cycle with a clock outside the loop."""
    pct, rest = limits.most_pct, 0.5 * (100.0 - limits.most_pct)
    confidence = {Cause.VALVE: rest, Cause.TUNING: rest, Cause.LOAD: pct}
    why = Sign(Cause.LOAD, pct / 100.0, SignKind.KEPT_PHASE, tuple(m.kept))
    return Verdict(Cause.LOAD, confidence, Fault.NONE, (why, *signs_of(m, oscillation, limits)), measured=m)


def _chances(gains: dict[Cause, float], limits: CauseLimits) -> dict[Cause, float]:
    """Confidence of each cause [%] by the gains of the models [nat]: their odds are tempered, since models of loops
    are never exact."""
    odds = {c: math.exp((x - max(gains.values())) / limits.temper) for c, x in gains.items()}
    least = 0.5 * (100.0 - limits.most_pct)
    span = (limits.most_pct - least) / sum(odds.values())
    return {c: least + span * x for c, x in odds.items()}


def _rings(m: Measured, ringing: Ringing, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that rings by itself; its process is the one under a smooth load, because a free noise
    model assigns the ringing to the load."""
    clear = min(max(1.0 - ringing.line_nat / ringing.line_needed(limits), 0.0), 1.0)
    pct = limits.named_pct + (limits.most_pct - limits.named_pct) * clear
    rest = 0.5 * (100.0 - pct)
    confidence = {Cause.VALVE: rest, Cause.TUNING: pct, Cause.LOAD: rest}
    signs = (
        Sign(Cause.TUNING, pct / 100.0, SignKind.RINGING, (ringing.ms, ringing.period_s)),
        Sign(Cause.TUNING, max(clear, WEAK), SignKind.SMOOTH_LOAD, (ringing.line_nat,)),
    )
    measured = replace(m, linear=as_fit(ringing.smooth, m.problem))
    return Verdict(Cause.TUNING, confidence, Fault.NONE, signs, measured=measured)


def _may_be_cause(m: Measured, ringing: Ringing, limits: CauseLimits, worn_valve: WornValve | None) -> bool:
    """Whether a valve fault may be the cause of a cycle: PV shows it, it is not too small for OP's travel, and the
    loop's harmonic balance is not far from a limit cycle. A valve loses the same travel at each reversal, so more
    than half of the half-cycles must show it: a few may follow set point moves. Unless nearly all of them do, two
    faults must be shown by the whole record: backlash under a periodic load, whose harmonics it explains too, and one
    that is narrow for OP's travel, which must also explain far more than a line."""
    if m.evidence < ringing.penalty or not shows_fault(m, limits, True) or imbalance(m) > limits.imbalance:
        return False
    if m.trials is not None and m.trials.signs < SIGN_TEST:
        return False
    each = m.trials is not None and m.trials.agreeing >= limits.agreeing
    narrow = m.size < limits.least_size and not each
    doubted = ringing.is_periodic(limits) and not each and fault_of(m, limits) is not Fault.STICTION
    if worn_valve is None or not (narrow or doubted):
        return not narrow
    if ringing.valve_nat - max(ringing.line_nat, 0.0) >= limits.joint_evidence:
        return worn_valve.has_evidence  # OP of a tight loop travels several times its backlash
    return not narrow and worn_valve.is_seen


def imbalance(m: Measured) -> float:
    """Distance of the harmonic balance G C N of a loop with backlash from -1 at its cycle [-]: 0 of a limit cycle;
    where the loop attenuates a load at the period, the factor by which it does; 0 without settings."""
    if m.controller is None:
        return 0.0
    loop = Loop(between_samples(m.backlash.process, m.problem, m.controller), m.controller)
    response = complex(loop_response(loop, np.array([2.0 * math.pi / m.scale_s]))[0])
    return abs(1.0 + response * describe(Backlash(m.backlash.valve.stickband), 0.5 * m.problem.cycle_range))


def _quiet(m: Measured, limits: CauseLimits, worn_valve: WornValve | None) -> Verdict:
    """The verdict on a loop that does not oscillate: a valve fault, if likelihood and size agree, or none."""
    signs = quiet_signs(m, limits)
    pct = combined(signs)
    is_valve = len(signs) >= limits.signs and pct >= limits.named_pct
    is_valve = is_valve and (
        worn_valve is None or (worn_valve.is_likelier and not worn_valve.is_recorded_by_exception)
    )
    if not is_valve:
        pct = min(pct, 0.5 * limits.named_pct)
    confidence = {Cause.VALVE: pct, Cause.TUNING: 0.0, Cause.LOAD: 0.0}
    fault = fault_of(m, limits) if is_valve else Fault.NONE
    return Verdict(Cause.VALVE if is_valve else Cause.NONE, confidence, fault, signs, measured=m)


def hidden_by_grid(m: Measured, pv_step: float, oscillates: bool, limits: CauseLimits) -> bool:
    """Whether the valve's stickband moves PV by so few steps of its grid, pv_step [% of span], or PV of a calm loop
    covers so few, that the grid itself keeps PV constant as the valve would."""
    if m.problem.blocks.position is not None and not m.problem.blocks.decoded:
        return False
    best = m.stick_slip if m.stick_slip is not None and m.jump > limits.evidence_jump else m.backlash
    covered = float(np.ptp(m.problem.y[m.problem.usable]))
    rough = not oscillates and covered < limits.grid_covered * pv_step
    return rough or abs(best.gain) * best.valve.stickband < limits.grid_steps * pv_step


def cap_confidence(verdict: Verdict, most_pct: float) -> Verdict:
    """A verdict on few data: no confidence above `most_pct` [%]."""
    return replace(verdict, confidence={k: min(v, most_pct) for k, v in verdict.confidence.items()})


def resolve_ambiguity(
    verdict: Verdict, prepared: Prepared, oscillation: Oscillation | None, limits: CauseLimits
) -> Verdict:
    """The verdict on an oscillation, with the missing data if it is undecided: no load if the recording does not show
    the waveform of a valve's cycle, except one that keeps its phase."""
    if oscillation is None or verdict.measured is None:
        return verdict
    coarse = _too_coarse(prepared, oscillation, limits)
    if verdict.cause is Cause.UNDECIDED:
        return replace(verdict, needs=coarse or CAUSE_IN_MANUAL)
    keeps_phase = any(sign.kind is SignKind.KEPT_PHASE for sign in verdict.signs)
    if coarse is None or verdict.cause is not Cause.LOAD or keeps_phase:
        return verdict
    return replace(cap_confidence(verdict, 0.9 * limits.named_pct), cause=Cause.UNDECIDED, needs=coarse)


def _too_coarse(prepared: Prepared, oscillation: Oscillation, limits: CauseLimits) -> Requirement | None:
    """Requirement of a recording in which every regular cycle looks like a periodic load, because its samples or the
    steps of PV's grid do not show the third harmonic of a valve's; None if it is sufficient."""
    steps = oscillation.amplitude_pct / max(prepared.pv_step, 1e-12)
    if steps < limits.least_steps:
        figures = prepared.pv_step, oscillation.amplitude_pct
        return Requirement(MissingData.FINER, RequirementKind.FINER, figures)
    samples = oscillation.period_s / prepared.record.dt_s
    if samples < limits.least_samples:
        return Requirement(MissingData.FASTER, RequirementKind.OF_A_CAUSE, (limits.least_samples, samples))
    return None


def with_worn_valve(verdict: Verdict, worn: WornValve, others_s: Sequence[float] = ()) -> Verdict:
    """The verdict on a loop that cycles for another cause. Its valve is reported as worn if that is
    identified in addition to the load, because the valve needs repair regardless of the cause.
    others_s : further periods of the error [s]."""
    m = verdict.measured
    if verdict.cause is Cause.UNDECIDED and m is not None and not worn.is_seen:
        return _fault_under_other_load(verdict, m, worn, others_s)
    # ringing is no line: the free noise model must show the backlash too
    rings_alone = verdict.cause is Cause.TUNING and m is not None and m.evidence <= 0.0
    if m is None or verdict.cause is Cause.VALVE or rings_alone or not worn.is_seen:
        return verdict
    fault, measured = worn.shown
    return replace(verdict, fault=fault, measured=measured)


def _fault_under_other_load(
    verdict: Verdict, m: Measured, worn: WornValve, others_s: Sequence[float]
) -> Verdict:
    """The verdict on an undecided cycle. Its cause is the valve if a fault is identified together with a
    load of another period, which cannot explain this cycle."""
    for other in (replace(worn, period_s=period_s) for period_s in others_s[:OTHERS]):
        if not other.is_seen:
            continue
        fault, measured = other.shown
        lead = other.found.evidence
        confidence = _chances({Cause.VALVE: lead, Cause.TUNING: 0.0, Cause.LOAD: 0.0}, worn.limits)
        why = Sign(Cause.VALVE, 1.0, SignKind.LIKELIER, (str(Cause.VALVE), lead))
        return Verdict(Cause.VALVE, confidence, fault, (why, *verdict.signs), measured=measured)
    return verdict
