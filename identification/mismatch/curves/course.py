"""Pictures over the recording: a load, a supply, or a gain as it drifts."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import Axis, Drawing, Drawn, Read, Shape, banded
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs, load

COURSE_POINTS = 600
"""Points of a course over time."""


def over_record(inputs: ModelInputs) -> np.ndarray:
    """Samples spread over the recording at which a course is drawn, shape (m,)."""
    n = inputs.op.size
    return np.unique(np.linspace(0, n - 1, min(COURSE_POINTS, n)).astype(int))


def load_over_time(d: Drawing, at: np.ndarray) -> Read:
    """The load at the inlet [% OP] at some samples, as a function of the parameters."""

    def read(c: Floats) -> Floats:
        return np.asarray(load(d.inputs, c)[at])

    return read


def course(
    d: Drawing, at: np.ndarray, read: Read, axis: Axis, rest: float = 0.0, places: tuple[float, ...] = ()
) -> Shape:
    """What acts over the recording.

    Parameters
    ----------
    d : Drawing
    at : ndarray of int, shape (m,)
        Samples that are drawn.
    read : callable
        What acts there, shape (m,), of the parameters.
    axis : Axis
        What that is.
    rest : float
        What the plain loop has in its place.
    places : tuple of float
        Times that are marked [s].
    """
    time = at * d.inputs.dt_s
    y, low, high = banded(read, d)
    curves = (Drawn("found", time, y, low, high), Drawn("plain", time, np.full(at.size, rest)))
    return Shape(d.name, "course", Axis("time", "s"), axis, curves, places)
