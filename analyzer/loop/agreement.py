"""Whether the identified loop, simulated at its present settings, reproduces the record.

Settings are searched in simulation. A simulation that does not reproduce the record is no evidence for other
settings: a derivative, a filter or a limit missing in the model has turned promised gains into losses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from analyzer.config import AdviceLimits
from analyzer.loop.identified import recorded_error
from identification.controller.check import op_step
from identification.estimation.window import Fit, Stems, stem_of
from identification.models import Loop
from identification.record import Floats
from identification.signals.correlation import lag_sums
from identification.simulation.closed_loop import scan_step
from identification.simulation.valve import play
from tuning.forecast import in_digits, loop_in_digits, run, settled

NEARLY = 0.8
"""Share of the autocorrelation's highest peak from which an earlier peak is the period's: peaks at multiples are as
high."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Ratio of a simulation at the present settings to the record [-]: period, average absolute error, travel of OP
    and of the stem; a period of 0 if the simulation does not cycle."""

    period: float
    error: float
    op_travel: float
    stem_travel: float

    def worst(self, limits: AdviceLimits) -> tuple[str, float] | None:
        """The figure farthest beyond its limit, and its ratio; None if all agree."""
        allowed = {
            "period": (self.period, limits.agree_period),
            "average absolute error": (self.error, limits.agree_error),
            "OP travel": (self.op_travel, limits.agree_travel),
            "stem travel": (self.stem_travel, limits.agree_stem),
        }
        beyond = {n: abs(math.log(max(x, 1e-9))) / math.log(most) for n, (x, most) in allowed.items()}
        name = max(beyond, key=lambda n: beyond[n])
        return None if beyond[name] <= 1.0 else (name, allowed[name][0])


def agreement(loop: Loop, fit: Fit, load: Floats, period_s: float) -> Agreement:
    """Compare the loop at its present settings under a load on its scan [% PV], shape (n,), with the record of a fit,
    which cycles at a period [s] if its error shows none.

    Travel of both is that of their samples at the longer of both intervals, OP rounded as recorded and without moves
    within a digit: at a coarse digit OP's noise is not in the record.
    """
    sim, window = settled(run(loop_in_digits(loop), in_digits(load))), fit.window
    dt_s, scan_s = window.step_s, scan_step(loop)
    last = min(window.op.size, math.ceil(len(sim) * scan_s / dt_s))
    own = window.op[None]
    stem = stem_of(Stems(own, own, own, window.op, np.empty(0), 1), fit.valve)
    if window.position is not None:
        stem = window.position
    every = max(round(dt_s / scan_s), 1)
    digit = op_step(window.op)
    recorded = [_travel(x[-last:], dt_s) for x in (play(window.op, digit), stem)]
    rounded = digit * np.round(sim.op[::every] / digit) if digit > 0.0 else sim.op[::every]
    simulated = [_travel(x, every * scan_s) for x in (play(rounded, digit), sim.stem[::every])]
    op, moved = (s / max(r, 1e-9) for s, r in zip(simulated, recorded, strict=True))
    error = float(np.mean(np.abs(sim.error))) / max(recorded_error(fit, loop.controller), 1e-9)
    sp = 0.0 if window.sp is None else window.sp
    own_s = period_of(sp - window.y, window.dt_s) or period_s
    return Agreement(period_of(sim.error, sim.dt_s) / own_s, error, op, moved)


def _travel(x: Floats, dt_s: float) -> float:
    """Travel of a signal [its unit / s]."""
    return float(np.abs(np.diff(x)).sum()) / max((x.size - 1) * dt_s, 1e-9)


def period_of(error: Floats, dt_s: float) -> float:
    """Period of the autocorrelation's first peak beyond its first zero that is nearly the highest [s], 0 if there is
    none; error, shape (n,), every dt_s [s]."""
    x = error - error.mean()
    if x.size < 8 or not np.any(x):
        return 0.0
    sums = lag_sums(x, x.size // 2)
    below = np.flatnonzero(sums < 0)
    if not below.size:
        return 0.0
    rest = sums[below[0] :]
    if rest.max() <= 0.0:
        return 0.0
    first = int(np.argmax(rest >= NEARLY * rest.max()))
    back = np.flatnonzero(rest[first:] < 0.5 * rest[first])
    end = first + int(back[0]) if back.size else rest.size
    return float((below[0] + first + int(np.argmax(rest[first:end]))) * dt_s)
