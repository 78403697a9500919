"""A share of what leaves comes back to the inlet after several time constants: a white-water or solvent circuit."""

from __future__ import annotations

from identification.mismatch.curves.course import course, load_over_time, over_record
from identification.mismatch.curves.drawn import Axis, Drawing, Shape
from identification.mismatch.effect import Block, Effect
from identification.simulation.effect import Param, Variant
from identification.simulation.parameters import Slot

WAYS = tuple(0.8 * 1.12**i for i in range(25))
"""How long the way back is, where the search begins, in time constants; ours: what comes back is as wide as one."""


def load_returned(d: Drawing) -> Shape:
    """What comes back, over the recording."""
    at = over_record(d.inputs)
    return course(d, at, load_over_time(d, at), Axis("what comes back", "% OP"))


EFFECT = Effect(
    name="recycle",
    block=Block.PROCESS,
    sentence="{returned} of what leaves comes back to the inlet after {returns_s}",
    check="Look for a circuit that brings material or heat back: white water, solvent, condensate, a recirculation.",
    curve=load_returned,
    variants=(
        Variant(
            (
                Param(Slot.RETURNED, "returned", "", -2.0, 2.0, title="Share that comes back"),
                Param(Slot.RETURNS_S, "returns_s", "s", 0.5, 20.0, "T", True, title="Way back"),
            ),
            tuple({Slot.RETURNS_S: way} for way in WAYS),
            linear=Slot.RETURNED,
        ),
    ),
)
