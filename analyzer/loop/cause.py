"""Why a loop oscillates: valve, tuning or load, from signs that do not depend on each other.

1. Likelihood and size of a valve fault: a play (or stick-slip) on the recorded OP followed by a lag explains PV
   better than the lag alone, by innovations, in most stretches between two turns of OP, and its width is a large
   share of OP's travel. Two questions.
2. What is left as load: PV less the model's response. Where the valve model removes the peak from the load,
   the valve made it; where the peak stays, it came from outside.
3. Amplification: the identified process and the controller's settings give |S| at the period. A tuning makes
   its own period only where the loop amplifies there.
4. The same process on both sides: the gain that the data outside the period's band give to the process that
   was identified with it. Under a strong load feedback alone is identified, and the gain falls or turns.
5. Rhythm: a load from a machine keeps its period as by a clock; noise through a resonance does not.
6. Wave: third harmonic locked to the phase of the fundamental (a triangle has 1/9, a square 1/3), after the
   idea of harmonics and bicoherence (Choudhury, Shah, Thornhill 2004); a sine points away from the valve, and so do
   harmonics that the valve's model does not explain.
7. Size: noise through a resonance forgets its size as it forgets its phase (Rice 1945), so a cycle whose phase
   wanders and whose size is kept is no tuning's.

Of a loop that oscillates the signs are weighed together (cause_weights.py); a loop that does not can only have a
valve at fault, by the first two questions. A valve that is blamed is looked at slip by slip: does it stick at
distances that scatter, rather than play?
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

    cause; confidence [%] of each cause; fault of the valve; signs; needs : what the record lacks for a
    cause, None where it lacks nothing; measured; dead : the valve no longer moves PV at all; steady : the same by one
    friction for all slips, where it was told slip by slip since.
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
        """What was measured; NotAssessedError, with what the record lacks, where nothing was."""
        if self.measured is None:
            raise NotAssessedError(str(self.needs or NO_MODEL))
        return self.measured

    @property
    def fit(self) -> Fit:
        """The fit that it rests on, the valve's where that is at fault; NotAssessedError where there is none."""
        m = self.require_measured
        if self.cause is not Cause.VALVE:
            return m.linear
        return m.stick_slip if self.fault is Fault.STICTION and m.stick_slip is not None else m.play

    @property
    def told_between_rows(self) -> bool:
        """Whether the loop is known whatever the sampling: its ringing makes the cycle, or the valve does, fitted
        with what law and scan say of OP between the rows."""
        if self.cause is Cause.VALVE and self.measured is not None:
            return scans_per_row(self.measured.controller, self.fit.window.row_s) > 1
        return self.cause is Cause.TUNING and any(s.kind is SignKind.RINGING for s in self.signs)

    @property
    def for_settings(self) -> Verdict:
        """The verdict on whose model settings are sought: that of one friction for all slips."""
        return self if self.steady is None or self.cause is not Cause.VALVE else self.steady


TEMPER_NAT = 50.0
"""Gain in log likelihood [nat] by which the doubt in a model's verdict falls to a third; a judgement: the chances
that it gives are not calibrated."""
LEAST_AGREED = 0.25
"""Chance of a cause by the other signs [-] from which they do not contradict the model that names it; ours: on
benchmarks/world, seeds 115 to 118, the one wrong cause had .17, the right ones that were undecided .30 and more."""
NO_CAUSE = Verdict(Cause.NONE, dict.fromkeys(CAUSES, 0.0), Fault.NONE)


def not_assessed(needs: Requirement | None) -> Verdict:
    """The verdict that abstains and says what it needs."""
    return Verdict(Cause.UNDECIDED, dict.fromkeys(CAUSES, 0.0), Fault.UNDECIDED, needs=needs)


def _ramp(x: float, low: float, high: float) -> float:
    """0 below low, 1 above high, straight between."""
    return min(max((x - low) / (high - low), 0.0), 1.0)


def needed(m: Measured, limits: CauseLimits, oscillating: bool) -> float:
    """Evidence needed of these measures [nat]."""
    return limits.needed(m.play.count, m.excited, oscillating)


def _crossed(m: Measured, limits: CauseLimits, oscillating: bool) -> bool:
    """Whether OP goes far enough to move a stem behind a fault of the width found: over all of its range, tails too,
    in a cycle; of a calm loop, whose tails are kicks of its set point, over its usual range. OP of a valve that
    slips seldom stays within its stickband, so there the whole range counts too."""
    whole = oscillating or fault_of(m, limits) is Fault.STICTION
    return m.play.valve.stickband <= limits.widest * float(np.ptp(m.window.op)) and (whole or m.size <= 1.0)


def speaks(m: Measured, limits: CauseLimits, oscillating: bool) -> bool:
    """Whether PV speaks for a fault of the valve: enough evidence, a process that goes the controller's way, and a
    width that OP has crossed."""
    wrong_way = m.controller is not None and m.controller.kp * m.play.gain < 0
    return m.evidence >= needed(m, limits, oscillating) and not wrong_way and _crossed(m, limits, oscillating)


def agrees(m: Measured, limits: CauseLimits) -> bool:
    """Whether no single load gives the evidence of a calm loop: its stretches agree, or moves of the set point, for
    which no load waits, suffice."""
    return m.steady >= limits.steady or m.asked >= needed(m, limits, False)


def quiet_signs(m: Measured, limits: CauseLimits) -> tuple[Sign, ...]:
    """Signs of a valve at fault in a loop that does not oscillate.

    The stretches between moves of the stem must agree; of a fault that is narrow beside OP's range, as in a loop of a
    programme, they are a sign of their own. A few moves are told from steps of the load, unless the set point called
    for them, by more evidence.
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
    """Backlash or stiction, by what a slip jump adds to a play."""
    found, clear = jump_evidence(m, limits)
    if found > clear:
        return Fault.STICTION
    return Fault.BACKLASH if m.stick_slip is None or found < 0.5 * clear else Fault.UNDECIDED


def jump_evidence(m: Measured, limits: CauseLimits) -> tuple[float, float]:
    """Evidence for a slip jump and what it takes [nat], none where it was not looked for."""
    if m.stick_slip is None:
        return 0.0, 0.0
    clear = max(limits.evidence_jump, limits.jump_share * m.evidence)
    share = m.stick_slip.valve.slip_jump / max(m.stick_slip.valve.stickband, 1e-9)
    return min(m.jump, 10.0 * clear) if share >= limits.least_jump else 0.0, clear


def judge(m: Measured, oscillation: Oscillation | None, limits: CauseLimits) -> Verdict:
    """What makes the cycle.

    Where the controller's law is known the identified loop tells whether it rings by itself. Else, of a loop that
    oscillates, the likeliest cause is named where its probability is high enough; the valve's more so,
    and only where PV speaks for its fault, for a valve that is blamed is taken out. Where a
    sign is not known none is.
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
    """The verdict on a loop that rings by itself; its process is the one under a smooth load, for a free noise
    model takes the ringing for the load's."""
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
    """Whether a cause may be named: any but a valve of whose fault PV does not speak, or that OP hardly feels."""
    return cause is not Cause.VALVE or (m.size >= limits.least_size and speaks(m, limits, True))


def _by_likelihood(m: Measured, found: dict[Cause, float], limits: CauseLimits) -> tuple[Cause, float] | None:
    """The cause whose model is likelier than the others, and by how much [nat]; None where none is, where the other
    signs contradict it, or where it is a valve with so narrow a fault that a neighbour's wave has it, too."""
    told = None if m.ringing is None else m.ringing.likelier(m.evidence, limits)
    if told is None or found[told[0]] < LEAST_AGREED or not _may_be(told[0], m, limits):
        return None
    return None if told[0] is Cause.VALVE and m.size < limits.small_size else told


def _likelier(
    m: Measured, cause: Cause, nat: float, limits: CauseLimits, others: tuple[Sign, ...]
) -> Verdict:
    """The verdict on a cycle that one of valve and load explains better than the other, by so much [nat]: their
    odds, tempered, since models of loops are never quite true. others, the other signs."""
    pct = limits.ringing_pct - (limits.ringing_pct - limits.load_pct) * math.exp(-nat / TEMPER_NAT)
    confidence = {**dict.fromkeys(CAUSES, 0.5 * (100.0 - pct)), cause: pct}
    signs = (Sign(cause, pct / 100.0, SignKind.LIKELIER, (str(cause), nat)), *others)
    fault = fault_of(m, limits) if cause is Cause.VALVE else Fault.NONE
    return Verdict(cause, confidence, fault, signs, measured=m)


def _least(cause: Cause, m: Measured, limits: CauseLimits) -> float:
    """Confidence [%] from which a cause is named.

    A stickband that is small beside OP's range makes no square of PV, and a cycle that keeps its size may be brought.
    """
    if cause is not Cause.VALVE:
        return limits.named_pct
    if m.size >= limits.small_size:
        return limits.valve_pct
    if m.harmonic > limits.square:
        return math.inf
    return limits.small_pct if m.kurtosis < limits.changing else limits.changing_pct


def _quiet(m: Measured, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that does not oscillate: a valve at fault, where likelihood and size agree, or none."""
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
    covers so few, that the grid itself holds PV still as the valve would."""
    if m.window.position is not None and not m.window.decoded:
        return False
    best = m.stick_slip if m.stick_slip is not None and m.jump > limits.evidence_jump else m.play
    covered = float(np.ptp(m.window.y[m.window.usable]))
    rough = not oscillates and covered < limits.grid_covered * pv_step
    return rough or abs(best.gain) * best.valve.stickband < limits.grid_steps * pv_step


def cap_confidence(verdict: Verdict, most_pct: float) -> Verdict:
    """A verdict that rests on little: no confidence above `most_pct` [%]."""
    return replace(verdict, confidence={k: min(v, most_pct) for k, v in verdict.confidence.items()})


def dead_valve(record: LoopRecord, limits: CauseLimits) -> Sign | None:
    """A valve that no longer moves PV: OP winds over much of its range, the error stays on one side, PV is still."""
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
    """A verdict of a valve that is plainly at fault without oscillation."""
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
    """The verdict, or none where trends on straight segments make a likely valve of a load, where the loop that is
    called too tight is robust, and where a load is not likely enough, or what is recorded too coarse for another
    cause to show: a load is what is left then."""
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
    """What the recording lacks to tell the cause that is named from others; None where it lacks nothing."""
    limits, pct = config.cause, verdict.confidence[verdict.cause]
    if verdict.cause is Cause.TUNING:
        return _robust(verdict, oscillation, config)
    if verdict.cause is Cause.VALVE:
        return None if pct >= limits.compressed_pct else compressed(prepared, None, config.quality)
    unlikely = (
        None
        if pct >= limits.load_pct
        else Requirement(MissingData.MANUAL_TEST, RequirementKind.LOAD_IN_MANUAL, (pct,))
    )
    return _too_coarse_for_a_load(prepared, oscillation, limits) or unlikely


def _too_coarse_for_a_load(
    prepared: Prepared, oscillation: Oscillation, limits: CauseLimits
) -> Requirement | None:
    """What a recording lacks in which every cause looks like a load: a wave of few samples, or of few steps of PV's
    grid, has lost what a valve writes into it; None where it lacks nothing."""
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
    """A test in manual, where signs speak for the tuning and the identified loop is robust; None where it is not."""
    ms = None if verdict.measured is None else sensitivity(verdict.measured, oscillation.period_s)
    if ms is None or ms > config.tuning.ms_most:
        return None
    return Requirement(MissingData.MANUAL_TEST, RequirementKind.TUNING_IN_MANUAL, (ms,))


def with_worn_valve(verdict: Verdict, period_s: float, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that cycles at a period [s] for another cause, its valve worn where play is seen beside
    the cycle's line: whatever makes the cycle, the valve is to be repaired."""
    m = verdict.measured
    if m is None or verdict.cause is Cause.VALVE or m.window.position is not None:
        return verdict
    # ringing is no line: both ways of looking must see the play
    if verdict.cause is Cause.TUNING and m.evidence <= 0.0:
        return verdict
    found = beside_line(m.linear, m.play, period_s)
    if not is_worn_beside(found, m, limits):
        return verdict
    return replace(verdict, fault=fault_of(m, limits), measured=replace(m, play=found.play))


def is_worn_beside(found: BesideLine, m: Measured, limits: CauseLimits) -> bool:
    """Whether play is seen beside the cycle's line: enough evidence on which the half-cycles agree, a process that
    goes the controller's way, and a width that OP crosses."""
    right_way = m.controller is None or m.controller.kp * found.play.gain > 0.0
    steady = found.trials is not None and found.trials.steadiness >= limits.beside_steady
    crossed = limits.beside_size <= found.play.valve.stickband / max(m.window.reach, 1e-9) <= 1.0
    return found.evidence >= limits.beside_evidence and steady and crossed and right_way


def refine_stick_slip(verdict: Verdict, period_s: float, limits: CauseLimits) -> Verdict:
    """The verdict on a loop that cycles, its valve's fault named anew where slips that scatter explain PV better.

    The cause stays: what is asked is how the valve fails that PV and OP convict already. Where its stem is told slip
    by slip, the window has it as if it had been recorded. Settings are sought with one friction for all slips, found
    about the path's: sought on this verdict, whose stem takes up part of what the load did, they left 7 of 24
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
    new = verdict.fault is Fault.BACKLASH  # of another fault a jump is known, or all but so
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
    """A fit in blocks followed to its end at the resolution of what was measured."""
    return descend(replace(fit, window=replace(fit.window, fine=True))) if m.window.fine else fit


def _with_path(m: Measured, path: SlipPath, jump: float, more: float) -> Measured:
    """What was measured, with the path's stem and the friction and process behind it."""
    fit = _finely(path.fit, m)
    linear, play = (replace(x, window=fit.window) for x in (m.linear, m.play))
    return replace(m, linear=linear, play=play, stick_slip=fit, jump=jump, evidence=m.evidence + more)
