"""Valve backlash in a loop whose load has a spectral line: a joint model of process, backlash, smooth load and line.

At the line's frequency OP follows the load, so neither process nor valve can be identified from it alone. The joint
model assigns to the line what keeps its phase, and to the valve the harmonics and the other motion of its stem. Its
gain over the same load with an ideal valve is the evidence of the valve. A load that is no sine has harmonics as a
worn valve does, so the load with an ideal valve may have harmonics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from identification.estimation.evidence import Trials, agreement_of
from identification.estimation.model import Fitted
from identification.estimation.problem import Problem
from identification.estimation.search import Dynamics
from identification.estimation.smooth_load import SmoothFit, as_fit, fit_line, innovations_of, with_harmonics
from identification.record import Floats
from identification.signals.reversals import op_reversals
from identification.signals.robust import clipped_gain
from identification.simulation.valve import IDEAL, StemLaw, sticking

SHARES = np.geomspace(0.08, 0.95, 12)
"""Backlash widths of the scan, as shares of the range of OP in a cycle."""
BETWEEN = 1.25
"""Factor about the best width of the scan within which it is refined: the ratio of two neighbours of the scan."""
CLOSE = 0.01
"""Relative precision of the refined width."""


@dataclass(frozen=True, slots=True)
class BacklashUnderLine:
    """The joint model: the fit of its process and backlash, `worn`, and the likeliest with an ideal valve, `ideal`,
    and the gain in log likelihood of the first in each half-cycle [nat], shape (t,), outliers limited."""

    backlash: Fitted
    worn: SmoothFit
    ideal: SmoothFit
    gained: Floats

    @property
    def evidence(self) -> float:
        """Gain in log likelihood of the backlash [nat]."""
        return float(self.gained.sum())

    @property
    def trials(self) -> Trials | None:
        """Agreement of the half-cycles; None with fewer than four."""
        return agreement_of(self.gained) if self.gained.size > 3 else None


def fit_backlash_under_line(
    problem: Problem, begins: Sequence[Dynamics], valves: Sequence[StemLaw], period_s: float
) -> BacklashUnderLine:
    """Backlash under a load with a line of a period [s].

    begins : time constants and dead times [s], and valves : backlash or stick-slip, at which the search begins.
    """
    lined = fit_line(problem, period_s, (), begins)
    laws = [sticking(float(w), 0.0) for w in SHARES * problem.reach] + [
        x for x in valves if x.stickband > 0.0
    ]
    scanned = [fit_line(problem, period_s, (lined,), begins, law) for law in laws]
    first = max(scanned, key=_likelihood)
    worn = with_width(first, problem, period_s)
    ideal = _ideal(problem, worn, lined, period_s)
    return BacklashUnderLine(as_fit(worn, problem), worn, ideal, _gained(worn, ideal, problem, period_s))


def with_width(near: SmoothFit, problem: Problem, period_s: float) -> SmoothFit:
    """The fit behind backlash, or stick-slip of the same shape, with its width refined in a problem."""
    jump_share, at = near.law.slip_jump / near.law.stickband, math.log(near.law.stickband)

    def behind(log_width: float) -> SmoothFit:
        return fit_line(problem, period_s, (near,), (), sticking(math.exp(log_width), jump_share))

    best = minimize_scalar(
        lambda x: -behind(x).log_likelihood,
        bounds=(at - math.log(BETWEEN), at + math.log(BETWEEN)),
        method="bounded",
        options={"xatol": CLOSE},
    )
    return max((near, behind(float(best.x))), key=_likelihood)


def in_problem(found: BacklashUnderLine, problem: Problem, period_s: float) -> SmoothFit:
    """The joint model behind a faulty valve, fitted again in another problem, with its width refined."""
    process = found.worn.process
    begins = [(process.time_constant_s, max(process.dead_time_s - problem.half_block_s, 0.0))]
    return with_width(fit_line(problem, period_s, (), begins, found.worn.law), problem, period_s)


def _likelihood(fit: SmoothFit) -> float:
    return fit.log_likelihood


def _ideal(problem: Problem, worn: SmoothFit, near: SmoothFit, period_s: float) -> SmoothFit:
    """The likeliest fit with an ideal valve, whose load may have harmonics."""
    lined = fit_line(problem, period_s, (near, worn), (), IDEAL)
    return max((lined, with_harmonics(lined, problem, period_s)), key=_likelihood)


def _gained(worn: SmoothFit, ideal: SmoothFit, problem: Problem, period_s: float) -> Floats:
    """Gain in log likelihood of the first in each half-cycle of OP [nat], outliers limited."""
    at, mine = innovations_of(worn, problem, period_s)
    gained: Floats = np.zeros(problem.y.size)
    gained[at] = clipped_gain(mine, innovations_of(ideal, problem, period_s)[1])
    turns = op_reversals(problem.inputs.op, period_s / problem.dt_s)
    return np.asarray(np.add.reduceat(gained, turns)[:-1]) if turns.size > 1 else gained.sum(keepdims=True)
