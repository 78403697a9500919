"""Cause of a loop's oscillation: valve, tuning or load, from independent signs.

1. Likelihood and size of a valve fault: backlash (or stick-slip) on the recorded OP followed by a lag explains PV
   better than the lag alone, by innovations, in most stretches between two OP reversals, and its width is a large
   share of OP's travel. Two questions.
2. Residual load: PV minus the model's response. If the valve model removes the peak from the load, the valve
   caused it; if the peak remains, the disturbance is external.
3. Amplification: the identified process and the controller's settings give |S| at the period. A tuning causes
   its own period only if the loop amplifies there.
4. The same process on both sides: the process gain from the data outside the period's band, against the gain
   identified with it. Under a strong load feedback alone is identified, and the gain falls or changes sign.
5. Rhythm: a load from a machine has a constant frequency; noise through a resonance does not.
6. Waveform: third harmonic locked to the phase of the fundamental (a triangle has 1/9, a square 1/3), after the
   idea of harmonics and bicoherence (Choudhury, Shah, Thornhill 2004); a sine is evidence against the valve, and so
   are harmonics that the valve's model does not explain.
7. Size: noise through a resonance keeps neither its size nor its phase (Rice 1945), so a cycle with variable phase
   and constant size is not caused by tuning.

In a loop that oscillates the signs are combined (cause_weights.py); a loop that does not can only have a valve fault,
by the first two questions. For a valve fault each slip is tested: does the valve stick at distances that scatter,
instead of backlash?
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import CauseLimits, Config
from analyzer.loop.cause_weights import chances, measures, signs_of
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
from analyzer.loop.fitness import compressed
from analyzer.loop.identified import sensitivity
from analyzer.loop.measure import Measured
from analyzer.loop.oscillation import Oscillation
from analyzer.loop.quality import Prepared
from analyzer.loop.ringing import Regularity, Ringing
from identification.errors import NotAssessedError
from identification.estimation.backlash_stiction import refined
from identification.estimation.beside_line import BesideLine, beside_line
from identification.estimation.between_samples import scans_per_row
from identification.estimation.gauss_newton import descend
from identification.estimation.irregular_slips import SlipPath, fit_irregular, near_path, path_evidence
from identification.estimation.noise import generic_noise
from identification.estimation.smooth_load import as_fit
from identification.estimation.window import Fit
from identification.limits import FIT
from identification.record import LoopRecord

NO_MODEL = Requirement(None, RequirementKind.MODEL)


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
    def fit(self) -> Fit:
        """The fit of the verdict, the valve's if that is at fault; NotAssessedError if there is none."""
        m = self.require_measured
        if self.cause is not Cause.VALVE:
            return m.linear
        return m.stick_slip if self.fault is Fault.STICTION and m.stick_slip is not None else m.play

    @property
    def told_between_rows(self) -> bool:
        """Whether the loop is identified at any sampling: its ringing causes the cycle, or the valve does, fitted
        with OP between the rows from control law and scan."""
        if self.cause is Cause.VALVE and self.measured is not None:
            return scans_per_row(self.measured.controller, self.fit.window.row_s) > 1
        return self.cause is Cause.TUNING and any(s.kind is SignKind.RINGING for s in self.signs)

    @property
    def for_settings(self) -> Verdict:
        """The verdict whose model settings are searched on: that of one friction for all slips."""
        return self if self.steady is None or self.cause is not Cause.VALVE else self.steady


TEMPER_NAT = 50.0
"""Gain in log likelihood [nat] by which the doubt in a model's verdict falls to a third; a judgement: the resulting
probabilities are not calibrated."""
LEAST_AGREED = 0.25
"""Probability of a cause from the other signs [-] from which they do not contradict the model that names it; ours: on
benchmarks/world, seeds 115 to 118, the one wrong cause had .17, the right ones that were undecided .30 and more."""
NO_CAUSE = Verdict(Cause.NONE, dict.fromkeys(CAUSES, 0.0), Fault.NONE)


def not_assessed(needs: Requirement | None) -> Verdict:
    """The verdict without a cause, with its requirement."""
    return Verdict(Cause.UNDECIDED, dict.fromkeys(CAUSES, 0.0), Fault.UNDECIDED, needs=needs)


def _ramp(x: float, low: float, high: float) -> float:
    """0 below low, 1 above high, linear between."""
    return min(max((x - low) / (high - low), 0.0), 1.0)


def needed(m: Measured, limits: CauseLimits, oscillating: bool) -> float:
    """Evidence required of these measures [nat]."""
    return limits.needed(m.play.count, m.excited, oscillating)


def _crossed(m: Measured, limits: CauseLimits, oscillating: bool) -> bool:
    """Whether OP moves far enough to move a stem with a fault of the width found: over its whole range with tails in
    a cycle; over its usual range in a calm loop, whose tails are kicks of its set point. OP of a valve that rarely
    slips stays within its stickband, so the whole range counts there too."""
    whole = oscillating or fault_of(m, limits) is Fault.STICTION
    return m.play.valve.stickband <= limits.widest * float(np.ptp(m.window.op)) and (whole or m.size <= 1.0)


def speaks(m: Measured, limits: CauseLimits, oscillating: bool) -> bool:
    """Whether PV shows a valve fault: enough evidence, a process gain of the controller's sign, and a width that OP
    has crossed."""
    wrong_way = m.controller is not None and m.controller.kp * m.play.gain < 0
    return m.evidence >= needed(m, limits, oscillating) and not wrong_way and _crossed(m, limits, oscillating)


def agrees(m: Measured, limits: CauseLimits) -> bool:
    """Whether no single load explains the evidence of a calm loop: its stretches agree, or set point moves, which no
    load follows, suffice."""
    return m.steady >= limits.steady or m.asked >= needed(m, limits, False)


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
    if not speaks(m, limits, False) or m.evidence < least or (m.moves < limits.moves and not m.excited):
        return ()
    sure = 0.5 + 0.5 * _ramp(m.evidence, least, 4 * least)
    signs = [Sign(Cause.VALVE, sure, SignKind.CALM_EVIDENCE, (m.evidence,))]
    width = m.play.valve.stickband
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


def judge(m: Measured, oscillation: Oscillation | None, limits: CauseLimits) -> Verdict:
    """The cause of the cycle.

    If the control law is known, the identified loop shows whether it rings by itself. Else the most likely cause of
    an oscillation is named if its probability is high enough; the valve needs more, and evidence in PV for its fault,
    because a valve named as the cause is removed for repair. If a sign is unknown no cause is named.
    """
    if oscillation is None:
        return _quiet(m, limits)
    seen_as = Regularity(oscillation.rhythm.first, m.kurtosis, m.saturated >= limits.held)
    if m.ringing is not None and m.ringing.is_tight(seen_as, m.evidence, limits):
        return _rings(m, m.ringing, oscillation, limits)
    seen = measures(m, oscillation)
    if not np.isfinite(seen).all():
        return replace(not_assessed(None), measured=m)
    found = chances(seen)
    told = _by_likelihood(m, found, limits)
    if told is not None:
        return _likelier(m, *told, limits, signs_of(m, oscillation, seen))
    first = max(found, key=lambda c: found[c])
    confidence = {c: 100.0 * p for c, p in found.items()}
    if not _may_be(first, m, limits):
        confidence[first] = min(confidence[first], 0.9 * limits.named_pct)
    if m.ringing is not None and m.ringing.is_seen(limits):  # and the loop does not ring by itself
        confidence[Cause.TUNING] = min(confidence[Cause.TUNING], 0.9 * limits.named_pct)
    cause = first if confidence[first] >= _least(first, m, limits) else Cause.UNDECIDED
    fault = fault_of(m, limits) if cause is Cause.VALVE else Fault.NONE
    return Verdict(cause, confidence, fault, signs_of(m, oscillation, seen), measured=m)


def _rings(m: Measured, ringing: Ringing, oscillation: Oscillation, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that rings by itself; its process is the one under a smooth load, because a free noise
    model assigns the ringing to the load."""
    clear = min(max(1.0 - ringing.line_nat / ringing.line_needed(limits), 0.0), 1.0)
    pct = limits.named_pct + (limits.ringing_pct - limits.named_pct) * clear
    rest = 0.5 * (100.0 - pct)
    confidence = {Cause.VALVE: rest, Cause.TUNING: pct, Cause.LOAD: rest}
    signs = (
        Sign(Cause.TUNING, pct / 100.0, SignKind.RINGING, (ringing.ms, ringing.period_s)),
        Sign(Cause.TUNING, max(clear, 0.05), SignKind.SMOOTH_LOAD, (ringing.line_nat,)),
    )
    told = replace(m, linear=as_fit(ringing.smooth, m.window))
    return Verdict(Cause.TUNING, confidence, Fault.NONE, signs, measured=told)


def _may_be(cause: Cause, m: Measured, limits: CauseLimits) -> bool:
    """Whether a cause may be named: any but a valve without evidence in PV, or with a fault too small for OP."""
    return cause is not Cause.VALVE or (m.size >= limits.least_size and speaks(m, limits, True))


def _by_likelihood(m: Measured, found: dict[Cause, float], limits: CauseLimits) -> tuple[Cause, float] | None:
    """The cause whose model is more likely than the others, and by how much [nat]; None if there is none, the other
    signs contradict it, or it is a valve with so narrow a fault that a neighbour's oscillation explains it too."""
    told = None if m.ringing is None else m.ringing.likelier(m.evidence, limits)
    if told is None or found[told[0]] < LEAST_AGREED or not _may_be(told[0], m, limits):
        return None
    return None if told[0] is Cause.VALVE and m.size < limits.small_size else told


def _likelier(
    m: Measured, cause: Cause, nat: float, limits: CauseLimits, others: tuple[Sign, ...]
) -> Verdict:
    """The verdict on a cycle that one of valve and load explains better than the other, by `nat` [nat]: their odds,
    tempered, since models of loops are never exact. others, the other signs."""
    pct = limits.ringing_pct - (limits.ringing_pct - limits.load_pct) * math.exp(-nat / TEMPER_NAT)
    confidence = {**dict.fromkeys(CAUSES, 0.5 * (100.0 - pct)), cause: pct}
    signs = (Sign(cause, pct / 100.0, SignKind.LIKELIER, (str(cause), nat)), *others)
    fault = fault_of(m, limits) if cause is Cause.VALVE else Fault.NONE
    return Verdict(cause, confidence, fault, signs, measured=m)


def _least(cause: Cause, m: Measured, limits: CauseLimits) -> float:
    """Confidence [%] from which a cause is named.

    A stickband small relative to OP's range makes no square wave of PV, and a cycle of constant size may be external.
    """
    if cause is not Cause.VALVE:
        return limits.named_pct
    if m.size >= limits.small_size:
        return limits.valve_pct
    if m.harmonic > limits.square:
        return math.inf
    return limits.small_pct if m.kurtosis < limits.changing else limits.changing_pct


def _quiet(m: Measured, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that does not oscillate: a valve fault, if likelihood and size agree, or none."""
    signs = quiet_signs(m, limits)
    pct = combined(signs)
    is_valve = len(signs) >= limits.signs and pct >= limits.named_pct
    if not is_valve:
        pct = min(pct, 0.5 * limits.named_pct)
    confidence = {Cause.VALVE: pct, Cause.TUNING: 0.0, Cause.LOAD: 0.0}
    fault = fault_of(m, limits) if is_valve else Fault.NONE
    return Verdict(Cause.VALVE if is_valve else Cause.NONE, confidence, fault, signs, measured=m)


def hidden_by_grid(m: Measured, pv_step: float, oscillates: bool, limits: CauseLimits) -> bool:
    """Whether the valve's stickband moves PV by so few steps of its grid, pv_step [% of span], or PV of a calm loop
    covers so few, that the grid itself keeps PV constant as the valve would."""
    if m.window.position is not None and not m.window.decoded:
        return False
    best = m.stick_slip if m.stick_slip is not None and m.jump > limits.evidence_jump else m.play
    covered = float(np.ptp(m.window.y[m.window.usable]))
    rough = not oscillates and covered < limits.grid_covered * pv_step
    return rough or abs(best.gain) * best.valve.stickband < limits.grid_steps * pv_step


def cap_confidence(verdict: Verdict, most_pct: float) -> Verdict:
    """A verdict on few data: no confidence above `most_pct` [%]."""
    return replace(verdict, confidence={k: min(v, most_pct) for k, v in verdict.confidence.items()})


def dead_valve(record: LoopRecord, limits: CauseLimits) -> Sign | None:
    """A valve that no longer moves PV: OP winds over much of its range, the error keeps its sign, PV is constant."""
    good = ~(record.mask("gap") | record.mask("manual"))
    if record.sp_estimated or good.sum() < 100:
        return None
    wound = float(np.ptp(record.op[good]))
    if wound < limits.wound_pct:
        return None
    pv, e = record.pv[good], record.error[good]
    low, high = np.quantile(pv, [0.05, 0.95])
    still = float(high - low) <= 0.1 * float(np.median(np.abs(e)))
    one_sided = max(float((e > 0).mean()), float((e < 0).mean()))
    if not still or one_sided < 0.95:
        return None
    return Sign(Cause.VALVE, 0.9, SignKind.DEAD_VALVE, (wound,))


def with_dead_valve(verdict: Verdict, sign: Sign) -> Verdict:
    """A verdict of a clear valve fault without oscillation."""
    confidence = {Cause.VALVE: 90.0, Cause.TUNING: 0.0, Cause.LOAD: 0.0}
    return replace(
        verdict,
        cause=Cause.VALVE,
        confidence=confidence,
        fault=Fault.UNDECIDED,
        signs=(sign, *verdict.signs),
        dead=True,
    )


def resolve_ambiguity(
    verdict: Verdict, prepared: Prepared, oscillation: Oscillation | None, config: Config
) -> Verdict:
    """The verdict, or none if compressed trends make a likely valve uncertain, if the loop with a tuning cause is
    robust, and if a load is not likely enough, or the recording too coarse to show another cause: a load is the cause
    that remains then."""
    if oscillation is None or verdict.cause not in CAUSES:
        return verdict
    lacking = _hides(verdict, prepared, oscillation, config)
    if lacking is None:
        return verdict
    fault = Fault.UNDECIDED if verdict.cause is Cause.VALVE else verdict.fault
    hint = cap_confidence(verdict, 0.9 * config.cause.named_pct)
    return replace(hint, cause=Cause.UNDECIDED, fault=fault, needs=lacking)


def _hides(
    verdict: Verdict, prepared: Prepared, oscillation: Oscillation, config: Config
) -> Requirement | None:
    """Missing data to distinguish the named cause from others; None if there are none."""
    limits, pct = config.cause, verdict.confidence[verdict.cause]
    if verdict.cause is Cause.TUNING:
        return _robust(verdict, oscillation, config)
    if verdict.cause is Cause.VALVE:
        return None if pct >= limits.compressed_pct else compressed(prepared, None, config.quality)
    if any(s.kind is SignKind.LIKELIER for s in verdict.signs):  # by its model, not by what is missing
        return None
    unlikely = (
        None
        if pct >= limits.load_pct
        else Requirement(MissingData.MANUAL_TEST, RequirementKind.LOAD_IN_MANUAL, (pct,))
    )
    return _too_coarse_for_a_load(prepared, oscillation, limits) or unlikely


def _too_coarse_for_a_load(
    prepared: Prepared, oscillation: Oscillation, limits: CauseLimits
) -> Requirement | None:
    """Requirement of a recording in which every cause looks like a load: a cycle of few samples, or of few steps of
    PV's grid, no longer shows a valve's effect; None if it is sufficient."""
    steps = oscillation.amplitude_pct / max(prepared.pv_step, 1e-12)
    if steps < limits.steps_told:
        return Requirement(
            MissingData.FINER, RequirementKind.FINER, (prepared.pv_step, oscillation.amplitude_pct)
        )
    samples = oscillation.period_s / prepared.record.dt_s
    if samples < limits.samples_told:
        return Requirement(MissingData.FASTER, RequirementKind.OF_A_LOAD, (limits.samples_told, samples))
    return None


def _robust(verdict: Verdict, oscillation: Oscillation, config: Config) -> Requirement | None:
    """A test in manual, if signs indicate the tuning and the identified loop is robust; None if it is not."""
    ms = None if verdict.measured is None else sensitivity(verdict.measured, oscillation.period_s)
    if ms is None or ms > config.tuning.ms_most:
        return None
    return Requirement(MissingData.MANUAL_TEST, RequirementKind.TUNING_IN_MANUAL, (ms,))


def with_worn_valve(verdict: Verdict, period_s: float, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that cycles at a period [s] for another cause, its valve worn if backlash is seen outside
    the cycle's line: the valve needs repair regardless of the cause."""
    m = verdict.measured
    if m is None or verdict.cause is Cause.VALVE or m.window.position is not None:
        return verdict
    # ringing is no line: both methods must show the backlash
    if verdict.cause is Cause.TUNING and m.evidence <= 0.0:
        return verdict
    found = beside_line(m.linear, m.play, period_s)
    if not is_worn_beside(found, m, limits):
        return verdict
    return replace(verdict, fault=fault_of(m, limits), measured=replace(m, play=found.play))


def is_worn_beside(found: BesideLine, m: Measured, limits: CauseLimits) -> bool:
    """Whether backlash is seen outside the cycle's line: enough evidence on which the half-cycles agree, a process
    gain of the controller's sign, and a width that OP crosses."""
    right_way = m.controller is None or m.controller.kp * found.play.gain > 0.0
    steady = found.trials is not None and found.trials.steadiness >= limits.beside_steady
    crossed = limits.beside_size <= found.play.valve.stickband / max(m.window.reach, 1e-9) <= 1.0
    return found.evidence >= limits.beside_evidence and steady and crossed and right_way


def refine_stick_slip(verdict: Verdict, period_s: float, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that cycles, its valve's fault replaced if slips at variable distances explain PV better.

    The cause is unchanged: the test is for the kind of fault of a valve already identified by PV and OP. If the stem
    is identified slip by slip, the window contains it as if recorded. Settings are searched with one friction for all
    slips, found from the path's: searched on this verdict, whose stem includes a part of the load, they left 7 of 24
    sticking loops of proofs/retuning.py (seeds 21, 22, 81, 82) with no smaller error, one with a larger by 47 %. The
    cycle has a period of period_s [s].
    """
    m = verdict.measured
    if (
        verdict.cause is not Cause.VALVE
        or m is None
        or m.window.position is not None
        or m.window.y.size < FIT.short
    ):
        return verdict
    window = m.play.window
    blocks = replace(m.play, window=replace(window.of_rows, fine=False))
    play = descend(blocks, free_width=True) if window.fine or window.steps > 1 else m.play
    path = fit_irregular(play, generic_noise(), period_s, verdict.fault is not Fault.STICTION)
    if path is None:
        return verdict
    jump = path_evidence(path, play)
    more = jump - max(m.jump, 0.0)
    new = verdict.fault is Fault.BACKLASH  # for other faults a jump is known, or nearly
    share = limits.jump_share if new else 0.0
    if more < max(limits.evidence_jump, share * (m.evidence + more)):
        return verdict
    told = _with_path(m, path, jump, more)
    fault = fault_of(told, limits)
    law = _finely(refined(near_path(play, path)), m)
    best = max((x for x in (m.stick_slip, law) if x is not None), key=lambda fit: fit.log_likelihood)
    steady = replace(verdict, measured=replace(m, stick_slip=best), fault=fault)
    return replace(verdict, measured=told, fault=fault, steady=steady)


def _finely(fit: Fit, m: Measured) -> Fit:
    """A fit in blocks, refined at the resolution of the measures."""
    return descend(replace(fit, window=replace(fit.window, fine=True))) if m.window.fine else fit


def _with_path(m: Measured, path: SlipPath, jump: float, more: float) -> Measured:
    """The measures, with the path's stem and the friction and process of its fit."""
    fit = _finely(path.fit, m)
    linear, play = (replace(x, window=fit.window) for x in (m.linear, m.play))
    return replace(m, linear=linear, play=play, stick_slip=fit, jump=jump, evidence=m.evidence + more)
