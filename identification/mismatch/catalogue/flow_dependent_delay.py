"""A dead time that shrinks when the flow grows: transport through a pipe."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import POINTS, Axis, Drawing, Drawn, Shape, banded, op_range
from identification.mismatch.effect import Block, Effect
from identification.record import Floats
from identification.simulation.effect import Param, Variant, each
from identification.simulation.parameters import Slot


def delay_over_flow(d: Drawing) -> Shape:
    """Dead time over flow (OP), at a flow that stays."""
    op = op_range(d.inputs)
    about = max(d.inputs.middle, 1e-3)

    def read(c: Floats) -> Floats:
        return np.asarray(c[Slot.L] / np.maximum(1.0 + c[Slot.PIPE] * (op / about - 1.0), 0.1))

    y, low, high = banded(read, d)
    plain = np.full(POINTS, float(d.plain[Slot.L]))
    curves = (Drawn("found", op, y, low, high), Drawn("plain", op, plain))
    return Shape(d.name, "curve", Axis("OP (flow)", "%"), Axis("dead time", "s"), curves)


EFFECT = Effect(
    name="flow-dependent-delay",
    block=Block.PROCESS,
    sentence="The dead time shrinks when the flow grows (share {flow_share}).",
    check="Schedule on flow, or tune at the least flow.",
    tests={
        "clock-offset": "Steps at two flows: an offset of clocks is the same at both.",
    },
    curve=delay_over_flow,
    variants=(
        Variant(
            (Param(Slot.PIPE, "flow_share", "", -0.5, 3.0, title="Share of delay in flow"),),
            each(Slot.PIPE, 0.3, 1.0),
        ),
    ),
)
