"""A process gain that depends on PV, by its outflow or its inflow, with or without a change of speed."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant, each
from identification.mismatch.pictures import gain_over_pv

BY_OUTFLOW, BY_INFLOW = (
    Param(slot, "gain_slope", "per 50 % PV", -1.9, 1.9, "1/pv", title="Gain slope")
    for slot in (Slot.SLOPE, Slot.GAIN_SLOPE)
)

EFFECT = Effect(
    name="nonlinear-gain",
    block=Block.PROCESS,
    sentence="The process gain changes with PV (by {gain_slope}).",
    check="Schedule the controller's gain on PV, or tune for where the gain is highest.",
    tests={
        "gain-drift": "Go back to the PV of the start and step again: drift keeps the new gain, PV restores it.",
        "sqrt-outflow": "Vary the inflow at one level: the root follows the level, geometry the place.",
        "direction-asymmetry": "Steps up and down over the same span of PV.",
        "flow-dependent-delay": "Steps at two flows at the same PV: the dead time or the gain changes.",
    },
    indistinguishable=("valve-characteristic",),
    curve=gain_over_pv,
    variants=(
        Variant((BY_OUTFLOW,), each(Slot.SLOPE, -0.15, 0.15)),
        *(
            Variant((BY_INFLOW,), each(Slot.GAIN_SLOPE, -0.15, 0.15), {Slot.SPEED: speed}, label=label)
            for speed, label in ((0.0, "gain alone"), (-1.0, "faster with gain"))
        ),
    ),
)
