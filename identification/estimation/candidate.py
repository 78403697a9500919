"""What is fitted to a recording: the recording prepared, a plain loop with what is added to it, and the outcome."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from identification.estimation.descent import nats
from identification.estimation.noise import Edges, edges_for, judged
from identification.limits import LIMITS, ExplainLimits
from identification.record import Floats, Mask
from identification.signals.correlation import correlated
from identification.simulation.effect import Param, Variant
from identification.simulation.open_loop import ModelInputs
from identification.simulation.parameters import Slot

BASE = (
    Param(Slot.T, "time_constant_s", "s", 0.3, 1e9, "dt", True),
    Param(Slot.L, "dead_time_s", "s", 0.0, 0.2, "span"),
    Param(Slot.K, "gain", "% PV/% OP", -1e4, 1e4),
    Param(Slot.BIAS, "bias_pct", "% PV", -2e3, 2e3),
    Param(Slot.START, "start_pct", "% PV", -300.0, 300.0),
)
"""Constants of the plain loop, free in every candidate."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A recording prepared for fitting.

    inputs : what drives the model; y : PV less inputs.level, shape (n,); usable : bool, shape (n,); weight : shape
    (n,), what each innovation counts, 0 where it is not judged. limits : what decides about candidates; memory :
    in an experiment, samples that tell as much as an independent one, at most; window : samples after which a
    simulation that is judged by its own errors begins anew (without_lines), 0 for one run over all.
    """

    inputs: ModelInputs
    y: Floats
    usable: Mask
    weight: Floats
    edges: Edges = field(repr=False)
    limits: ExplainLimits = LIMITS
    memory: float = math.inf
    window: int = 0

    @property
    def count(self) -> int:
        """Samples judged."""
        return int((self.weight > 0).sum())

    @property
    def by_simulation(self) -> bool:
        """Whether errors of the simulation are judged, with no noise model between."""
        return self.edges.size == 1

    def independent(self, e: Floats) -> int:
        """Samples judged of which each tells something by itself, of a model that leaves errors of shape (n,)."""
        memory = min(self.memory, correlated(e[self.weight > 0])) if self.by_simulation else 1.0
        return max(int(self.count / memory), 1)


def problem(
    inputs: ModelInputs,
    y: Floats,
    usable: Mask,
    limits: ExplainLimits = LIMITS,
    edges: Edges | None = None,
) -> Problem:
    """A problem whose usable samples all count alike, with lag groups of its own where none are given."""
    edges = edges_for(usable) if edges is None else edges
    return Problem(inputs, y, usable, judged(usable, int(edges[-1])).astype(float), edges, limits)


@dataclass(frozen=True, slots=True)
class Model:
    """What is added to the plain loop, and all constants, shape (SIZE,)."""

    added: tuple[Variant, ...]
    c: Floats

    @property
    def params(self) -> tuple[Param, ...]:
        """What is free: the plain loop's constants that nothing replaces, and those of what is added."""
        own = tuple(p for v in self.added for p in v.params)
        replaced = {slot for v in self.added for slot in v.replaces}
        return (*(p for p in BASE if p.slot not in replaced), *own)


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model at its optimum: `loss` the weighted mean square innovation, `ar` the noise model; count : innovations
    that tell something each by itself."""

    model: Model
    loss: float
    count: int
    ar: Floats
    e: Floats = field(repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is added."""
        return tuple(v.name for v in self.model.added)


def gain(better: Fitted, worse: Fitted) -> float:
    """Gain in log likelihood [nat]."""
    return nats(better.count, worse.loss, better.loss)


def scales(inputs: ModelInputs, c: Floats, param: Param) -> tuple[float, float]:
    """Offset and factor that turn a row's numbers into the constant's own unit."""
    op = inputs.op
    reach = max(float(np.ptp(op)), 1e-6)
    match param.scale:
        case "op":
            return 0.0, reach
        case "op/dt":
            return 0.0, reach / inputs.dt_s
        case "opspan":
            return float(op.min()), reach
        case "1/op":
            return 0.0, 100.0 / reach
        case "1/pv":
            return 0.0, 50.0 / max(inputs.pv_range[1] - inputs.pv_range[0], 1e-6)
        case "pvspan":
            return inputs.pv_range[0], inputs.pv_range[1] - inputs.pv_range[0]
        case "T":
            return 0.0, float(c[Slot.T])
        case "dt":
            return 0.0, inputs.dt_s
        case "span":
            return 0.0, inputs.dt_s * op.size
    return 0.0, 1.0


def bounds(inputs: ModelInputs, c: Floats, param: Param) -> tuple[float, float]:
    """Lowest and highest value of a constant, in its own unit."""
    if param.slot == Slot.T:
        longest = 2.0 * inputs.dt_s * inputs.op.size
        return 0.3 * inputs.dt_s, longest if c[Slot.LEAK] == 0 else min(longest, inputs.longest_s)
    offset, factor = scales(inputs, c, param)
    return offset + factor * param.low, offset + factor * param.high
