"""Another loop of the export that acts on this one through a gain and a lag."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant
from identification.mismatch.pictures import load_over_time

GAIN = Param(Slot.NEIGHBOUR, "coupling_gain", "% OP per % OP", -20.0, 20.0, title="Coupling gain")
LAG = Param(Slot.NEIGHBOUR_T, "coupling_lag_s", "s", 0.02, 20.0, "T", True, title="Coupling lag")

EFFECT = Effect(
    name="coupling",
    block=Block.LOAD,
    sentence="Another loop of the export moves this one (gain {coupling_gain}).",
    check="Look at the other loop first; feed its OP forward if it has to move.",
    needs="neighbour",
    curve=load_over_time,
    variants=(
        Variant((GAIN, LAG), tuple({Slot.NEIGHBOUR: 0.0, Slot.NEIGHBOUR_T: lag} for lag in (0.3, 2.0))),
    ),
)
