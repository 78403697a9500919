"""A dead time that decreases with increasing flow: transport through a pipe."""

import numpy as np

from identification.mismatch.effect import Block, Effect, Floats, Param, Slot, Variant, each
from identification.mismatch.pictures import Axis, Drawing, Picture, op_range, with_baseline

SHARE = Param(Slot.PIPE, "flow_share", "", -0.5, 3.0, title="Share of delay in flow")


def delay_over_flow(d: Drawing) -> Picture:
    """Dead time over flow (OP), at constant flow."""
    op, about = op_range(d.inputs), max(d.inputs.middle, 1e-3)

    def read(c: Floats) -> Floats:
        return np.asarray(c[Slot.L] / np.maximum(1.0 + c[Slot.PIPE] * (op / about - 1.0), 0.1))

    axes = Axis("OP (flow)", "%"), Axis("dead time", "s")
    return with_baseline(d, "curve", axes, op, read, float(d.plain[Slot.L]))


EFFECT = Effect(
    name="flow-dependent-delay",
    block=Block.PROCESS,
    sentence="The dead time decreases when the flow increases (share {flow_share}).",
    check="Schedule the settings on flow, or tune the loop at the smallest flow.",
    tests={"clock-offset": "Steps at two flows: an offset of clocks is the same at both."},
    curve=delay_over_flow,
    variants=(Variant((SHARE,), each(Slot.PIPE, 0.3, 1.0)),),
)
