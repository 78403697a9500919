"""The data that a model is fitted to: a stretch of a record in samples or blocks, OP within them, the stem behind any
valve.

Fits of the batch run and of `explain` solve one problem type. The batch run fits blocks of rows, and knows OP, and
sometimes the stem, within them; `explain` fits the rows themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from identification.estimation.noise import AR_ORDER, Edges, edges_for, judged
from identification.limits import LIMITS, ExplainLimits
from identification.record import Floats, Mask
from identification.signals.correlation import correlated
from identification.signals.filters import in_band, without_lines
from identification.simulation.open_loop import ModelInputs
from identification.simulation.valve import RESTS, StemLaw, first_slip, stem_step

FAR_SMALLER = 0.5
"""Range of OP in its cycle over its whole range, below which widths are searched up to the cycle's: a cycle
that keeps its size has nearly all of OP's range in each two periods."""
LONGEST_DEAD_TIME = 0.25
"""Largest dead time searched, as a share of the window: beyond it the window holds under four of them."""
LONGEST_TIME_CONSTANT = 3.0
"""Largest time constant searched [windows]. Source: beyond it a lag and an integrator are one (PHYSICS:
integrator)."""


SINGLE_LAGS = np.arange(AR_ORDER + 1, dtype=np.int64)
"""Lag groups of a noise model of single lags."""


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


@dataclass(frozen=True, slots=True)
class Blocks:
    """How the samples of a problem are made of a record's rows, and OP and stem within them.

    op : OP [% OP] at `steps` instants of each row, shape (n * factor * steps,); factor : rows per sample; steps :
    instants of OP per row. most_time_constant_s and most_dead_time_s : known upper limits of such processes [s], inf
    if unknown; step_at : sample at which the load steps, 0 if it does not; position : stem [% OP], shape of op, if
    recorded, or estimated from PV if `decoded`; fine : whether responses are computed at the interval of the rows.
    Within a block OP reacts to PV's noise, and a fine response with a dead time shorter than the block includes this
    reaction; in blocks it acts from the next block on. first : row of its record at which it begins; sp : set point
    in blocks [% PV], shape (n,), None where it is unknown or constant. turn : instants of OP in two periods of a
    cycle, 0 without a cycle. paths : shape (m, size of op), equally probable paths of OP, where OP between the rows
    is not recorded (between_samples.py); None where `op` is the only one.
    """

    op: Floats
    factor: int = 1
    steps: int = 1
    most_time_constant_s: float = math.inf
    most_dead_time_s: float = math.inf
    step_at: int = 0
    position: Floats | None = None
    fine: bool = False
    decoded: bool = False
    first: int = 0
    sp: Floats | None = None
    turn: int = 0
    paths: Floats | None = None


@dataclass(frozen=True)
class Problem:
    """A stretch of a record prepared for fitting; values that depend on it alone are computed once.

    inputs : inputs of the model, one value per sample; y : PV less inputs.level, shape (n,); usable : bool, shape
    (n,), False at gaps; weight : shape (n,), weight of each innovation, 0 where it is not judged; edges : lag groups
    of the noise model; blocks : the rows of the samples. limits : thresholds for candidates; memory : in an
    experiment, largest number of samples per independent one; of a simulation judged by its own errors, horizon :
    samples after which it restarts (without_lines), 0 for one run over all, and band : shortest and longest period
    [samples] in which it is judged, None for all. The fits of the batch run have noise models of
    their own (gauss_newton.py), and judge each usable sample equally.
    """

    inputs: ModelInputs
    y: Floats
    usable: Mask
    weight: Floats
    edges: Edges = field(repr=False)
    blocks: Blocks
    limits: ExplainLimits = LIMITS
    memory: float = math.inf
    horizon: int = 0
    band: tuple[float, float] | None = None

    def judged_part(self, x: Floats) -> Floats:
        """The part of a simulation's errors, shape (n,), that is judged."""
        return in_band(x, *self.band) if self.band else without_lines(x, self.horizon)

    @property
    def count(self) -> int:
        """Number of samples judged."""
        return int((self.weight > 0).sum())

    @property
    def by_simulation(self) -> bool:
        """Whether simulation errors are judged, without a noise model."""
        return self.edges.size == 1

    def independent(self, e: Floats) -> int:
        """Number of independent samples among those judged, for a model with errors of shape (n,)."""
        memory = min(self.memory, correlated(e[self.weight > 0])) if self.by_simulation else 1.0
        return max(int(self.count / memory), 1)

    def with_blocks(self, **changes: Any) -> Problem:
        """The problem with other data within its samples; with another OP its means follow."""
        blocks = replace(self.blocks, **changes)
        if "op" not in changes:
            return replace(self, blocks=blocks)
        op = block_means(blocks.op, blocks.factor * blocks.steps)
        return replace(self, blocks=blocks, inputs=replace(self.inputs, op=op))

    @cached_property
    def extra(self) -> Floats:
        """A further regressor, shape (n,): a step of the load at sample `step_at`; zero if `step_at` is 0."""
        out = np.zeros(self.y.size)
        if self.blocks.step_at > 0:
            out[self.blocks.step_at :] = 1.0
        return out

    @cached_property
    def centred(self) -> Floats:
        """PV less its mean [% PV], shape (n,)."""
        return less_mean(self.y)

    @property
    def pv(self) -> Floats:
        """PV [% PV], shape (n,)."""
        return self.y + self.inputs.level

    @cached_property
    def stems_in_blocks(self) -> Stems:
        """Stems that are known beforehand, in blocks."""
        return self._stems(self.blocks.factor * self.blocks.steps)

    @cached_property
    def stems(self) -> Stems:
        """Stems that are known beforehand, at the interval at which responses are computed."""
        return self._stems(self.blocks.steps) if self.blocks.fine else self.stems_in_blocks

    def _stems(self, factor: int) -> Stems:
        x = self.blocks
        recorded = np.empty(0) if x.position is None else x.position
        paths = x.op[None] if x.paths is None else x.paths
        blocks = paths[:, : x.op.size // factor * factor].reshape(len(paths), -1, factor)
        low, high = blocks.min(axis=2), blocks.max(axis=2)
        ideal = less_mean(blocks.mean(axis=(0, 2)))
        return Stems(paths, low, high, ideal, less_mean(block_means(recorded, factor)), factor)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Largest time constant and dead time that are searched [s]."""
        longest = LONGEST_TIME_CONSTANT * self.duration_s, LONGEST_DEAD_TIME * self.duration_s
        known = self.blocks.most_time_constant_s, self.blocks.most_dead_time_s
        return max(min(longest[0], known[0]), self.dt_s), max(min(longest[1], known[1]), 2 * self.dt_s)

    @property
    def duration_s(self) -> float:
        """Length of the stretch [s]."""
        return self.y.size * self.dt_s

    @property
    def of_rows(self) -> Problem:
        """The problem with OP at the rows alone."""
        x = self.blocks
        if x.steps == 1:
            return self
        op = np.ascontiguousarray(x.op[:: x.steps])
        return self.with_blocks(op=op, paths=None, steps=1, turn=x.turn // x.steps)

    @property
    def dt_s(self) -> float:
        """Interval of the samples [s]."""
        return self.inputs.dt_s

    @property
    def row_s(self) -> float:
        """Interval of the record's rows [s]."""
        return self.dt_s / self.blocks.factor

    @property
    def step_s(self) -> float:
        """Interval of OP [s]."""
        return self.row_s / self.blocks.steps

    @property
    def half_block_s(self) -> float:
        """Correction of a dead time [s]: the mean of a block of PV is later than its first sample, which is the time
        origin of the search in blocks."""
        return 0.5 * (self.blocks.factor - 1) * self.dt_s / self.blocks.factor

    @cached_property
    def op_range(self) -> float:
        """Range of OP without its 2 % tails [% OP]."""
        low, high = np.quantile(self.blocks.op, [0.02, 0.98])
        return float(high - low)

    @cached_property
    def cycle_range(self) -> float:
        """Range of OP within two periods if it cycles [% OP], else of all samples: set point moves change OP more
        than any cycle."""
        op, turn = self.blocks.op, self.blocks.turn
        rows = op.size // turn if turn else 0
        if rows < 2:
            return self.op_range
        local = np.ptp(op[: rows * turn].reshape(rows, turn), axis=1)
        return min(self.op_range, float(np.quantile(local, 0.75)))

    @cached_property
    def reach(self) -> float:
        """Range of OP that limits the widths searched [% OP]: of all samples, unless its cycle is far smaller."""
        whole, cycle = self.op_range, self.cycle_range
        return max(cycle if cycle < FAR_SMALLER * whole else whole, 1e-9)


def problem(
    inputs: ModelInputs,
    y: Floats,
    usable: Mask,
    limits: ExplainLimits = LIMITS,
    edges: Edges | None = None,
) -> Problem:
    """A problem in a record's own samples, equally weighted where usable, with its own lag groups unless given."""
    edges = edges_for(usable) if edges is None else edges
    weight = judged(usable, int(edges[-1])).astype(float)
    return Problem(inputs, y, usable, weight, edges, Blocks(inputs.op), limits)


def in_blocks(pv: Floats, op: Floats, usable: Mask, dt_s: float, factor: int = 1, **more: Any) -> Problem:
    """A problem in blocks of `factor` rows.

    pv : PV [% PV] in blocks, shape (n,); op : OP [% OP] within them; usable : bool, shape (n,); dt_s : interval of
    the blocks [s]; more : the other fields of Blocks.
    """
    blocks = Blocks(op, factor, **more)
    inner, level = block_means(op, factor * blocks.steps), float(pv.mean())
    inputs = ModelInputs(inner, dt_s, float(op.mean()), level, (float(pv.min()), float(pv.max())))
    weight = judged(usable, AR_ORDER).astype(float)
    return Problem(inputs, pv - level, usable, weight, SINGLE_LAGS, blocks)


def block_means(x: Floats, factor: int) -> Floats:
    """Means of consecutive blocks, shape (n // factor,)."""
    n = x.size // factor
    return x[: n * factor].reshape(n, factor).mean(axis=1)


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
