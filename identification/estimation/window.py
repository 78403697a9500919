"""A stretch of a record prepared for fitting, PV in blocks and OP as recorded; the stem behind any valve; a fit.

The model of a fit is y = c0 + c1 t + c2 decay + K x + noise with A(q) noise = innovation: the stem is a valve
operator on the recorded OP, x the response of a unit-gain lag with dead time, A(q) = 1 - ar1 q^-1 - ... an
autoregression that whitens the residual. An integrator is a lag whose time constant exceeds the window; then only
gain over time constant is known. Gain and the c are solved linearly, time constant and dead time are searched, the
valve is scanned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.estimation.descent import nats
from identification.models import Fopdt
from identification.record import Floats, Mask
from identification.simulation.valve import RESTS, StemLaw, first_slip, stem_step

FAR_SMALLER = 0.5
"""Range of OP in its cycle over its whole range, below which widths are searched up to the cycle's: a cycle
that keeps its size has nearly all of OP's range in each two periods."""
LONGEST_DEAD_TIME = 0.25
"""Largest dead time searched, as a share of the window: beyond it the window holds under four of them."""
LONGEST_TIME_CONSTANT = 3.0
"""Largest time constant searched [windows]. Source: beyond it a lag and an integrator are one (PHYSICS:
integrator)."""


class Stems(NamedTuple):
    """Data from which the stem of any valve is computed [% OP]: equally probable paths of OP, shape (m, n * factor),
    their extremes in each block of `factor` samples, shape (m, n), and, as block means over the paths less their
    mean, the stem of an ideal valve and the recorded one (of length 0 if none)."""

    op: Floats
    low: Floats
    high: Floats
    ideal: Floats
    recorded: Floats
    factor: int


def less_mean(x: Floats) -> Floats:
    """x less its mean; an empty array for an empty one."""
    return x - x.mean() if x.size else x


@dataclass(frozen=True)
class Window:
    """A stretch of a record prepared for fitting; values that depend on it alone are computed once.

    y : PV [% PV] in blocks, shape (n,); op : OP [% OP] at `steps` instants of each row of the record, shape (n *
    factor * steps,); usable : bool, shape (n,), False at gaps; dt_s : interval of the blocks [s];
    most_time_constant_s and most_dead_time_s : known upper limits of such processes [s], inf if unknown; step_at :
    block at which the load steps, 0 if it does not; position : stem [% OP], shape of op, if recorded, or estimated
    from PV if `decoded`; fine : whether responses are computed at the record's own interval rather than in blocks.
    Within a block OP reacts to PV's noise, and a fine response with a dead time shorter than the block includes this
    reaction; in blocks it acts from the next block on. first : sample of its record at which it begins. turn :
    samples of OP in two periods of a cycle, 0 without a cycle. paths : shape (m, size of op), equally probable paths
    of OP, where OP between the rows is not recorded (between_samples.py); None where `op` is the only one.
    """

    y: Floats
    op: Floats
    usable: Mask
    dt_s: float
    factor: int = 1
    most_time_constant_s: float = math.inf
    most_dead_time_s: float = math.inf
    step_at: int = 0
    position: Floats | None = None
    fine: bool = False
    decoded: bool = False
    first: int = 0
    sp: Floats | None = None
    turn: int = 0
    steps: int = 1
    paths: Floats | None = None

    @cached_property
    def extra(self) -> Floats:
        """A further regressor, shape (n,): a step of the load at block `step_at`; zero if `step_at` is 0."""
        out = np.zeros(self.y.size)
        if self.step_at > 0:
            out[self.step_at :] = 1.0
        return out

    @cached_property
    def centred(self) -> Floats:
        """PV less its mean [% PV], shape (n,)."""
        return less_mean(self.y)

    @cached_property
    def op_blocks(self) -> Floats:
        """OP in blocks [% OP], shape (n,)."""
        return block_means(self.op, self.factor * self.steps)

    @cached_property
    def stems_in_blocks(self) -> Stems:
        """Stems that are known beforehand, in blocks."""
        return self._stems(self.factor * self.steps)

    @cached_property
    def stems(self) -> Stems:
        """Stems that are known beforehand, at the interval at which responses are computed."""
        return self._stems(self.steps) if self.fine else self.stems_in_blocks

    def _stems(self, factor: int) -> Stems:
        recorded = np.empty(0) if self.position is None else self.position
        paths = self.op[None] if self.paths is None else self.paths
        blocks = paths[:, : self.op.size // factor * factor].reshape(len(paths), -1, factor)
        low, high = blocks.min(axis=2), blocks.max(axis=2)
        ideal = less_mean(blocks.mean(axis=(0, 2)))
        return Stems(paths, low, high, ideal, less_mean(block_means(recorded, factor)), factor)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Largest time constant and dead time that are searched [s]."""
        longest = LONGEST_TIME_CONSTANT * self.duration_s, LONGEST_DEAD_TIME * self.duration_s
        known = self.most_time_constant_s, self.most_dead_time_s
        return max(min(longest[0], known[0]), self.dt_s), max(min(longest[1], known[1]), 2 * self.dt_s)

    @property
    def duration_s(self) -> float:
        """Length of the window [s]."""
        return self.y.size * self.dt_s

    @property
    def of_rows(self) -> Window:
        """The window with OP at the rows alone."""
        if self.steps == 1:
            return self
        op = np.ascontiguousarray(self.op[:: self.steps])
        return replace(self, op=op, paths=None, steps=1, turn=self.turn // self.steps)

    @property
    def row_s(self) -> float:
        """Interval of the record's rows [s]."""
        return self.dt_s / self.factor

    @property
    def step_s(self) -> float:
        """Interval of OP [s]."""
        return self.row_s / self.steps

    @property
    def half_block_s(self) -> float:
        """Correction of a fitted dead time [s]: the mean of a block of PV is later than its first sample, which is
        the time origin of the search in blocks."""
        return 0.5 * (self.factor - 1) * self.dt_s / self.factor

    @cached_property
    def op_range(self) -> float:
        """Range of OP without its 2 % tails [% OP]."""
        low, high = np.quantile(self.op, [0.02, 0.98])
        return float(high - low)

    @cached_property
    def cycle_range(self) -> float:
        """Range of OP within two periods if it cycles [% OP], else of all samples: set point moves change OP more
        than any cycle."""
        rows = self.op.size // self.turn if self.turn else 0
        if rows < 2:
            return self.op_range
        local = np.ptp(self.op[: rows * self.turn].reshape(rows, self.turn), axis=1)
        return min(self.op_range, float(np.quantile(local, 0.75)))

    @cached_property
    def reach(self) -> float:
        """Range of OP that limits the widths searched [% OP]: of all samples, unless its cycle is far smaller."""
        whole, cycle = self.op_range, self.cycle_range
        return max(cycle if cycle < FAR_SMALLER * whole else whole, 1e-9)


def block_means(x: Floats, factor: int) -> Floats:
    """Means of consecutive blocks, shape (n // factor,)."""
    n = x.size // factor
    return x[: n * factor].reshape(n, factor).mean(axis=1)


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted model.

    gain [% PV/% OP], time_constant_s and dead_time_s [s], valve, sigma2 the innovations variance [% PV squared],
    count the samples judged, ar the noise model of single lags (noise.py), shape (p,), base the coefficients of 1, t,
    decay and the load's step, shape (4,), window the data that it is fitted to.
    """

    gain: float
    time_constant_s: float
    dead_time_s: float
    valve: StemLaw
    sigma2: float
    count: int
    ar: Floats
    base: Floats
    window: Window = field(repr=False)

    @property
    def process(self) -> Fopdt:
        """The process, its dead time in the record's own samples."""
        return Fopdt(self.gain, self.time_constant_s, self.dead_time_s + self.window.half_block_s)

    @property
    def log_likelihood(self) -> float:
        """Gaussian log likelihood of the innovations, up to a constant."""
        return -nats(self.count, self.sigma2, 1.0)

    @property
    def slope(self) -> float:
        """Gain over time constant [% PV / (% OP s)]."""
        return self.gain / self.time_constant_s


@njit(cache=True)
def _resting_blocks(op: Floats, low: Floats, high: Floats, law: StemLaw, out: Floats) -> None:
    """`_add_path` for a stem that rests after each move, which needs no memory of the direction of motion."""
    factor = op.size // low.size
    stem = first_slip(op, law)
    for k in range(low.size):
        if high[k] - stem <= law.breakaway and stem - low[k] <= law.breakaway:
            out[k] += stem
            continue
        total = 0.0
        for i in range(k * factor, (k + 1) * factor):
            gap = op[i] - stem
            if gap > law.breakaway:
                stem = op[i] - law.sliding
            elif gap < -law.breakaway:
                stem = op[i] + law.sliding
            total += stem
        out[k] += total / factor


@njit(cache=True)
def _add_path(op: Floats, low: Floats, high: Floats, law: StemLaw, out: Floats) -> None:
    """Add the stem behind one path of OP to the means of blocks."""
    factor = op.size // low.size
    stem = (first_slip(op, law), 0.0, op[0])
    for k in range(low.size):
        if stem[1] == 0.0 and high[k] - stem[0] <= law.breakaway and stem[0] - low[k] <= law.breakaway:
            out[k] += stem[0]
            continue
        total = 0.0
        for i in range(k * factor, (k + 1) * factor):
            stem = stem_step(stem, op[i], law)
            total += stem[0]
        out[k] += total / factor


@njit(cache=True)
def stem_blocks(s: Stems, law: StemLaw) -> Floats:
    """Stem behind OP as means of blocks and of OP's paths, shape (n // factor,), of a valve with breakaway > 0.

    A stem at rest whose reach includes OP's extremes in a block stays at rest.
    """
    paths, n = s.low.shape
    out = np.zeros(n)
    for i in range(paths):
        if law.tolerance == RESTS:
            _resting_blocks(s.op[i], s.low[i], s.high[i], law, out)
        else:
            _add_path(s.op[i], s.low[i], s.high[i], law, out)
    return out if paths == 1 else out / paths


@njit(cache=True)
def stem_of(s: Stems, law: StemLaw) -> Floats:
    """Stem less its mean [% OP], shape (m,), behind a valve; the recorded stem if there is one."""
    if law.breakaway <= 0.0:
        return s.ideal
    if s.recorded.size:
        return s.recorded
    stem = stem_blocks(s, law)
    return stem - stem.mean()
