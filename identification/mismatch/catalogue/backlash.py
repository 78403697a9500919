"""Backlash: after each OP reversal the stem does not move until the backlash is taken up."""

from identification.mismatch.effect import Block, Effect, Friction, Param, Slot, Variant, each
from identification.mismatch.pictures import stem_over_op

WIDTH = Param(Slot.STICKBAND, "backlash_pct", "% OP", 1e-4, 2.0, "op", True, title="Backlash, full width")

EFFECT = Effect(
    name="backlash",
    block=Block.VALVE,
    sentence="After an OP reversal the stem does not move within a backlash of {backlash_pct}: check the linkage.",
    check="Look at linkage, actuator and positioner feedback; stroke the valve both ways in small steps.",
    tests={
        "stiction": (
            "A slow ramp of OP in manual, then back: after the reversal PV starts gently with backlash, "
            "in jumps with stiction."
        ),
        "positioner": (
            "A slow ramp of OP and back, with the stem recorded: a dead band acts at every stop, "
            "backlash after reversals."
        ),
        "second-lag": (
            "Two steps of OP in the same direction: backlash delays only the first after a reversal, a lag"
            " delays both."
        ),
        "direction-asymmetry": "Two more moves in one direction: the first takes up the backlash.",
        "controller-gap": "Check whether OP itself is constant: then the controller is the cause.",
    },
    friction=Friction.BACKLASH,
    curve=stem_over_op,
    variants=(Variant((WIDTH,), each(Slot.STICKBAND, 0.01, 0.03, 0.08, 0.2, 0.5), {Slot.JUMP: 0.0}),),
)
