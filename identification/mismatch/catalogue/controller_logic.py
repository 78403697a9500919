"""Something beside the control law moves OP or holds it: tracking, overrides, a hand."""

from __future__ import annotations

from identification.controller.check import ControllerFault
from identification.mismatch.curves.controller import by_stated_law
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.effect import Block, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats

SURE = 0.1
"""Half width of the interval, in the share found; ours."""


def numbers(found: Finding, _: Recording) -> dict[str, Estimate]:
    """Share of the time outside the law [%]."""
    value = 100.0 * found.values["share"]
    return {"share_pct": exact(value, "%", SURE * value)}


def drawn(found: Finding, s: Recording, _: Floats) -> Shape | None:
    """OP about the longest stretch outside the law, and as the stated settings would have moved it."""
    return by_stated_law(found.name, s, found.where)


EFFECT = Fault(
    name="controller-logic",
    block=Block.CONTROLLER,
    sentence=("For {share_pct} of the time something other than the controller's law moved or held OP."),
    check="Look for tracking, overrides, limits or an operator's hand in those spans.",
    caption="OP recorded, and OP as the stated settings would have moved it from there.",
    finds=ControllerFault.LOGIC,
    numbers=numbers,
    drawn=drawn,
    titles={"share_pct": "Time outside the law"},
)
