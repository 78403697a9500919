"""A controller that stands still while the error is small."""

from identification.mismatch.effect import Block, Fault, Number
from identification.mismatch.fault_pictures import gap_profile

EFFECT = Fault(
    name="controller-gap",
    block=Block.CONTROLLER,
    sentence="The controller stands still while the error is under {gap_pct}.",
    check="Look for a dead band or gap action in the controller's configuration.",
    caption="A plain controller moves OP at every error; under the gap it stands still.",
    numbers=(Number("gap_pct", "% PV", "Gap", share=0.2),),
    drawn=gap_profile,
)
