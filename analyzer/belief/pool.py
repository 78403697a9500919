"""Pooling of a constant over nights that differ by more than their own estimation errors.

Random effects by moments (DerSimonian, Laird 1986): the scatter of nights beyond their own errors is their spread,
and it limits the precision of the pooled value. Sums are stored, not nights, so that each night costs the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from identification.estimation.descent import INTERVALS_WIDER, NINETY


@dataclass(frozen=True, slots=True)
class Pooled:
    """A pooled value with its 90 % interval, and the spread between nights as standard deviation of its logarithm."""

    value: float
    low: float
    high: float
    spread: float


@dataclass(frozen=True, slots=True)
class Pool:
    """Sums over the logarithm x of a constant's size, with lower weight for older nights.

    count; total, of x; weight, of w = one over the variance of x; first, of w x; second, of w x squared; squares, of
    w squared; sign of the constant.
    """

    count: float = 0.0
    total: float = 0.0
    weight: float = 0.0
    first: float = 0.0
    second: float = 0.0
    squares: float = 0.0
    sign: float = 1.0

    def faded(self, share: float) -> Pool:
        """The same with the weight reduced for the nights since."""
        sums = share * self.count, share * self.total, share * self.weight
        return Pool(*sums, share * self.first, share * self.second, share * self.squares, self.sign)

    def plus(self, value: float, deviation: float, least: float, most: float) -> Pool:
        """With one more night: its value and the standard deviation of its logarithm, at least `least`; above `most`
        the night is ignored."""
        if value == 0.0 or not math.isfinite(value) or not deviation <= most:
            return self
        x, w = math.log(abs(value)), 1.0 / max(INTERVALS_WIDER * deviation, least) ** 2
        sums = self.count + 1.0, self.total + x, self.weight + w, self.first + w * x, self.second + w * x * x
        return Pool(*sums, self.squares + w * w, math.copysign(1.0, value))

    @property
    def pooled(self) -> Pooled | None:
        """Value, interval and spread; None without a night."""
        if self.weight <= 0.0:
            return None
        mean = self.first / self.weight
        excess = self.second - self.first * mean - max(self.count - 1.0, 0.0)
        free = self.weight - self.squares / self.weight
        between = max(excess / free, 0.0) if free > 1e-9 * self.weight and self.count > 1.0 else 0.0
        own = self.count / self.weight
        centre = (own * mean + between * self.total / self.count) / (own + between)
        half = NINETY * math.sqrt(1.0 / self.weight + between / self.count)
        low, high = math.exp(centre - half), math.exp(centre + half)
        low, high = sorted((self.sign * low, self.sign * high))
        return Pooled(self.sign * math.exp(centre), low, high, math.sqrt(between))
