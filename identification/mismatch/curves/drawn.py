"""What was found, as arrays to draw: the loop, curve, response or course that the plain loop lacks.

Each picture is a function of the model's parameters; its band is that function at the ends of their intervals, one
parameter at a time, the deviations added as squares.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from identification.models import Estimate
from identification.record import Floats
from identification.simulation.effect import Variant
from identification.simulation.open_loop import ModelInputs

POINTS = 241
"""Points of a static curve."""

Read = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class Drawn:
    """One curve: its name, shape (m,) each; low and high bound it where an interval is known."""

    name: str
    x: Floats
    y: Floats
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True, slots=True)
class Axis:
    """What an axis counts and in which unit."""

    what: str
    unit: str


@dataclass(frozen=True, slots=True)
class Shape:
    """What was found, drawn: its kind, both axes, curves (the found one first), places on the horizontal axis.

    kind : loop (the band is two more loops, least and most), curve, response or course.
    """

    effect: str
    kind: str
    x: Axis
    y: Axis
    curves: tuple[Drawn, ...] = field(repr=False)
    places: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Drawing:
    """What a picture is drawn from.

    inputs : what drove the model; variant : what was added; known : its parameters with intervals, by their answered
    names; best, plain : parameters of the improved and of the plain model, shape (SIZE,) each.
    """

    inputs: ModelInputs
    variant: Variant
    known: Mapping[str, Estimate]
    best: Floats = field(repr=False)
    plain: Floats = field(repr=False)

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.variant.name

    @property
    def ends(self) -> tuple[tuple[int, float, float], ...]:
        """Place, low and high end of each parameter whose interval is known."""
        found = ((int(p.slot), self.known.get(p.name)) for p in self.variant.params)
        return tuple((slot, e.low, e.high) for slot, e in found if e is not None)


def banded(read: Read, d: Drawing) -> tuple[Floats, Floats, Floats]:
    """A picture at the best parameters with its least and greatest value, shape (m,) each.

    Parameters
    ----------
    read : callable
        The picture of parameters, shape (m,).
    d : Drawing
    """
    here = read(d.best)
    below, above = np.zeros_like(here), np.zeros_like(here)
    for slot, *both in d.ends:
        moves = np.zeros((3, here.size))
        for i, value in enumerate(both):
            other = d.best.copy()
            other[slot] = value
            moves[i] = read(other) - here
        below += moves.min(axis=0) ** 2
        above += moves.max(axis=0) ** 2
    return here, here - np.sqrt(below), here + np.sqrt(above)


def op_range(inputs: ModelInputs) -> Floats:
    """OP from its least to its greatest value, shape (POINTS,)."""
    return np.linspace(float(inputs.op.min()), float(inputs.op.max()), POINTS)


def step(size: float, n: int, dt_s: float, back: bool = False) -> tuple[Floats, Floats]:
    """Time [s] and a step (and, if wanted, the step back), shape (m,)."""
    time = dt_s * np.arange(-n // 10, (2 if back else 1) * n, dtype=np.float64)
    on = (time >= 0) & (time < n * dt_s) if back else time >= 0
    return time, np.where(on, size, 0.0)
