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
7. Oddness of the cross-correlation of OP and PV (Horch 1999), told but of little weight: with integral action
   and constant set point the controller fixes it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from analyzer.assessments import noise_band
from analyzer.config import CauseLimits
from analyzer.oscillation import Oscillation
from identification.controller import fit_pi
from identification.hammerstein import (
    IDEAL,
    Fit,
    Rival,
    Window,
    better_linear,
    block_means,
    evidence,
    fit_linear,
    fit_play,
    fit_stick_slip,
    prepare,
    residual,
    stem_moves,
    with_load_step,
)
from identification.models import Fopdt, Loop, Pid
from identification.record import Floats, LoopRecord, Mask
from identification.spectrum import Spectrum, locked_harmonic, peak_prominence, spectrum, tapered_power
from tuning.linear import is_stable, loop_response

CAUSES = ("valve", "tuning", "load")


@dataclass(frozen=True, slots=True)
class Sign:
    """One sign: which cause it points to, how strongly (0 to 1), and in words with figures."""

    points_to: str
    strength: float
    text: str


@dataclass(frozen=True, slots=True)
class Measured:
    """What the signs are read from.

    linear, play, stick_slip : the fits; evidence [nat] of the better valve over none, size its stickband over
    OP's range [-], jump [nat] stick-slip over play; line_left and line_error : prominence of the load's and the
    error's spectrum at the period [-]; amplification |S| there [-], None without settings; stable the
    identified loop; consistency as in sign 4 [-]; harmonic [-]; saturated share of time at limits [-]; moves, how often the stem of the
    better valve sets out; excited, whether set point moves drove the loop.
    """

    linear: Fit
    play: Fit
    stick_slip: Fit | None
    evidence: float
    size: float
    jump: float
    line_linear: float
    line_valve: float
    amplification: float | None
    stable: bool
    consistency: float
    harmonic: float
    saturated: float
    controller: Pid | None
    window: Window
    moves: int
    excited: bool


@dataclass(frozen=True, slots=True)
class Verdict:
    """The cause of one loop's oscillation.

    cause : valve, tuning, load, none or undecided; confidence [%] of each cause; fault : backlash, stiction,
    none or undecided; signs in words; source : the loop that leads, empty where none is known; measured.
    """

    cause: str
    confidence: dict[str, float]
    fault: str
    signs: tuple[Sign, ...] = ()
    source: str = ""
    needs: str = ""
    measured: Measured | None = None


NO_CAUSE = Verdict("none", dict.fromkeys(CAUSES, 0.0), "none")


def not_assessed(needs: str) -> Verdict:
    """The verdict that abstains and says what it needs."""
    return Verdict("undecided", dict.fromkeys(CAUSES, 0.0), "undecided", needs=needs)


def time_scale(record: LoopRecord, oscillation: Oscillation | None, controller: Pid | None) -> float:
    """The period [s], or a guess of the loop's time scale where it does not oscillate.

    Four integral times where they are stated (the cycle of a PI loop with play is of that order), else sixty
    samples, so that blocks are samples.
    """
    if oscillation is not None:
        return oscillation.period_s
    top = len(record) * record.dt_s / 8
    if controller is not None and math.isfinite(controller.ti_s) and controller.ti_s > 0:
        return min(max(4 * controller.ti_s, 10 * record.dt_s), top)
    return min(60 * record.dt_s, top)


def latest_fit_stretch(record: LoopRecord, n: int) -> int:
    """First sample of the latest stretch of n samples with the fewest out of use."""
    out = record.bad | record.mask("manual")
    seen = np.concatenate(([0], np.cumsum(out)))
    firsts = np.arange(len(record) - n, -1, -max(n // 4, 1))
    return int(firsts[int(np.argmin(seen[firsts + n] - seen[firsts]))])


def window_of(record: LoopRecord, scale_s: float, limits: CauseLimits, kind: str = "") -> Window:
    """The latest stretch with the fewest samples out of use, in blocks of a fraction of the period."""
    factor = max(round(scale_s / limits.blocks_per_period / record.dt_s), 1)
    n = min(len(record) // factor, limits.window) * factor
    first = latest_fit_stretch(record, n)
    part = record.span(first, first + n)
    usable = block_means((~(part.bad | part.mask("manual"))).astype(np.float64), factor) > 0.99
    op = np.ascontiguousarray(part.op)
    known = {name: (t, dead) for name, t, dead in limits.fast_process}
    most = known.get(kind.lower(), (math.inf, math.inf))
    return Window(block_means(part.pv, factor), op, usable, record.dt_s * factor, factor, *most)


def answering(record: LoopRecord, window: Window, scale_s: float) -> Mask:
    """True where PV is due to answer a set point move, shape of the window.

    From a move for scale_s [s], and on until PV has come to the set point, however long the valve takes.
    """
    first = latest_fit_stretch(record, window.y.size * window.factor)
    sp = record.sp[first :: window.factor][: window.y.size]
    moves = np.flatnonzero(np.abs(np.diff(sp)) > 1e-6) + 1
    out = np.zeros(window.y.size, dtype=bool)
    if record.sp_estimated or not 0 < moves.size <= window.y.size / 10:
        return out
    reach = max(round(scale_s / window.dt_s), 1)
    error = np.abs(sp - window.y)
    near = error <= 3 * noise_band(window.y)
    for at, end in zip(moves, [*moves[1:], window.y.size], strict=True):
        there = np.flatnonzero(near[at + 1 : end])
        out[at : max(at + reach, at + 2 + int(there[0]) if there.size else end)] = True
    return out


def _op_range(window: Window, scale_s: float, oscillating: bool) -> float:
    """Range of OP that a fault is compared with [% OP]: within two periods where it oscillates, else of all."""
    whole = window.op_range
    if not oscillating:
        return whole
    length = max(round(2 * scale_s / window.dt_s * window.factor), 2)
    rows = window.op.size // length
    if rows < 2:
        return whole
    local = np.ptp(window.op[: rows * length].reshape(rows, length), axis=1)
    return min(whole, float(np.quantile(local, 0.75)))


def _prominence(x: Floats, dt_s: float, period_s: float) -> float:
    s = spectrum(x, dt_s)
    return peak_prominence(tapered_power(s), s.duration_s / period_s)


def _consistency(window: Window, fit: Fit, period_s: float) -> float:
    """Gain of the identified process outside the period's band over its gain with it."""
    prepared = prepare(window, IDEAL, fit.ar, period_s / window.dt_s)
    gain = float(prepared.score(fit.time_constant_s, fit.dead_time_s)[2][0])
    return gain / fit.gain if fit.gain else 0.0


def measure(
    record: LoopRecord,
    oscillation: Oscillation | None,
    controller: Pid | None,
    limits: CauseLimits,
    error: Spectrum | None = None,
    kind: str = "",
) -> Measured:
    """Fit the rivals and read what the signs need; see Measured."""
    scale = time_scale(record, oscillation, controller)
    window = window_of(record, scale, limits, kind)
    controller = controller or recovered(record, scale)
    linear = fit_linear(window, scale)
    play = fit_play(window, linear, scale)
    linear = better_linear(window, linear, play)
    best, stick, jump = play, None, 0.0
    if _worth_a_jump(play, linear, window, oscillation):
        stick = fit_stick_slip(window, play, scale)
        jump = evidence(Rival(window, stick), Rival(window, play))
        best = stick if jump > limits.evidence_jump else play
    due = answering(record, window, scale)
    plain = with_load_step(window, linear, due, best.ar)
    gained = evidence(Rival(window, best), plain) - (limits.evidence_jump if best is stick else 0.0)
    size = best.valve.stickband / max(_op_range(window, scale, oscillation is not None), 1e-9)
    amplification, stable = _amplification(linear, controller, scale)
    saturated = float(record.mask("saturated").mean())
    harmonic = locked_harmonic(error, scale) if error is not None and oscillation is not None else 0.0
    return Measured(
        linear,
        play,
        stick,
        gained,
        size,
        jump,
        _prominence(residual(window, linear), window.dt_s, scale),
        _prominence(residual(window, best), window.dt_s, scale),
        amplification,
        stable,
        _consistency(window, linear, scale) if oscillation is not None else 1.0,
        harmonic,
        saturated,
        controller,
        window,
        stem_moves(window, best.valve),
        bool(due.any()),
    )


def recovered(record: LoopRecord, scale_s: float) -> Pid | None:
    """PI settings recovered from the record where they explain OP, None where they do not."""
    found = fit_pi(record, scale_s)
    if found is None or found.explained < 0.5 or not math.isfinite(found.ti_s):
        return None
    return Pid(found.kp, found.ti_s, scan_s=record.dt_s)


def _worth_a_jump(play: Fit, linear: Fit, window: Window, oscillation: Oscillation | None) -> bool:
    """Whether stick-slip is fitted as well: where a play helps at all, and on short records, where it is cheap."""
    gained = play.log_likelihood - linear.log_likelihood
    wide = play.valve.stickband > 0.25 * window.op_range
    return (gained > 3.0 and wide) or (oscillation is None and window.y.size < 1500)


def _amplification(fit: Fit, controller: Pid | None, period_s: float) -> tuple[float | None, bool]:
    """|S| of the identified loop at the period, and whether the loop is stable."""
    if controller is None or fit.gain * controller.kp <= 0:
        return None, True
    loop = Loop(Fopdt(fit.gain, fit.time_constant_s, fit.dead_time_s), controller)
    omega = np.array([2 * math.pi / period_s])
    return float(1 / abs(1 + loop_response(loop, omega)[0])), is_stable(loop)


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
    if m.evidence >= needed and m.size >= limits.size and not wrong_way:
        text = f"its width is {100 * m.size:.0f} % of OP's range"
        signs.append(Sign("valve", 0.6 + 0.4 * _ramp(m.size, limits.size, 0.7), text))
    if not oscillating:
        return signs
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
    if m.saturated > limits.at_limits:
        return False
    decay = math.exp(-3 * math.pi / max(m.amplification or 1.0, 1e-3))
    return o.rhythm.third >= min(limits.narrow, max(decay + limits.steadier, limits.fairly_narrow))


def tuning_signs(m: Measured, o: Oscillation, limits: CauseLimits) -> list[Sign]:
    """Signs for the tuning."""
    signs = []
    amplified = m.amplification is not None and (m.amplification >= limits.resonance or not m.stable)
    amplified = amplified and not is_clockwork(m, o, limits)
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
    if is_clockwork(m, o, limits):
        signs.append(Sign("load", 0.7, "the period is kept as by a clock"))
    if m.consistency < limits.consistent:
        signs.append(Sign("load", 0.6, "away from the period another process is seen: OP follows"))
    if m.harmonic < 0.5 * limits.harmonic:
        signs.append(Sign("load", 0.25, f"the wave is a sine (third harmonic {100 * m.harmonic:.0f} %)"))
    return signs


def combined(signs: Iterable[Sign], cause: str) -> float:
    """Confidence [%]: the signs taken as independent, none of them certain by itself (0.9 at most)."""
    doubt = 1.0
    for sign in signs:
        if sign.points_to == cause:
            doubt *= 1.0 - 0.9 * sign.strength
    return 100.0 * (1.0 - doubt)


def _fault(m: Measured, limits: CauseLimits) -> str:
    """Backlash or stiction, by what a slip jump adds to a play."""
    if m.stick_slip is None:
        return "backlash"
    share = m.stick_slip.valve.slip_jump / max(m.stick_slip.valve.stickband, 1e-9)
    clear = max(limits.evidence_jump, limits.jump_share * m.evidence)
    if m.jump > clear and share >= limits.least_jump:
        return "stiction"
    return "backlash" if m.jump < 0.5 * clear or share < limits.least_jump else "undecided"


def judge(m: Measured, oscillation: Oscillation | None, limits: CauseLimits) -> Verdict:
    """Combine the signs; a cause is named from named_pct and two signs on, the valve before the others.

    The valve's signs are the only ones that rest on a model of the fault itself, so where they are complete
    (likelihood and size) what is left cannot be tuning or load at the same period, and those signs, which
    rest on the process behind an ideal valve, are set aside.
    """
    signs = valve_signs(m, limits, oscillation is not None)
    valve = combined(signs, "valve")
    is_valve = sum(s.points_to == "valve" for s in signs) >= limits.signs and m.size >= limits.size
    is_valve = (
        is_valve and valve >= limits.named_pct and m.evidence >= _needed(m, limits, oscillation is not None)
    )
    if oscillation is not None and m.line_valve > limits.left * oscillation.prominence:
        is_valve = False
    if oscillation is not None and not is_valve:
        signs += tuning_signs(m, oscillation, limits) + load_signs(m, oscillation, limits)
        valve = min(valve, 0.9 * limits.named_pct)
    confidence = {"valve": valve, "tuning": combined(signs, "tuning"), "load": combined(signs, "load")}
    cause = "valve" if is_valve else _named(signs, confidence, limits) if oscillation is not None else "none"
    if not is_valve and oscillation is None:
        confidence["valve"] = min(confidence["valve"], 0.5 * limits.named_pct)
    fault = _fault(m, limits) if is_valve else "none"
    return Verdict(cause, confidence, fault, tuple(signs), measured=m)


def _named(signs: list[Sign], confidence: dict[str, float], limits: CauseLimits) -> str:
    """Tuning or load, whichever is ahead by enough and has enough signs; else undecided."""
    first, second = sorted(("tuning", "load"), key=lambda c: -confidence[c])
    enough = sum(s.points_to == first for s in signs) >= limits.signs
    doubt = 100.0 - confidence[first]
    if confidence[first] < limits.named_pct or not enough or doubt > 0.75 * (100.0 - confidence[second]):
        return "undecided"
    return first


def dead_valve(record: LoopRecord, limits: CauseLimits) -> Sign | None:
    """A valve that no longer moves PV: OP winds over much of its range, the error stays on one side, PV is still.

    Returns
    -------
    Sign or None
    """
    good = ~(record.mask("gap") | record.mask("manual"))
    if record.sp_estimated or good.sum() < 100:
        return None
    op, pv, e = record.op[good], record.pv[good], record.error[good]
    wound = float(np.ptp(op))
    low, high = np.quantile(pv, [0.05, 0.95])
    still = float(high - low) <= 0.1 * float(np.median(np.abs(e)))
    one_sided = max(float((e > 0).mean()), float((e < 0).mean()))
    if wound < limits.wound_pct or not still or one_sided < 0.95:
        return None
    return Sign("valve", 0.9, f"OP winds over {wound:.0f} % while PV stands still off the set point")


def with_dead_valve(verdict: Verdict, sign: Sign) -> Verdict:
    """A verdict of a valve that is plainly at fault without oscillation."""
    confidence = {"valve": 90.0, "tuning": 0.0, "load": 0.0}
    return replace(
        verdict, cause="valve", confidence=confidence, fault="undecided", signs=(sign, *verdict.signs)
    )
