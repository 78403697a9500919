"""Where to start two-mode processes: dead time and time constants on a grid, both gains solved linearly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from identification.estimation.candidate import Fitted, Model, Problem
from identification.estimation.noise import whitened
from identification.record import Floats
from identification.simulation.effect import Variant
from identification.simulation.open_loop import through_valve
from identification.simulation.parameters import Slot
from identification.simulation.vessel import plain_vessel

DELAYS = 40
"""Dead times tried at most, from none to that of the plain loop, which a missing lag or zero has lengthened; a mode
that answers at once is found to the sample alone."""
LONGER = (0.7, 1.0, 1.4, 2.0)
"""Time constants tried, in that of the plain loop."""
LEADING = 0.95
"""First coefficient of the noise model that knows nothing: nearly a difference."""
KEPT = 2
"""Starts kept under each noise model."""


@dataclass(frozen=True, slots=True)
class Point:
    """One point of the grid: dead time, the two time constants [s], both gains, what is left."""

    dead_s: float
    first_s: float
    other_s: float
    gains: tuple[float, float]
    left: float


def responses(p: Problem, near: Fitted, times: set[float], ar: Floats) -> dict[float, Floats]:
    """Whitened unit responses without dead time, each shape (n,), of lags with these time constants [s]."""
    inputs, c = p.inputs, near.model.c.copy()
    through = through_valve(inputs, c)
    still = np.zeros(inputs.op.size)
    c[Slot.K], c[Slot.BIAS], c[Slot.START], c[Slot.L] = 1.0, 0.0, 0.0, 0.0
    out = {}
    for t in times:
        c[Slot.T] = max(t, 0.1 * inputs.dt_s)
        out[t] = whitened(plain_vessel(through, still, c, inputs.dt_s, inputs.middle), ar, p.edges)
    return out


def later(x: Floats, samples: int) -> Floats:
    """x, shape (n,), so many samples later, still before."""
    return np.concatenate((np.full(samples, x[0]), x[: x.size - samples]))


def solved(
    y: Floats, one: Floats, two: Floats, level: Floats, weight: Floats
) -> tuple[tuple[float, float], float]:
    """Both gains and what is left, of whitened PV on two responses and a level."""
    rows = np.stack([one, two, level])
    weighted = rows * weight
    beta = np.linalg.lstsq(weighted @ rows.T, weighted @ y, rcond=1e-12)[0]
    return (float(beta[0]), float(beta[1])), float((weight * y) @ y - beta @ (weighted @ y))


def grid(p: Problem, near: Fitted, row: Variant, ar: Floats) -> list[Point]:
    """All points of the grid under one noise model, best first."""
    t0, dead0 = float(near.model.c[Slot.T]), float(near.model.c[Slot.L])
    y, level = whitened(p.y, ar, p.edges), whitened(np.ones(p.y.size), ar, p.edges)
    firsts, others = [t0 * f for f in LONGER], [t0 * f for f in row.modes]
    found = responses(p, near, {*firsts, *others}, ar)
    longest = min(math.ceil(dead0 / p.inputs.dt_s), p.y.size - 1)
    out = []
    for samples in range(0, longest + 1, longest // DELAYS + 1):
        moved = {t: later(x, samples) for t, x in found.items()}
        for first in firsts:
            for other in others:
                gains, left = solved(y, moved[first], moved[other], level, p.weight)
                out.append(Point(samples * p.inputs.dt_s, first, other, gains, left))
    return sorted(out, key=lambda point: point.left)


def fits_row(point: Point, row: Variant) -> bool:
    """Whether a point's second mode has the sign that the row is about."""
    a, b = point.gains
    if a + b == 0:
        return False
    return row.mode_share[0] < b / (a + b) < row.mode_share[1]


def mode_starts(p: Problem, near: Fitted, row: Variant) -> list[Model]:
    """Starts of a two-mode row from the grid."""
    blind = np.zeros_like(near.ar)
    blind[:1] = LEADING
    out = []
    for ar in (near.ar, blind) if near.ar.size else (near.ar,):
        for point in [q for q in grid(p, near, row, ar) if fits_row(q, row)][:KEPT]:
            c = near.model.c.copy()
            c[Slot.T], c[Slot.L], c[Slot.MODE_T] = (
                point.first_s,
                point.dead_s,
                max(point.other_s, 0.1 * p.inputs.dt_s),
            )
            c[Slot.K] = sum(point.gains)
            c[Slot.SHARE] = point.gains[1] / c[Slot.K]
            out.append(Model((*near.model.added, row), c))
    return out
