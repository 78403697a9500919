"""Something beside the control law moves OP or holds it: tracking, overrides, a hand."""

from identification.mismatch.effect import Block, Fault, Number
from identification.mismatch.pictures import by_stated_law

EFFECT = Fault(
    name="controller-logic",
    block=Block.CONTROLLER,
    sentence="For {share_pct} of the time something other than the controller's law moved or held OP.",
    check="Look for tracking, overrides, limits or an operator's hand in those spans.",
    caption="OP recorded, and OP as the stated settings would have moved it from there.",
    numbers=(Number("share_pct", "%", "Time outside the law", "share", 100.0, share=0.1),),
    drawn=lambda found, s, _: by_stated_law(s, found.where),
)
