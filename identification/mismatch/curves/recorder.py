"""Pictures of what the recorder did: values on their grid, straight lines, spacings of stamps, a range's end."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import Axis, Drawn, Shape
from identification.mismatch.curves.stretches import WINDOW, around, busiest
from identification.record import Floats, Mask

HISTOGRAM = 160
"""Classes of a histogram."""
STEPS_SHOWN = 24
"""Steps of a coarse sensor that are drawn."""


def grid(name: str, pv: Floats, step: float) -> Shape:
    """How often each value of PV occurs within some steps of a coarse sensor."""
    middle = float(np.median(pv))
    near = pv[np.abs(pv - middle) <= 0.5 * STEPS_SHOWN * step]
    levels, count = np.unique(near, return_counts=True)
    x = np.repeat(levels, 3)
    y = (np.stack([np.zeros(levels.size), count, np.zeros(levels.size)], axis=1)).ravel().astype(float)
    return Shape(name, "comb", Axis("PV", "%"), Axis("samples", ""), (Drawn("recorded", x, y),))


def straightened(name: str, pv: Floats, where: Mask, dt_s: float) -> Shape:
    """A stretch of a compressed trend, with the samples that lie on straight lines."""
    part = busiest(pv, WINDOW)
    time, x, marked = np.arange(part.start, part.stop) * dt_s, pv[part], where[part]
    curves = (Drawn("points", time[marked], x[marked]), Drawn("recorded", time, x))
    return Shape(name, "course", Axis("time", "s"), Axis("PV", "%"), curves)


def spacings(name: str, stamp_s: Floats, dt_s: float) -> Shape:
    """How often each spacing of two stamps occurs."""
    spacing = np.diff(stamp_s)
    near = spacing[(spacing > 0) & (spacing < 2 * dt_s)]
    count, edge = np.histogram(near, HISTOGRAM)
    x = np.repeat(0.5 * (edge[1:] + edge[:-1]), 3)
    y = np.stack([np.zeros(count.size), count, np.zeros(count.size)], axis=1).ravel().astype(float)
    return Shape(
        name, "comb", Axis("time between samples", "s"), Axis("samples", ""), (Drawn("recorded", x, y),)
    )


def clip(name: str, pv: Floats, at: float, dt_s: float, where: Mask, model: Floats) -> Shape:
    """The stretch in which PV stands at its end longest, with the model that goes on."""
    part = around(where, WINDOW)
    time = np.arange(part.start, part.stop) * dt_s
    free = model[part]
    curves = (
        Drawn("found", time, free),
        Drawn("recorded", time, pv[part]),
        Drawn("limit", time, np.full(time.size, at)),
    )
    return Shape(name, "course", Axis("time", "s"), Axis("PV", "%"), curves)
