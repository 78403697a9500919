"""Backlash: after each OP reversal the stem does not move until the backlash is taken up."""

from identification.mismatch.effect import Block, Effect, Friction, Param, Slot, Variant, each
from identification.mismatch.pictures import stem_over_op

PLAY = Param(Slot.STICKBAND, "backlash_pct", "% OP", 1e-4, 2.0, "op", True, title="Play, full width")

EFFECT = Effect(
    name="backlash",
    block=Block.VALVE,
    sentence="After each turn of OP the valve waits through a play of {backlash_pct}: check the linkage.",
    check="Look at linkage, actuator and positioner feedback; stroke the valve both ways in small steps.",
    tests={
        "stiction": (
            "A slow ramp of OP in manual, then back: after the turn play lets PV go gently, stiction in jumps."
        ),
        "positioner": (
            "A slow ramp of OP and back, with the stem recorded: a dead band holds at every stop, "
            "play after turns."
        ),
        "second-lag": (
            "Two steps of OP in the same direction: play holds up the first after a turn alone, a lag"
            " holds up both."
        ),
        "direction-asymmetry": "Two moves on in one direction: play is taken up by the first.",
        "controller-gap": "Whether OP itself stands still: then it is the controller and not the valve.",
    },
    friction=Friction.PLAY,
    curve=stem_over_op,
    variants=(Variant((PLAY,), each(Slot.STICKBAND, 0.01, 0.03, 0.08, 0.2, 0.5), {Slot.JUMP: 0.0}),),
)
