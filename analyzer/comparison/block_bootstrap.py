"""Interval of a difference of two spans of hourly figures that are correlated in time.

Blocks of 24 h are drawn, so that day and night stay together. Hours of one day are similar and days drift; seven days
per side are few. The spread between replicates is therefore widened by Student's t and by slow drift, as far as the
days themselves cannot exclude it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

Floats = NDArray[np.float64]

BLOCK_H = 24
"""Hours that are drawn together [h]: a day, so that each replicate has equally many nights and days; ours."""
REPLICATES = 2000
"""Replicates per side; the ends of a 95 % interval then vary by 3 % of its width between seeds; ours."""
DRIFTS = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.97])
"""Candidate correlations of one day with the next, with equal prior weight; ours: without a change, even a figure
that wanders over six weeks is then called changed 4 times in 100, and with 0.8 as the highest 14 times; without any,
9 % of the loops of proofs/honesty.py are."""
PERCENTILES = (2.5, 97.5)


@dataclass(frozen=True, slots=True)
class Side:
    """Hourly figures of one span on a grid of whole hours, shape (h,): the value of each hour, and its usable share
    as weight [h], 0 where the figure is unknown."""

    value: Floats
    weight: Floats

    @property
    def mean(self) -> float:
        """Mean of the hours, weighted by their usable share."""
        return float((self.value * self.weight).sum() / self.weight.sum())

    def days(self) -> tuple[Floats, Floats]:
        """Means and indices of the blocks of 24 h from the span's start, shape (d,) each; without empty ones."""
        edges = np.arange(0, self.value.size, BLOCK_H)
        weight = np.add.reduceat(self.weight, edges)
        total = np.add.reduceat(self.value * self.weight, edges)
        held = weight >= 0.25 * BLOCK_H
        return total[held] / weight[held], np.flatnonzero(held).astype(float)


@dataclass(frozen=True, slots=True)
class Difference:
    """A difference of two means with its interval, in the figure's own unit."""

    before: float
    after: float
    low: float
    high: float

    @property
    def value(self) -> float:
        """After minus before."""
        return self.after - self.before


def replicates(side: Side, rng: np.random.Generator) -> Floats:
    """Means of circular blocks of 24 h drawn with replacement, shape (REPLICATES,) (Politis and Romano 1992)."""
    n = side.value.size
    width = min(BLOCK_H, n)
    starts = rng.integers(0, n, (REPLICATES, max(round(n / width), 1)))
    top, bottom = (_block_sums(x, width)[starts].sum(axis=1) for x in (side.value * side.weight, side.weight))
    known = bottom > 0
    return np.where(known, top / np.where(known, bottom, 1.0), side.mean)


def _block_sums(x: Floats, width: int) -> Floats:
    """Sums of the blocks that begin at each hour, with the end joined to the start."""
    total = np.concatenate([[0.0], np.cumsum(np.concatenate([x, x[: width - 1]]))])
    return total[width:] - total[:-width]


def drift_factor(before: Side, after: Side) -> float:
    """Factor by which an interval is wider if days may drift than if they are independent [-], at least 1.

    The daily means are two levels plus a first-order autoregression; the variance of the difference of means is
    averaged over its correlation, weighted by the restricted likelihood (Patterson and Thompson 1971).
    """
    (left, at), (right, then) = before.days(), after.days()
    y = np.concatenate([left, right])
    if left.size < 2 or right.size < 2 or y.size < 5 or float(np.ptp(left) + np.ptp(right)) < 1e-12:
        return 1.0
    side = np.repeat([0, 1], [left.size, right.size])
    design = np.stack([side == 0, side == 1], axis=1).astype(float)
    lag = np.abs(np.subtract.outer(*[np.concatenate([at, then + before.value.size / BLOCK_H])] * 2))
    likelihood, variance = np.array([_drift(y, design, lag, rho) for rho in DRIFTS]).T
    weights = np.exp(likelihood - likelihood.max())
    mean = float((weights * variance).sum() / weights.sum())
    return float(np.sqrt(max(mean / variance[0], 1.0)))


def _drift(y: Floats, design: Floats, lag: Floats, rho: float) -> tuple[float, float]:
    """Restricted log likelihood of one correlation, and the variance of the difference of means under it."""
    r = rho**lag if rho else np.eye(y.size)
    inverse = np.linalg.inv(r)
    information = design.T @ inverse @ design
    residual = y - design @ np.linalg.solve(information, design.T @ inverse @ y)
    free = y.size - design.shape[1]
    square = float(residual @ inverse @ residual) / free
    likelihood = -0.5 * (np.linalg.slogdet(r)[1] + np.linalg.slogdet(information)[1] + free * np.log(square))
    weight = design[:, 1] / design[:, 1].sum() - design[:, 0] / design[:, 0].sum()
    return float(likelihood), float(square * (weight @ r @ weight))


def student(before: Side, after: Side, spread: tuple[float, float], level: float) -> float:
    """Student's quantile over the normal one [-], with Welch's degrees of freedom and a small sample's bias."""
    n = max(before.days()[0].size, 2), max(after.days()[0].size, 2)
    parts = [s * s for s in spread]
    if sum(parts) <= 0:
        return 1.0
    freedom = sum(parts) ** 2 / sum(p * p / (k - 1) for p, k in zip(parts, n, strict=True))
    bias = np.sqrt(sum(p * k / (k - 1) for p, k in zip(parts, n, strict=True)) / sum(parts))
    return float(bias * stdtrit(freedom, 0.5 + level / 2) / ndtri(PERCENTILES[1] / 100))


def difference(before: Side, after: Side, level: float, seed: int = 0, drifting: bool = True) -> Difference:
    """The difference of two spans with an interval that contains the true value with probability `level`.

    After begins where before ends, each with some usable hour. The level [-] is already corrected for the number of
    compared figures. One seed draws the same hours for every figure of a loop. With `drifting` False the days' load
    is known not to drift.
    """
    rng = np.random.default_rng(seed)
    left, right = replicates(before, rng), replicates(after, rng)
    spread = float(left.std()), float(right.std())
    wide = student(before, after, spread, level) * (drift_factor(before, after) if drifting else 1.0)
    value = after.mean - before.mean
    low, high = np.percentile(right - left, PERCENTILES) - value
    return Difference(before.mean, after.mean, value + wide * min(low, 0.0), value + wide * max(high, 0.0))
