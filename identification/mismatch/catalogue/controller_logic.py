"""Something other than the control law moves or holds OP: tracking, overrides, an operator."""

from identification.mismatch.effect import Block, Fault, within
from identification.mismatch.pictures import by_stated_law

EFFECT = Fault(
    name="controller-logic",
    block=Block.CONTROLLER,
    sentence="For {share_pct} of the time something other than the controller's law moved or held OP.",
    check="Look for tracking, overrides, limits or an operator's hand in those spans.",
    caption="OP recorded, and OP as the stated settings would have moved it from there.",
    numbers=lambda found, _: {"share_pct": within(0.1, 100.0 * found.values["share"], "%")},
    titles={"share_pct": "Time outside the law"},
    drawn=lambda found, s, _: by_stated_law(s, found.where),
)
