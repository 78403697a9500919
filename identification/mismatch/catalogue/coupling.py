"""Another loop of the export that moves this one, through a gain and a lag."""

from __future__ import annotations

from identification.mismatch.curves.course import course, load_over_time, over_record
from identification.mismatch.curves.drawn import Axis, Drawing, Shape
from identification.mismatch.effect import Block, Effect
from identification.simulation.effect import Param, Variant
from identification.simulation.parameters import Slot


def load_of_neighbour(d: Drawing) -> Shape:
    """What the neighbour brings in."""
    at = over_record(d.inputs)
    return course(d, at, load_over_time(d, at), Axis("load at the inlet", "% OP"))


EFFECT = Effect(
    name="coupling",
    block=Block.LOAD,
    sentence="Another loop of the export moves this one (gain {coupling_gain}).",
    check="Look at the other loop first; feed its OP forward if it has to move.",
    needs="neighbour",
    curve=load_of_neighbour,
    variants=(
        Variant(
            (
                Param(Slot.NEIGHBOUR, "coupling_gain", "% OP per % OP", -20.0, 20.0, title="Coupling gain"),
                Param(Slot.NEIGHBOUR_T, "coupling_lag_s", "s", 0.02, 20.0, "T", True, title="Coupling lag"),
            ),
            tuple({Slot.NEIGHBOUR: 0.0, Slot.NEIGHBOUR_T: lag} for lag in (0.3, 2.0)),
        ),
    ),
)
