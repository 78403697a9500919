"""Whether the identified loop, simulated at its present settings, reproduces the record.

Settings are searched in simulation. A simulation that does not reproduce the record is no evidence for other
settings: a derivative, a filter or a limit missing in the model has turned promised gains into losses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.config import AdviceLimits
from analyzer.loop.identification.identified import load_of, recorded_error, tuned
from identification.controller.check import op_step
from identification.estimation.model import Fitted
from identification.estimation.problem import Stems, stem_of
from identification.models import Loop, Pid
from identification.record import Floats
from identification.simulation.closed_loop import scan_step
from identification.simulation.valve import backlash_stem
from tuning.forecast import in_digits, loop_in_digits, run, settled

LEAST = 0.5
"""A number of reversals [-] in place of none."""
STILL = 1e-9
"""Move of a stem [% OP] that is rounding of the simulation."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Ratio of a simulation at the present settings to the record [-]: reversals of the stem in a time, average
    absolute error, travel of OP and of the stem; counted, the reversals in the record and in the simulation."""

    reversals: float
    error: float
    op_travel: float
    stem_travel: float
    counted: tuple[int, int]

    @property
    def distance(self) -> float:
        """Distance of simulation and record [-]: the root of the sum of the squared logarithms of the ratios."""
        ratios = self.reversals, self.error, self.op_travel, self.stem_travel
        return math.hypot(*(math.log(max(x, 1e-9)) for x in ratios))

    def worst(self, limits: AdviceLimits) -> tuple[str, float] | None:
        """The figure farthest beyond its limit, and its ratio; None if all agree.

        The cycle of a worn valve under a load is irregular: a number of n reversals scatters by sqrt(n) at
        most. Two such standard errors are allowed in addition to the limit.
        Stem travel, a sum over as many moves, is allowed as
        much. The error is a mean over them, which scatter by half of their mean.
        """
        scatter = 2.0 * math.sqrt(sum(1.0 / max(n, LEAST) for n in self.counted))
        irregular = math.log(limits.agree_reversals) + scatter
        allowed = {
            "number of valve reversals": (self.reversals, irregular),
            "average absolute error": (self.error, max(math.log(limits.agree_error), 0.5 * scatter)),
            "OP travel": (self.op_travel, math.log(limits.agree_travel)),
            "stem travel": (self.stem_travel, max(math.log(limits.agree_travel), irregular)),
        }
        beyond = {n: abs(math.log(max(x, 1e-9))) / most for n, (x, most) in allowed.items()}
        name = max(beyond, key=lambda n: beyond[n])
        return None if beyond[name] <= 1.0 else (name, allowed[name][0])


def agreement(loop: Loop, fit: Fitted, load: Floats) -> Agreement:
    """Compare the loop at its present settings under a load on its scan [% PV], shape (n,), with the same stretch of
    a fit's record.

    Stem and OP are compared by their samples at the longer of both intervals, OP rounded as recorded and without
    moves within a digit: at a coarse digit OP's noise is not in the record.
    """
    sim, problem = settled(run(loop_in_digits(loop), in_digits(load))), fit.p
    dt_s, scan_s = problem.step_s, scan_step(loop)
    last = min(problem.blocks.op.size, math.ceil(len(sim) * scan_s / dt_s))
    own = problem.blocks.op[None]
    modelled = stem_of(Stems(own, own, own, problem.blocks.op, np.empty(0), 1), fit.valve)
    stem = modelled if problem.blocks.position is None else problem.blocks.position
    every = max(round(dt_s / scan_s), 1)
    digit = op_step(problem.blocks.op)
    recorded = [_travel(x[-last:], dt_s) for x in (backlash_stem(problem.blocks.op, digit), stem)]
    rounded = digit * np.round(sim.op[::every] / digit) if digit > 0.0 else sim.op[::every]
    simulated = [_travel(x, every * scan_s) for x in (backlash_stem(rounded, digit), sim.stem[::every])]
    op, moved = (s / max(r, 1e-9) for s, r in zip(simulated, recorded, strict=True))
    error = recorded_error(fit, loop.controller, math.ceil(len(sim) * scan_s / problem.dt_s))
    moved_on = (
        stem if problem.blocks.decoded else modelled
    )  # a recorded stem has the noise of its transmitter
    counted = reversals(moved_on[-last:]), reversals(sim.stem[::every])
    rate = counted[1] / max(counted[0], LEAST) * last * dt_s / (len(sim) * scan_s)
    ratio = float(np.mean(np.abs(sim.error))) / max(error, 1e-9) if math.isfinite(error) else 0.0
    return Agreement(rate, ratio, op, moved, counted)


def closest(fits: Sequence[Fitted], controller: Pid, limits: AdviceLimits) -> Fitted:
    """The fit behind a faulty valve whose simulation at the present settings is closest to the record."""

    def distance(fit: Fitted) -> float:
        process = tuned(fit, True, limits) if controller.kp else fit.process
        loop = Loop(process, controller, fit.valve.valve)
        return agreement(loop, fit, load_of(fit, controller)).distance

    return min(fits, key=distance)


def reversals(stem: Floats) -> int:
    """Number of times at which a stem, shape (n,), moves on in the other direction."""
    moves = np.diff(stem)
    signs = np.sign(moves[np.abs(moves) > STILL])
    return int(np.count_nonzero(signs[1:] != signs[:-1]))


def _travel(x: Floats, dt_s: float) -> float:
    """Travel of a signal [its unit / s]."""
    return float(np.abs(np.diff(x)).sum()) / max((x.size - 1) * dt_s, 1e-9)
