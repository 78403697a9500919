"""Pictures of a valve: stem over OP, flow over OP, and the stem after a step."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import (
    POINTS,
    Axis,
    Drawing,
    Drawn,
    Shape,
    banded,
    op_range,
    step,
)
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs
from identification.simulation.parameters import Slot, neutral
from identification.simulation.valve_chain import flow

SWEEP = 2.5
"""Half height of the sweep that draws a valve's loop, in widths of its stickband; ours: both flanks show."""
STEP_PCT, MOST_STEP_PCT = 10.0, 50.0
"""Size of the step whose response is drawn, half of OP's range where that is more, and at most [% OP]."""
LENGTH = 1.6
"""Length of a response, in the time that the stem takes; at least so many samples as LEAST."""
LEAST = 4


FRICTION = (Slot.STICKBAND, Slot.JUMP, Slot.COAST)
AT_REST = (Slot.STOP_LO, Slot.STOP_HI, Slot.SPLIT, Slot.RATIO, Slot.SPLIT_DEAD, Slot.BEND)
"""Parameters of the valve's friction, and of its flow once everything has come to rest."""


def alone(c: Floats, op: Floats, keep: tuple[int, ...], middle: float = 50.0, dt_s: float = 1.0) -> Floats:
    """Flow [% OP], shape (m,), of a valve with some of a model's parameters alone."""
    own = neutral()
    for slot in keep:
        own[slot] = c[slot]
    return flow(op, own, dt_s, middle)


def sweep(inputs: ModelInputs, width: float) -> Floats:
    """OP up and down twice about its middle, far enough to open a loop of that width, shape (m,)."""
    reach = SWEEP * max(width, 1e-3)
    one = np.concatenate((np.linspace(-1, 1, POINTS), np.linspace(1, -1, POINTS)))
    return inputs.middle + reach * np.concatenate((one, one))


def stem_over_op(d: Drawing) -> Shape:
    """Stem over OP of a valve with play or stick-slip, with the loops of the narrowest and the widest band."""
    op = sweep(d.inputs, float(d.best[Slot.STICKBAND]))
    last = slice(2 * POINTS, None)
    curves = [Drawn("found", op[last], alone(d.best, op, FRICTION)[last])]
    for name, i in (("least", 1), ("most", 2)):
        other = d.best.copy()
        for place in d.ends:
            other[place[0]] = place[i]
        other[Slot.JUMP] = min(other[Slot.JUMP], other[Slot.STICKBAND])
        curves.append(Drawn(name, op[last], alone(other, op, FRICTION)[last]))
    curves.append(Drawn("plain", op[last], op[last]))
    return Shape(d.name, "loop", Axis("OP", "%"), Axis("stem", "% OP"), tuple(curves))


def flow_over_op(d: Drawing) -> Shape:
    """Flow over OP at rest: characteristic, stop or second valve."""
    op, c = op_range(d.inputs), d.best

    def read(k: Floats) -> Floats:
        return alone(k, op, AT_REST, d.inputs.middle)

    y, low, high = banded(read, d)
    places = tuple(float(c[s]) for s in (Slot.STOP_LO, Slot.STOP_HI, Slot.SPLIT) if np.isfinite(c[s]))
    curves = (Drawn("found", op, y, low, high), Drawn("plain", op, op))
    return Shape(d.name, "curve", Axis("OP", "%"), Axis("flow", "% OP"), curves, places)


def step_size(d: Drawing) -> float:
    """Size of the step whose response is drawn [% OP]."""
    return min(max(STEP_PCT, 0.5 * float(np.ptp(d.inputs.op))), MOST_STEP_PCT)


def stem_response(d: Drawing, length_s: float, keep: tuple[int, ...]) -> Shape:
    """Stem after a step of OP.

    Parameters
    ----------
    d : Drawing
    length_s : float
        Time that the stem takes, about [s].
    keep : tuple of int
        The parameters that are at work.
    """
    fine = max(length_s * LENGTH, LEAST * d.inputs.dt_s) / POINTS
    time, op = step(step_size(d), POINTS, fine)
    y, low, high = banded(lambda c: alone(c, op, keep, dt_s=fine), d)
    curves = (Drawn("found", time, y, low, high), Drawn("plain", time, op))
    return Shape(d.name, "response", Axis("time", "s"), Axis("stem", "% OP"), curves)
