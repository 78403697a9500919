"""Does the loop itself ring? Three explanations of the same record, each a model with its likelihood.

Tuning: the identified process with the controller's law has little damping and rings at the observed period under a
smooth load. Load: a periodic load drives a loop. Valve: the stem behind OP sticks or has backlash. See
identification/estimation/smooth_load.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import CauseLimits
from analyzer.loop.decisions import Cause
from identification.estimation.model import Fitted
from identification.estimation.problem import Problem
from identification.estimation.smooth_load import Dynamics, SmoothFit, fit_line, fit_smooth, resonant_starts
from identification.models import Loop, Pid, Process
from tuning.frequency_response import controller_response, maximum_sensitivity, resonance_s

OF_NOISE, OF_SINE = 3.0, 1.5
"""Kurtosis of noise through a resonance (Rice 1945) and of a sine; a cycle in bursts, as after set point moves, has
more than noise."""
TIMES = (2.0, 3.0, 5.0, 8.0, 10.0, 15.0, 20.0, 50.0, 100.0)
LEAST = (1.5, 1.57, 1.73, 1.89, 1.96, 2.1, 2.18, 2.42, 2.57)
"""Quantile of 5 % of the kurtosis of a cycle with so many independent exponential powers: of 20,000 draws each."""
LIKELY_MS = 30.0
"""Maximum sensitivity of a gain margin of 1.03: few loops are so near their limit of stability without crossing it,
while a loop without a fault under a sine, explained as ringing, has 34 and more (benchmarks/world)."""
POORLY_DAMPED = 2.0
"""Peak of the sensitivity above which a loop is poorly damped [-] (Astrom, Hagglund 2006: 1.4 to 2)."""
OF_RINGING = 2.0
"""Least ratio of the evidence for a valve fault to the penalty of its constants in a loop that rings
without it [-]; ours. A valve without a fault has 1.6 (benchmarks/world, seed 542). Worn ones have 2.6 and
3.6, a weakly worn one 1.8 (proofs/untidy_loops.py, seed 16)."""


@dataclass(frozen=True, slots=True)
class Regularity:
    """Regularity of a cycle: height of the first returning peak of the error's autocorrelation [-], kurtosis of the
    error's band at the period [-], whether OP reaches a limit in each cycle, which fixes the cycle's size, and the
    number of cycles in the record."""

    correlation: float
    kurtosis: float
    limited: bool
    cycles: float

    def least_kurtosis(self, ms: float) -> float:
        """Kurtosis that ringing of a maximum sensitivity exceeds in 95 of 100 records of so many cycles [-].

        The power of noise through a resonance is exponential (Rice 1945) and forgets itself in ms / pi periods: a few
        cycles of a loop near its limit of stability keep their size too.
        """
        return float(np.interp(math.log(max(self.cycles * math.pi / ms, 1e-9)), np.log(TIMES), LEAST))


@dataclass(frozen=True, slots=True)
class Ringing:
    """Fits of a loop under a smooth load.

    smooth, the process under a smooth load; lined, under one with a line; ms, maximum sensitivity of the loop under
    the smooth load [-], inf if it is unstable, and period_s, at which it rings [s]; cycle_s, the observed period [s];
    line_nat, valve_nat and both_nat, gain in log likelihood of a line in the load, of a valve's fault, and of both,
    over the smooth load [nat]; row_s, interval of the rows [s].
    """

    smooth: SmoothFit
    lined: SmoothFit
    ms: float
    period_s: float
    cycle_s: float
    line_nat: float
    valve_nat: float
    both_nat: float
    row_s: float

    def is_tight(self, m: Regularity, evidence: float, limits: CauseLimits) -> bool:
        """Whether the loop itself makes the cycle: it rings at the observed period, the cycle is no more regular than
        such ringing, and neither a line of the load nor a fault of the valve is needed.

        evidence, for a fault that may be the cause, under a free noise model [nat]. A fault that explains less than a
        line of the load is neither. A line that keeps its phase keeps its size too.
        """
        faulty = min(evidence, self.valve_nat) >= max(OF_RINGING * self.penalty, self.line_nat)
        if math.isinf(self.ms) and m.limited:  # it must cycle, under any load
            return self.rings(limits) and not faulty
        lined = self.has_line(limits) and m.kurtosis < limits.kept_size
        return self.rings(limits) and not (faulty or lined) and self.is_as_regular(m, limits)

    def gains(
        self, evidence: float, is_worn: bool, m: Regularity, limits: CauseLimits
    ) -> tuple[dict[Cause, float], float]:
        """Gain in log likelihood of each cause's model over a smooth load, and the gain of no cause [nat].

        evidence, for a valve fault under a free noise model [nat], and is_worn, whether that fault may be the cause.
        A cause that cannot make such a cycle is below the smooth load by the penalty, and so is the smooth load where
        its loop rings and the cycle is more regular than ringing. A line without evidence of its own is a cause only
        of a cycle that returns as such a line does, and keeps its size longer than likely ringing. A line that
        explains less than a valve fault is no cause, unless it remains in addition to the fault; then a fault
        that explains no more than the line is no cause.
        """
        none = -self.penalty
        rings, regular = self.rings(limits), self.is_as_regular(m, limits)
        beyond = self.both_nat - max(self.valve_nat, self.line_nat, 0.0) >= self.line_needed(limits)
        doubted = self.line_nat < evidence and evidence >= self.penalty and not beyond
        keeps = self.ms > LIKELY_MS or m.kurtosis < m.least_kurtosis(self.ms)
        returns = keeps and m.correlation >= returning_line(limits)
        shown = self.line_nat >= self.penalty or returns
        periodic = shown and self.keeps_phase(limits) and m.kurtosis < limits.kept_size and not doubted
        external = periodic and beyond and self.line_nat > self.valve_nat - self.penalty
        gains = {
            Cause.VALVE: max(self.valve_nat, none) if is_worn and not external else none,
            Cause.TUNING: 0.0 if rings and regular else none,
            Cause.LOAD: max(self.line_nat, 0.0) if periodic else none,
        }
        return gains, none if rings and not regular else 0.0

    def is_as_regular(self, m: Regularity, limits: CauseLimits) -> bool:
        """Whether the loop makes a cycle as regular as the observed one: any if OP reaches its limit in each cycle,
        and one that comes in bursts. Else noise rings through the loop: its size varies (Rice 1945), its correlation
        falls by exp(-2 pi z) a period under damping z, and its peak is about 1/(2 z)."""
        if m.limited or m.kurtosis >= OF_NOISE:
            return True
        implied = math.pi / -math.log(min(max(m.correlation, 1e-3), 1.0 - 1e-9))
        least = limits.kept_size if self.ms > LIKELY_MS else min(limits.kept_size, m.least_kurtosis(self.ms))
        return m.kurtosis >= least and implied <= limits.ringing_decay * self.ms

    def keeps_phase(self, limits: CauseLimits) -> bool:
        """Whether the line of the load has a constant phase."""
        return self.lined.line is not None and self.lined.line.kept >= limits.line_kept

    def is_periodic(self, limits: CauseLimits) -> bool:
        """Whether such a line gains more than the penalty of its constants."""
        return self.keeps_phase(limits) and self.line_nat >= self.penalty

    def has_line(self, limits: CauseLimits) -> bool:
        """Whether the gain of such a line is sufficient evidence against a ringing loop."""
        return self.keeps_phase(limits) and self.line_nat >= self.line_needed(limits)

    @property
    def penalty(self) -> float:
        """Penalty for three constants by Schwarz's criterion (1978) [nat]."""
        return 1.5 * math.log(self.smooth.count)

    def line_needed(self, limits: CauseLimits) -> float:
        """Gain from which a line is evidence against a ringing loop [nat]: the penalty plus a floor."""
        return limits.line_floor + self.penalty

    def rings(self, limits: CauseLimits) -> bool:
        """Whether the loop has little damping at the observed period."""
        return self.ms >= limits.ringing_ms and same_period(self.period_s, self.cycle_s, self.row_s, limits)


def returning_line(limits: CauseLimits) -> float:
    """Least correlation of the error after one period of a line [-]: it keeps its phase for LINE_KEPT periods, and is
    the share of the cycle's power at which a sine in noise has the kurtosis kept_size."""
    share = math.sqrt((OF_NOISE - limits.kept_size) / (OF_NOISE - OF_SINE))
    return math.exp(-1.0 / limits.line_kept) * share


def same_period(predicted_s: float, seen_s: float, row_s: float, limits: CauseLimits) -> bool:
    """Whether the period of a model agrees with that of a cycle, in a record with rows every row_s [s], within which
    the model's dead time is not known."""
    return abs(math.log(predicted_s / seen_s)) <= math.log(limits.ringing_period) + row_s / seen_s


def between_samples(process: Process, problem: Problem, controller: Pid) -> Process:
    """The process as the controller acts on it. The fit holds OP from one sample of the record to the next, while the
    controller moves it between them: half an interval of that hold belongs to the dead time."""
    hold_s = max(problem.step_s - controller.scan_s, 0.0)
    return replace(process, dead_time_s=process.dead_time_s + 0.5 * hold_s)


def calm_resonance(linear: Fitted, controller: Pid | None, scale_s: float) -> tuple[float, float]:
    """Maximum sensitivity [-] of the identified loop of a record without a cycle, and the period [s] of its peak; 1
    without settings, or if they act the wrong way."""
    if controller is None:
        return 1.0, scale_s
    problem, dead_s = linear.p, max(linear.dead_time_s, 0.0)
    begins = [(linear.time_constant_s, dead_s), *((f * scale_s, 0.05 * scale_s) for f in (0.05, 0.5, 3.0))]
    smooth = fit_smooth(problem, scale_s, [(b, None) for b in begins])
    return _peak(smooth, problem, controller, scale_s)


def ringing_of(
    linear: Fitted, valves: tuple[Fitted, ...], controller: Pid | None, period_s: float
) -> Ringing:
    """Fits under a smooth load of a loop that cycles at a period [s]; without settings it is not known to ring.

    linear, the night's fit with an ideal valve; valves, those with faulty ones that explain PV better.
    """
    problem = linear.p
    law = controller
    begins = [(x.time_constant_s, max(x.dead_time_s, 0.0)) for x in (linear, *valves)]
    begins += [(share * period_s, 0.05 * period_s) for share in (0.3, 2.0)]
    plain = [(begin, None) for begin in begins]
    smooth = fit_smooth(problem, period_s, [*_resonant(problem, period_s, law), *plain])
    away = fit_smooth(problem, period_s, plain)
    lined = fit_line(problem, period_s, (smooth, away), begins)
    faulty = [fit_smooth(problem, period_s, plain, x.valve, smooth) for x in valves]
    both = [fit_line(problem, period_s, (f, lined), (), f.law) for f in faulty]
    most = [max((f.log_likelihood for f in x), default=-math.inf) for x in ([lined], faulty, both)]
    ms, rings_s = _peak(smooth, problem, law, period_s)
    line_nat, valve_nat, both_nat = (x - smooth.log_likelihood for x in most)
    return Ringing(smooth, lined, ms, rings_s, period_s, line_nat, valve_nat, both_nat, problem.row_s)


def _resonant(problem: Problem, period_s: float, law: Pid | None) -> list[tuple[Dynamics, float]]:
    """Starts at which a loop under a known law rings at the period."""
    if law is None:
        return []
    omega = np.array([2.0 * math.pi / period_s])
    return resonant_starts(problem, period_s, complex(controller_response(law, omega)[0]))


def _peak(smooth: SmoothFit, problem: Problem, law: Pid | None, scale_s: float) -> tuple[float, float]:
    """Maximum sensitivity [-] of the loop of a fit, and the period [s] of its poorly damped peak nearest to the
    expected one, or of its largest; 1 without a law, or if it acts the wrong way."""
    if law is None or law.sign * smooth.process.gain <= 0.0:
        return 1.0, scale_s
    loop = Loop(between_samples(smooth.process, problem, law), law)
    return maximum_sensitivity(loop), resonance_s(loop, scale_s, POORLY_DAMPED)
