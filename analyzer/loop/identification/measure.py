"""Measures for the signs of a cause: candidates fitted to one loop's trends, and their residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import CauseLimits
from analyzer.loop.identification.candidates import FitInputs, check_judged, fits_of, hopeful, refined
from analyzer.loop.identification.fit_data import due_to_answer, problem_of, scans_of
from analyzer.loop.identification.ringing import Ringing, calm_resonance, ringing_of
from analyzer.loop.oscillation.detection import Oscillation, error_spectrum
from analyzer.loop.oscillation.figures import at_limits_share
from identification.controller.pid_regression import fit_pi
from identification.estimation.evidence import (
    Trials,
    gains,
    stem_moves,
    trials,
    trials_between_moves,
)
from identification.estimation.model import Fitted
from identification.estimation.problem import Problem
from identification.models import Fopdt, Loop, Pid
from identification.record import LoopRecord, Mask
from identification.signals.phase import UNKNOWN, KeptPhase, kept_phase
from identification.signals.setpoint_response import at_rest
from identification.signals.spectrum import Spectrum, size_kurtosis
from tuning.frequency_response import is_stable, loop_response
from tuning.ringing import ObservedRinging, observed_ringing


@dataclass(frozen=True, slots=True)
class Measured:
    """The measures for the signs.

    linear, backlash, stick_slip : the fits; evidence [nat] of the better valve over none; size, its stickband over
    OP's range [-]; jump [nat], stick-slip over backlash; amplification |S| at the period [-], None without
    settings; stable, the identified loop; saturated, share of time at limits [-]; controller, stated or recovered;
    moves, number of moves of the better valve's stem; excited, whether set point moves drove the loop; trials,
    agreement of the stretches between OP reversals on the better valve, None with too few; kurtosis [-] of the
    band at the period, 3 for noise, 1.5 for a constant size; steady [-], of a calm loop, agreement of the
    stretches between moves of the stem on the better valve: their mean gain over its standard error, and
    response_nat, its gain while a response of PV to set point moves is expected [nat]; ringing, the models of a
    cycle under a smooth load, None without a cycle; observed, the ringing seen in the error, None without a cycle;
    kept, how well the cycle keeps its phase; scale_s, the period or another time scale of the loop [s].
    """

    linear: Fitted
    backlash: Fitted
    stick_slip: Fitted | None
    evidence: float
    size: float
    jump: float
    amplification: float | None
    stable: bool
    saturated: float
    controller: Pid | None
    moves: int
    excited: bool
    trials: Trials | None = None
    kurtosis: float = 3.0
    steady: float = 0.0
    response_nat: float = 0.0
    ringing: Ringing | None = None
    observed: ObservedRinging | None = None
    kept: KeptPhase = UNKNOWN
    scale_s: float = 60.0

    @property
    def problem(self) -> Problem:
        """The data of all the fits."""
        return self.linear.p

    def has_clock(self, limits: CauseLimits) -> bool:
        """Whether a clock outside the loop times the cycle: it keeps its phase over many periods, while OP does not
        reach a limit in each, which would fix the period of a loop's own cycle."""
        known = self.kept.periods >= limits.kept_periods and self.saturated < limits.at_limit
        return known and self.kept.share >= limits.kept_phase


def measure(
    record: LoopRecord,
    oscillation: Oscillation | None,
    controller: Pid | None,
    limits: CauseLimits,
    error: Spectrum | None = None,
    kind: str = "",
) -> Measured:
    """Fit the candidates and compute the measures for the signs; see Measured. Raises NotAssessedError if good
    samples are too scattered for an autoregressive model."""
    scale, calm = time_scale(record, oscillation, controller), oscillation is None
    problem = problem_of(record, scale, limits, kind, calm)
    check_judged(problem, limits)
    law = controller or recovered(record, scale, limits.law_known)
    controller = controller or recovered(record, scale)
    due = due_to_answer(record, problem, scale)
    question = FitInputs(scale, due, scans_of(record, problem, law), calm, limits)
    linear, backlash, stick, best, gained, jump = fits_of(problem, question)
    hopeless = calm and gained < hopeful(problem, question)
    amplification, stable = _amplification(linear.process, controller, scale)
    fine_linear, fine_backlash, fine_stick = refined((linear, backlash, stick), best, hopeless)
    seen_alone = Measured(
        linear=fine_linear,
        backlash=fine_backlash,
        stick_slip=fine_stick,
        evidence=gained,
        size=best.valve.stickband / max(problem.cycle_range, 1e-9),
        jump=jump,
        amplification=amplification,
        stable=stable,
        saturated=at_limits_share(record),
        controller=controller,
        moves=stem_moves(best),
        excited=bool(due.any()),
        scale_s=scale,
    )
    if oscillation is None:
        if problem.blocks.position is not None:
            return replace(seen_alone, steady=math.inf)
        alone = not record.mask("idle").any()  # else another loop moves PV too
        return _without_a_cycle(seen_alone, best, linear, due if alone else None)
    found = _of_a_cycle(seen_alone, best, linear, law, error)
    found = replace(found, kept=kept_phase(record.error, record.usable, scale / record.dt_s))
    return found if error is None else replace(found, kurtosis=_kurtosis(record, error, scale))


def ringing_period(m: Measured, limits: CauseLimits) -> float | None:
    """Period [s] at which the identified loop of a calm record rings; None if it is damped, or unknown."""
    ms, period_s = calm_resonance(m.linear, m.controller, m.scale_s)
    return period_s if ms >= limits.ringing_ms else None


def _without_a_cycle(m: Measured, best: Fitted, linear: Fitted, due: Mask | None) -> Measured:
    """Further measures of the stretches between moves of the stem, and of PV's set point responses."""
    shown = trials_between_moves(best, linear)
    response_nat = 0.0 if due is None else float(gains(best, linear)[due].sum())
    return replace(m, steady=0.0 if shown is None else shown.steadiness, response_nat=response_nat)


def _kurtosis(record: LoopRecord, error: Spectrum, scale_s: float) -> float:
    """Kurtosis of the cycle's size in the error at rest of the set point; if that moves too often, in the error
    without its part, whose removal disturbs a steady load over the whole record."""
    resting = at_rest(record.sp, scale_s / record.dt_s, after=True)
    if 2 * np.count_nonzero(resting) < resting.size:
        return size_kurtosis(error, error.duration_s / scale_s)
    whole = error_spectrum(record, whole=True)
    return size_kurtosis(whole, whole.duration_s / scale_s, resting[-whole.n :])


def _of_a_cycle(
    m: Measured, best: Fitted, linear: Fitted, law: Pid | None, error: Spectrum | None
) -> Measured:
    """Further measures of a cycle of this period: its models under a smooth load, and its regularity in the error."""
    scale = m.scale_s
    found = replace(m, ringing=ringing_of(linear, (best,) if m.evidence > 0.0 else (), law, scale))
    if error is None:
        return found
    return replace(
        found,
        observed=observed_ringing(scale, error),
        trials=trials(best, linear, scale),
    )


def recovered(record: LoopRecord, scale_s: float, least: float = 0.5) -> Pid | None:
    """PI settings recovered from the record if they explain at least `least` of OP's moves [-], else None."""
    found = fit_pi(record, scale_s)
    if found is None or found.explained < least or not math.isfinite(found.ti_s):
        return None
    return Pid(found.kp, found.ti_s, scan_s=record.dt_s)


def _amplification(process: Fopdt, controller: Pid | None, period_s: float) -> tuple[float | None, bool]:
    """|S| of the identified loop at the period, and whether the loop is stable."""
    if controller is None or process.gain * controller.sign <= 0:
        return None, True
    loop = Loop(process, controller)
    omega = np.array([2 * math.pi / period_s])
    return float(1 / abs(1 + loop_response(loop, omega)[0])), is_stable(loop)


def time_scale(record: LoopRecord, oscillation: Oscillation | None, controller: Pid | None) -> float:
    """The period [s], or an assumed time scale of a loop that does not oscillate.

    Four integral times if they are stated (the cycle of a PI loop with backlash is of that order), else sixty
    samples, so that blocks are samples.
    """
    if oscillation is not None:
        return oscillation.period_s
    top = len(record) * record.dt_s / 8
    if controller is not None and math.isfinite(controller.ti_s) and controller.ti_s > 0:
        return min(max(4 * controller.ti_s, 10 * record.dt_s), top)
    return min(60 * record.dt_s, top)
