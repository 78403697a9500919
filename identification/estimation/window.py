"""A stretch of a record prepared for fitting: PV in blocks, OP as recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.limits import FIT
from identification.record import Floats, Mask


class Stems(NamedTuple):
    """What the stem of any valve follows from [% OP]: OP at the record's own interval, its extremes in each block of
    `factor` samples, and in means of such blocks, less their mean, the stem of an ideal valve and the recorded one
    (of no length where none is)."""

    op: Floats
    low: Floats
    high: Floats
    ideal: Floats
    recorded: Floats
    factor: int


def less_mean(x: Floats) -> Floats:
    """x less its mean; nothing of nothing."""
    return x - x.mean() if x.size else x


@dataclass(frozen=True)
class Window:
    """A stretch of a record prepared for fitting; what follows from it alone is computed once.

    y : PV [% PV] in blocks, shape (n,); op : OP [% OP] at the record's own interval, shape (n * factor,);
    usable : bool, shape (n,), False at gaps; dt_s : interval of the blocks [s]; most_time_constant_s and
    most_dead_time_s : what is known of such processes [s], inf where nothing is; step_at : block at which the
    load steps, 0 where it does not; position : stem [% OP], shape of op, where recorded or, `decoded`, told from PV;
    fine : whether responses are stepped at the record's own interval rather than in blocks. Within a block OP
    answers PV's noise, which a fine response meets where the dead time is shorter than the block; in blocks it counts
    from the next one on. first : sample of its record that it begins at.
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

    @cached_property
    def extra(self) -> Floats:
        """A further regressor, shape (n,): a step of the load at block `step_at`; zero where that is 0."""
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
        return block_means(self.op, self.factor)

    @cached_property
    def stems_in_blocks(self) -> Stems:
        """Stems that are known beforehand, in blocks."""
        recorded = np.empty(0) if self.position is None else block_means(self.position, self.factor)
        n = self.op.size // self.factor
        blocks = self.op[: n * self.factor].reshape(n, self.factor)
        low, high = blocks.min(axis=1), blocks.max(axis=1)
        return Stems(self.op, low, high, less_mean(self.op_blocks), less_mean(recorded), self.factor)

    @cached_property
    def stems(self) -> Stems:
        """The same at the interval at which responses are stepped."""
        if not self.fine:
            return self.stems_in_blocks
        recorded = np.empty(0) if self.position is None else self.position
        return Stems(self.op, self.op, self.op, less_mean(self.op), less_mean(recorded), 1)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Largest time constant and dead time that are searched [s]."""
        longest = FIT.longest_time_constant * self.duration_s, FIT.longest_dead_time * self.duration_s
        known = self.most_time_constant_s, self.most_dead_time_s
        return max(min(longest[0], known[0]), self.dt_s), max(min(longest[1], known[1]), 2 * self.dt_s)

    @property
    def duration_s(self) -> float:
        """Length of the window [s]."""
        return self.y.size * self.dt_s

    @property
    def half_block_s(self) -> float:
        """What is missing from a fitted dead time [s]: the mean of a block of PV stands later than its first sample,
        from which the search, whose model knows blocks alone, counts."""
        return 0.5 * (self.factor - 1) * self.dt_s / self.factor

    @cached_property
    def op_range(self) -> float:
        """Range of OP without its 2 % tails [% OP]."""
        low, high = np.quantile(self.op, [0.02, 0.98])
        return float(high - low)


def block_means(x: Floats, factor: int) -> Floats:
    """Means of consecutive blocks, shape (n // factor,)."""
    n = x.size // factor
    return x[: n * factor].reshape(n, factor).mean(axis=1)
