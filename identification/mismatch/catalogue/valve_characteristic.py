"""A trim whose gain varies over the stroke: local gain exp(curve (z - middle)/100)."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant, each
from identification.mismatch.pictures import flow_over_op

CURVE = Param(Slot.BEND, "curve", "ln gain per 100 % OP", -6.0, 6.0, "1/op", title="Curve")

EFFECT = Effect(
    name="valve-characteristic",
    block=Block.VALVE,
    sentence="The valve's gain changes along its stroke (curve {curve}).",
    check="Linearize the signal in the controller or positioner, or tune for the steepest part.",
    tests={
        "nonlinear-gain": (
            "The same PV at another OP: move the load, or another stream, and step OP again at the same PV."
        ),
        "saturation": "Steps of OP near the end of the stroke: saturation gives no response, a curve some.",
        "split-range": "Steps on both sides of the suspected point: only a second valve changes the lag.",
        "gain-drift": "Go back to the OP of the start and step again: drift keeps the new gain, OP restores it.",
    },
    indistinguishable=("nonlinear-gain",),
    curve=flow_over_op,
    variants=(Variant((CURVE,), each(Slot.BEND, -0.3, 0.3)),),
)
