"""Regression columns of an experiment's PV: process response to the stem, initial state, drift, neighbours.

Gains are linear, so a fit searches for times and backlash only (variable projection, Golub, Pereyra 1973).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from identification.models import Backlash
from identification.record import Floats, LoopRecord, Mask
from identification.simulation.lag import respond, unit_lag, unit_ramp
from identification.simulation.valve import stem_position

APART = 1.02
"""Smallest ratio of two lags: the partial fractions are singular for equal lags."""


class Kind(StrEnum):
    """Type of process response."""

    NO_ANSWER = "no answer"
    LAG = "lag"
    TWO_LAGS = "two lags"
    INVERSE = "inverse response"
    INTEGRATOR = "integrator"


@dataclass(frozen=True, slots=True)
class Trial:
    """One experiment in blocks: pv [% PV] as means of blocks and usable, shape (n,); op [% OP] on the record's own
    clock, shape (n * factor,), and the neighbours' OPs, each of that shape; dt_s of that clock [s]."""

    pv: Floats
    usable: Mask
    op: Floats
    dt_s: float
    factor: int
    neighbours: tuple[Floats, ...] = ()

    @property
    def block_s(self) -> float:
        """Length of a block [s]."""
        return self.dt_s * self.factor

    @property
    def time_s(self) -> Floats:
        """Middles of the blocks [s], shape (n,)."""
        n, dt = self.pv.size, self.dt_s
        return np.asarray((np.arange(n) * self.factor + 0.5 * (self.factor - 1)) * dt)

    @property
    def duration_s(self) -> float:
        """Length of the experiment [s]."""
        return self.op.size * self.dt_s


def trial_of(record: LoopRecord, factor: int, neighbours: tuple[Floats, ...] = ()) -> Trial:
    """A record in blocks of `factor` samples, without bad samples; the neighbours' OPs on the record's clock."""
    n = len(record) // factor
    good = record.at_work[: n * factor].reshape(n, factor)
    pv = record.pv[: n * factor].reshape(n, factor)
    usable = np.asarray(good.all(axis=1))
    op = np.ascontiguousarray(record.op[: n * factor])
    cut = tuple(np.ascontiguousarray(x[: n * factor]) for x in neighbours)
    return Trial(np.asarray(pv.mean(axis=1)), usable, op, record.dt_s, factor, cut)


def stem_of(op: Floats, width: float, slack: float) -> Floats:
    """The stem behind backlash of full width [% OP], of which the first move must take up `slack` [% OP]."""
    if width <= 0.0:
        return op
    moved = np.flatnonzero(op != op[0])
    direction = 1.0 if moved.size and op[moved[0]] > op[0] else -1.0
    return stem_position(op, Backlash(width), float(op[0] + direction * (slack - 0.5 * width)))


def answers(kind: Kind, stem: Floats, trial: Trial, lags_s: tuple[float, ...], dead_s: float) -> list[Floats]:
    """Columns of a process of unit gain: its response, for an inverse response also the derivative; shape (n,)
    each."""
    moved, dt, factor = stem - stem[0], trial.dt_s, trial.factor
    if kind is Kind.INTEGRATOR:
        return [respond(moved, unit_ramp(dead_s, dt), factor)]
    slow = respond(moved, unit_lag(lags_s[0], dead_s, dt), factor)
    if kind is Kind.LAG:
        return [slow]
    t1, t2 = lags_s[0], min(lags_s[1], lags_s[0] / APART)
    fast = respond(moved, unit_lag(t2, dead_s, dt), factor)
    both = (t1 * slow - t2 * fast) / (t1 - t2)
    return [both] if kind is Kind.TWO_LAGS else [both, (fast - slow) / (t1 - t2)]
