"""Why a loop oscillates: valve, tuning or load, from signs that do not depend on each other.

1. Likelihood and size of a valve fault: a play (or stick-slip) on the recorded OP followed by a lag explains PV
   better than the lag alone, by innovations, and its width is a large share of OP's travel. Two questions.
2. What is left as load: PV less the model's response. Where the valve model removes the peak from the load,
   the valve made it; where the peak stays, it came from outside.
3. Amplification: the identified process and the controller's settings give |S| at the period. A tuning makes
   its own period only where the loop amplifies there.
4. The same process on both sides: the gain that the data outside the period's band give to the process that
   was identified with it. Under a strong load feedback alone is identified, and the gain falls or turns.
5. Rhythm: a load from a machine keeps its period as by a clock; noise through a resonance does not.
6. Wave: third harmonic locked to the phase of the fundamental (a triangle has 1/9, a square 1/3), after the
   idea of harmonics and bicoherence (Choudhury, Shah, Thornhill 2004); a sine points away from the valve.
7. Trials: each stretch between two turns of OP speaks for the valve or not; a fault is one that most of them show.
8. Size: noise through a resonance forgets its size as it forgets its phase (Rice 1945), so a cycle whose phase
   wanders and whose size is kept is no tuning's; and a linear loop's own period is a sine.
9. Oddness of the cross-correlation of OP and PV (Horch 1999), told but of little weight: with integral action
   and constant set point the controller fixes it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from analyzer.config import CauseLimits
from analyzer.decisions import CAUSES, Cause, Fault, Needs
from analyzer.measure import Measured
from analyzer.oscillation import Oscillation
from analyzer.trial_signs import (
    agree,
    denied_by_trials,
    foreign,
    keeps_its_size,
    repeats_itself,
    shown_by_trials,
)


@dataclass(frozen=True, slots=True)
class Sign:
    """One sign: which cause it points to, how strongly (0 to 1), and in words with figures."""

    points_to: str
    strength: float
    text: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """The cause of one loop's oscillation.

    cause; confidence [%] of each cause; fault of the valve; signs in words; source : the loop that leads, empty where
    none is known; needs : what the record lacks for a cause, None where it lacks nothing; measured; dead : the valve
    no longer moves PV at all.
    """

    cause: Cause
    confidence: dict[Cause, float]
    fault: Fault
    signs: tuple[Sign, ...] = ()
    source: str = ""
    needs: Needs | None = None
    measured: Measured | None = None
    dead: bool = False


NO_CAUSE = Verdict(Cause.NONE, dict.fromkeys(CAUSES, 0.0), Fault.NONE)


def not_assessed(needs: Needs | None) -> Verdict:
    """The verdict that abstains and says what it needs."""
    return Verdict(Cause.UNDECIDED, dict.fromkeys(CAUSES, 0.0), Fault.UNDECIDED, needs=needs)


def _ramp(x: float, low: float, high: float) -> float:
    """0 below low, 1 above high, straight between."""
    return min(max((x - low) / (high - low), 0.0), 1.0)


def _needed(m: Measured, limits: CauseLimits, oscillating: bool) -> float:
    """Evidence needed [nat]: a floor, and a share of the samples, for no model is exact."""
    per_sample = limits.evidence_per_sample * (1.0 if oscillating else limits.quiet_factor)
    least = limits.evidence if m.excited or oscillating else limits.evidence_unexcited
    return max(least, per_sample * m.play.count)


def valve_signs(m: Measured, limits: CauseLimits, oscillating: bool) -> list[Sign]:
    """Signs for and against the valve."""
    needed = _needed(m, limits, oscillating)
    signs: list[Sign] = []
    wrong_way = m.controller is not None and m.controller.kp * m.play.gain < 0
    if m.moves < limits.moves and not m.excited:
        return signs
    if m.evidence >= needed and not wrong_way:
        text = f"play or stick-slip explains PV better than an ideal valve, log likelihood +{m.evidence:.0f}"
        signs.append(Sign("valve", 0.5 + 0.5 * _ramp(m.evidence, needed, 4 * needed), text))
    if m.evidence >= needed and m.cycles_alike:
        text = f"the identified loop with a play of {100 * m.size:.0f} % of OP's range cycles by itself as recorded"
        signs.append(Sign("valve", 0.8, text))
    if m.evidence >= needed and m.size >= limits.size and not wrong_way:
        text = f"its width is {100 * m.size:.0f} % of OP's range"
        signs.append(Sign("valve", 0.6 + 0.4 * _ramp(m.size, limits.size, 0.7), text))
    if not oscillating:
        return signs
    if m.evidence >= needed and m.trials is not None and agree(m, limits):
        text = f"{100 * m.trials.agreeing:.0f} % of {m.trials.count} stretches between turns of OP show it"
        signs.append(Sign("valve", 0.5, text))
    if m.evidence >= needed and m.line_valve < 0.5 * max(m.line_linear, limits.line):
        text = f"with it the load has no peak at the period (prominence {m.line_valve:.1f})"
        signs.append(Sign("valve", 0.5, text))
    if m.harmonic >= limits.harmonic:
        signs.append(
            Sign("valve", 0.4, f"phase-locked third harmonic {100 * m.harmonic:.0f} % of the fundamental")
        )
    return signs


def is_clockwork(m: Measured, o: Oscillation, limits: CauseLimits) -> bool:
    """Whether the period is kept better than any resonance of the loop could.

    Noise through a resonance of damping z has an autocorrelation that decays as exp(-2 pi z k) over k periods,
    and z is about 1/(2 |S|) at the peak; a loop that runs from limit to limit keeps its period too.
    """
    if m.saturated > limits.at_limits or m.kurtosis > limits.clock_kurtosis:
        return False
    decay = math.exp(-3 * math.pi / max(m.amplification or 1.0, 1e-3))
    return o.rhythm.third >= min(limits.narrow, max(decay + limits.steadier, limits.fairly_narrow))


def tuning_signs(m: Measured, o: Oscillation, limits: CauseLimits) -> list[Sign]:
    """Signs for the tuning."""
    signs = []
    amplified = m.amplification is not None and (m.amplification >= limits.resonance or not m.stable)
    amplified = amplified and not is_clockwork(m, o, limits) and not foreign(m, o, limits)
    if amplified:
        text = (
            "the identified loop is unstable"
            if not m.stable
            else f"the loop amplifies load {m.amplification:.1f} times"
        )
        strength = 1.0 if not m.stable else 0.5 + 0.5 * _ramp(m.amplification or 0.0, limits.resonance, 4.0)
        signs.append(Sign("tuning", strength, f"at the period {text}"))
    if amplified and m.consistency >= limits.consistent:
        signs.append(Sign("tuning", 0.7, "inside and outside the period's band the same process is seen"))
    if amplified:
        driven = m.saturated > limits.at_limits
        why = (
            "OP is driven from limit to limit"
            if driven
            else "its phase wanders as noise through a resonance does"
        )
        signs.append(Sign("tuning", 0.5, why))
    if amplified and m.line_linear < limits.line:
        signs.append(
            Sign("tuning", 0.4, f"the load has no peak at the period (prominence {m.line_linear:.1f})")
        )
    return signs


def load_signs(m: Measured, o: Oscillation, limits: CauseLimits) -> list[Sign]:
    """Signs for a load from outside."""
    signs = []
    calm = m.amplification is not None and m.amplification < limits.resonance and m.stable
    if calm and m.line_linear >= limits.line:
        text = f"the load itself has a peak at the period (prominence {m.line_linear:.0f})"
        signs.append(Sign("load", 0.8, text))
    if calm:
        signs.append(
            Sign("load", 0.4, f"the loop does not amplify at the period (|S| = {m.amplification:.1f})")
        )
    clockwork, free = is_clockwork(m, o, limits), m.saturated <= limits.at_limits
    if clockwork:
        signs.append(Sign("load", 0.7, "its frequency is constant, as no resonance keeps it"))
    hinted = m.evidence >= _needed(m, limits, True) and agree(m, limits)
    if keeps_its_size(m, o, limits) and not hinted:
        text = f"its size is constant, as no resonance keeps it (kurtosis {m.kurtosis:.1f}, noise has 3)"
        signs.append(Sign("load", 0.7, text))
    elif clockwork and m.kurtosis <= limits.kept_size_clock:
        signs.append(Sign("load", 0.4, f"its size is constant (kurtosis {m.kurtosis:.1f})"))
    if free and m.harmonic >= limits.edged:
        text = (
            f"the wave is no sine (third harmonic {100 * m.harmonic:.0f} %), as a linear loop's own would be"
        )
        signs.append(Sign("load", 0.4, text))
    if foreign(m, o, limits) and m.evidence < _needed(m, limits, True) and not agree(m, limits):
        signs.append(
            Sign(
                "load", 0.5, "no linear loop swings so, and at its turns PV follows OP as behind a free valve"
            )
        )
    if m.consistency < (limits.same_process if free else limits.consistent):
        signs.append(Sign("load", 0.6, "away from the period another process is seen: OP follows"))
    if m.harmonic < 0.5 * limits.harmonic:
        signs.append(Sign("load", 0.25, f"the wave is a sine (third harmonic {100 * m.harmonic:.0f} %)"))
    return signs


def combined(signs: Iterable[Sign], cause: Cause) -> float:
    """Confidence [%]: the signs taken as independent, none of them certain by itself (0.9 at most)."""
    doubt = 1.0
    for sign in signs:
        if sign.points_to == cause:
            doubt *= 1.0 - 0.9 * sign.strength
    return 100.0 * (1.0 - doubt)


def _fault(m: Measured, limits: CauseLimits) -> Fault:
    """Backlash or stiction, by what a slip jump adds to a play."""
    if m.stick_slip is None:
        return Fault.BACKLASH
    share = m.stick_slip.valve.slip_jump / max(m.stick_slip.valve.stickband, 1e-9)
    clear = max(limits.evidence_jump, limits.jump_share * m.evidence)
    if m.jump > clear and share >= limits.least_jump:
        return Fault.STICTION
    return Fault.BACKLASH if m.jump < 0.5 * clear or share < limits.least_jump else Fault.UNDECIDED


def judge(m: Measured, oscillation: Oscillation | None, limits: CauseLimits) -> Verdict:
    """Combine the signs; a cause is named from named_pct and two signs on, the valve before the others.

    The valve's signs are the only ones that rest on a model of the fault itself, so where they are complete
    (likelihood and size) what is left cannot be tuning or load at the same period, and those signs, which
    rest on the process behind an ideal valve, are set aside. Where all that shows the valve is one cycle again and
    again, neither it nor a load is named: a machine's load and a limit cycle without noise look alike.
    """
    signs = valve_signs(m, limits, oscillation is not None)
    valve = combined(signs, Cause.VALVE)
    is_valve = sum(s.points_to == Cause.VALVE for s in signs) >= limits.signs
    is_valve = is_valve and (m.size >= limits.size or m.cycles_alike or shown_by_trials(m, limits))
    is_valve = is_valve and not denied_by_trials(m, limits)
    is_valve = (
        is_valve and valve >= limits.named_pct and m.evidence >= _needed(m, limits, oscillation is not None)
    )
    repeated = is_valve and oscillation is not None and repeats_itself(m, oscillation, limits)
    is_valve = is_valve and not repeated
    if oscillation is not None and m.line_valve > limits.left * oscillation.prominence:
        is_valve = is_valve and m.line_valve < limits.left_of_load * m.line_linear
    if oscillation is not None and not is_valve:
        signs += tuning_signs(m, oscillation, limits) + load_signs(m, oscillation, limits)
        valve = min(valve, 0.9 * limits.named_pct)
    if not is_valve and oscillation is None:
        valve = min(valve, 0.5 * limits.named_pct)
    rest = {c: combined(signs, c) for c in (Cause.TUNING, Cause.LOAD)}
    if repeated:
        rest = {c: min(pct, 0.9 * limits.named_pct) for c, pct in rest.items()}
    confidence = {Cause.VALVE: valve, **rest}
    cause = Cause.NONE if oscillation is None else _named(signs, confidence, limits)
    cause = Cause.VALVE if is_valve else Cause.UNDECIDED if repeated else cause
    fault = _fault(m, limits) if is_valve else Fault.NONE
    return Verdict(cause, confidence, fault, tuple(signs), measured=m)


def _named(signs: list[Sign], confidence: dict[Cause, float], limits: CauseLimits) -> Cause:
    """Tuning or load, whichever is ahead by enough and has enough signs; else undecided."""
    first, second = sorted((Cause.TUNING, Cause.LOAD), key=lambda c: -confidence[c])
    enough = sum(s.points_to == first for s in signs) >= limits.signs
    doubt = 100.0 - confidence[first]
    if confidence[first] < limits.named_pct or not enough or doubt > 0.75 * (100.0 - confidence[second]):
        return Cause.UNDECIDED
    return first


def as_hint(verdict: Verdict, most_pct: float) -> Verdict:
    """A verdict that rests on little: no confidence above `most_pct` [%]."""
    return replace(verdict, confidence={k: min(v, most_pct) for k, v in verdict.confidence.items()})
