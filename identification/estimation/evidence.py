"""Likelihood gain of one model over another, limited so that no single event decides."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from identification.estimation.gauss_newton import descend, innovations
from identification.estimation.model import Fitted
from identification.estimation.noise import judged
from identification.estimation.problem import stem_of
from identification.record import Floats, Mask
from identification.signals.reversals import op_reversals
from identification.signals.robust import clipped_gain

STEP_PENALTY = 6.0
"""Gain in log likelihood that one step of the load at any time costs [nat]. Source: log of the blocks,
nearly."""

SECOND_LAGS = (0.1, 0.2, 0.4, 0.7)
"""Second lags that are tried, as shares of the dead time or of a block, the longer of both: ours; half of a longer
second lag is dead time (the rule of the half, Skogestad 2003), the other half belongs to the first lag."""


def evidence(ours: Fitted, theirs: Fitted) -> float:
    """Gain in log likelihood [nat] of one fit over another, with the innovations of outliers limited."""
    return float(clipped_gain(innovations(ours), innovations(theirs)).sum())


def moves_begun(fit: Fitted) -> np.ndarray:
    """Blocks at which the stem of a valve starts to move or reverses, shape (m,)."""
    moved = np.sign(np.diff(stem_of(fit.p.stems_in_blocks, fit.valve)))
    set_out = np.concatenate(([0.0], moved))
    return np.flatnonzero((set_out[1:] != set_out[:-1]) & (set_out[1:] != 0))


def stem_moves(fit: Fitted) -> int:
    """Number of times that the stem of a valve starts to move or reverses."""
    return int(moves_begun(fit).size)


def with_load_step(fit: Fitted, answering: Mask, noise: Floats) -> Fitted:
    """The linear fit with one step of the load at its largest innovation, if the gain exceeds its penalty.

    A single slip of a stem and a single step of the load are indistinguishable; only a slip that also explains why
    the stem did not move before is evidence of a valve fault. Where PV is due to respond to a set point move
    (`answering`, bool, shape (n,)) a step is not attributed to the load. `noise` is the noise model of the candidate,
    shape (p,), and a second start: a noise model fitted across the step is nearly an integrator.
    """
    counts = judged(fit.p.usable, fit.ar.size)
    white = np.where(answering[counts], 0.0, np.abs(innovations(fit)))
    if white.size < 50:
        return fit
    at = int(np.flatnonzero(counts)[int(np.argmax(white))])
    stepped = fit.within(step_at=at)
    tried = descend(stepped), descend(replace(stepped, ar=noise))
    trial = max(tried, key=lambda f: f.log_likelihood)
    return trial if trial.log_likelihood - fit.log_likelihood > STEP_PENALTY else fit


def with_second_lag(fit: Fitted) -> Fitted:
    """The linear fit behind a second lag on OP, if the gain exceeds the penalty of its constant.

    Backlash takes the small fast moves out of OP, as a lag does. OP moves much within a block under the set
    point of a master. Then backlash imitates a second lag of the process, or a dead time within a block. For
    a valve without a fault (benchmarks/world, seed 661) backlash gains 103 nat and a second lag 533 nat. For
    27 worn valves (seed 662) backlash gains 73 to 1,600 nat, and a second lag at most 50 nat with one
    exception.
    """
    problem, step_s = fit.p, fit.p.step_s
    longest_s = max(problem.dt_s, fit.dead_time_s)
    paths = problem.blocks.op[None] if problem.blocks.paths is None else problem.blocks.paths
    best = fit
    for share in SECOND_LAGS:
        kept = math.exp(-step_s / (share * longest_s))
        late = lfilter([1.0 - kept], [1.0, -kept], paths, zi=kept * paths[:, :1])[0]
        paths_behind = None if problem.blocks.paths is None else late
        trial = descend(fit.within(op=late[0], paths=paths_behind))
        best = max(best, trial, key=lambda x: x.log_likelihood)
    return best if best.log_likelihood - fit.log_likelihood > STEP_PENALTY else fit


@dataclass(frozen=True, slots=True)
class Trials:
    """Agreement of trials that one model is better than another.

    count; agreeing : share of trials in which it is better [-]; steadiness : mean gain over its standard error [-].
    """

    count: int
    agreeing: float
    steadiness: float

    @property
    def signs(self) -> float:
        """Excess of the trials in which it is better over half of them, in standard errors [-] (sign test)."""
        return (2.0 * self.agreeing - 1.0) * math.sqrt(self.count)


def gains(ours: Fitted, theirs: Fitted) -> Floats:
    """Gain in log likelihood of one fit over another at every block [nat], shape (n,), outliers limited."""
    out = np.zeros(ours.p.y.size)
    out[judged(ours.p.usable, ours.ar.size)] = clipped_gain(innovations(ours), innovations(theirs))
    return out


def trials(ours: Fitted, theirs: Fitted, period_s: float) -> Trials | None:
    """Agreement of the stretches between OP reversals that one fit explains PV better; None with fewer than four."""
    problem = ours.p
    at = op_reversals(problem.inputs.op, period_s / problem.dt_s)
    if at.size < 5:
        return None
    return agreement_of(np.add.reduceat(gains(ours, theirs), at)[:-1])


def agreement_of(gained: Floats) -> Trials:
    """Agreement of stretches that one model is better, from its gain in each [nat], shape (t,); one without good
    samples, whose gain is 0, does not count."""
    gained = gained[gained != 0.0]
    if gained.size < 2:
        return Trials(gained.size, float(gained.size > 0 and gained[0] > 0.0), 0.0)
    spread = float(gained.std(ddof=1)) / math.sqrt(gained.size)
    return Trials(gained.size, float((gained > 0).mean()), float(gained.mean()) / max(spread, 1e-9))


def trials_between_moves(ours: Fitted, theirs: Fitted) -> Trials | None:
    """Agreement of the stretches between stem moves of our fit, for a loop without cycles; None without a move. A
    load ramp opposed by OP resembles a resting stem once, but not repeatedly."""
    at = moves_begun(ours)
    at = at[at > 0]
    return agreement_of(np.add.reduceat(gains(ours, theirs), np.append(0, at))) if at.size else None
