"""A vessel whose outflow is proportional to the square root of its level."""

from identification.mismatch.effect import TIE, Block, Effect, Param, Slot, Variant, each
from identification.mismatch.pictures import gain_over_pv

EFFECT = Effect(
    name="sqrt-outflow",
    block=Block.PROCESS,
    sentence="The outflow grows with the root of the level, so gain and lag grow with it.",
    check="Tune at the low level, where the vessel responds fastest for its gain.",
    indistinguishable=("nonlinear-gain",),
    types=("level",),
    curve=gain_over_pv,
    variants=(
        Variant(
            (Param(Slot.ROOT, "root", "", 0.05, 3.0, title="Root"),),
            each(Slot.ROOT, 0.3, 1.0),
            penalty=-TIE,
        ),
    ),
)
