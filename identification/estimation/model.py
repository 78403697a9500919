"""A model of a loop, and its optimum in a problem.

The model is PV = level + slow terms + K x + noise with A(q) noise = innovation: the stem is a valve operator on the
recorded OP, x the response of a unit-gain lag with dead time, A(q) = 1 - ar1 q^-1 - ... an autoregression that
whitens the residual. An integrator is a lag whose time constant exceeds the record; then only gain over time constant
is known. Effects of the catalogue are added to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from identification.estimation.descent import nats
from identification.estimation.problem import Problem
from identification.models import Fopdt
from identification.record import Floats
from identification.simulation.parameters import Param, Slot, Variant, neutral
from identification.simulation.valve import StemLaw
from identification.simulation.valve_chain import friction_of, with_friction

BASE = (
    Param(Slot.T, "time_constant_s", "s", 0.3, 1e9, "dt", True),
    Param(Slot.L, "dead_time_s", "s", 0.0, 0.2, "span"),
    Param(Slot.K, "gain", "% PV/% OP", -1e4, 1e4),
    Param(Slot.BIAS, "bias_pct", "% PV", -2e3, 2e3),
    Param(Slot.START, "start_pct", "% PV", -300.0, 300.0),
)
"""Constants of the baseline model, free in every candidate."""


def _nothing() -> Floats:
    return np.empty(0)


@dataclass(frozen=True, slots=True)
class Model:
    """The additions to the baseline model, and all constants, shape (SIZE + own,)."""

    added: tuple[Variant, ...]
    c: Floats

    @property
    def params(self) -> tuple[Param, ...]:
        """Free constants: those of the baseline model that no addition replaces, and those of the additions."""
        own = tuple(p for v in self.added for p in v.params)
        replaced = {slot for v in self.added for slot in v.replaces}
        return (*(p for p in BASE if p.slot not in replaced), *own)


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model at its optimum in a problem.

    loss : mean square innovation, weighted [% PV squared]; count : number of independent innovations; ar : noise
    model, shape (groups,), or of single lags in the fits of the batch run; e : innovations [% PV], shape (n,), empty
    in those fits; slow : coefficients of 1, t, decay and the load's step in them, shape (4,), which BIAS and START
    replace elsewhere.
    """

    p: Problem = field(repr=False)
    model: Model
    loss: float
    count: int
    ar: Floats
    e: Floats = field(default_factory=_nothing, repr=False)
    slow: Floats = field(default_factory=_nothing, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the additions."""
        return tuple(v.name for v in self.model.added)

    @property
    def gain(self) -> float:
        """Process gain [% PV/% OP]."""
        return float(self.model.c[Slot.K])

    @property
    def time_constant_s(self) -> float:
        """Time constant [s]."""
        return float(self.model.c[Slot.T])

    @property
    def dead_time_s(self) -> float:
        """Dead time counted from the first row of a block [s]."""
        return float(self.model.c[Slot.L]) - self.p.half_block_s

    @property
    def valve(self) -> StemLaw:
        """The valve's friction."""
        return friction_of(self.model.c)

    @property
    def process(self) -> Fopdt:
        """The process, its dead time in the record's own samples."""
        return Fopdt(self.gain, self.time_constant_s, float(self.model.c[Slot.L]))

    @property
    def log_likelihood(self) -> float:
        """Gaussian log likelihood of the innovations, up to a constant."""
        return -nats(self.count, self.loss, 1.0)

    @property
    def slope(self) -> float:
        """Gain over time constant [% PV / (% OP s)]."""
        return self.gain / self.time_constant_s

    def within(self, **changes: Any) -> Fitted:
        """The same process and valve with other data within the samples (Blocks): a start, not an optimum."""
        return replace(self, p=self.p.with_blocks(**changes))

    def moved(
        self,
        *,
        gain: float | None = None,
        time_constant_s: float | None = None,
        dead_time_s: float | None = None,
        valve: StemLaw | None = None,
    ) -> Fitted:
        """Another process or another valve: a start, not an optimum."""
        c = self.model.c.copy() if valve is None else with_friction(self.model.c, valve)
        if gain is not None:
            c[Slot.K] = gain
        if time_constant_s is not None:
            c[Slot.T] = time_constant_s
        if dead_time_s is not None:
            c[Slot.L] = dead_time_s + self.p.half_block_s
        return replace(self, model=replace(self.model, c=c))


def start_at(p: Problem, gain: float, dynamics: tuple[float, float], valve: StemLaw, ar: Floats) -> Fitted:
    """A start of a fit of the batch run, without slow terms.

    gain [% PV/% OP]; dynamics : time constant and dead time [s], the latter counted from the first row of a block; ar
    : noise model of single lags, shape (p,).
    """
    start = Fitted(p, Model((), neutral()), math.inf, 1, ar, slow=np.zeros(4))
    return start.moved(gain=gain, time_constant_s=dynamics[0], dead_time_s=dynamics[1], valve=valve)


def gain(better: Fitted, worse: Fitted) -> float:
    """Gain in log likelihood [nat]."""
    return nats(better.count, worse.loss, better.loss)
