"""A controller that stands still while the error is small."""

from __future__ import annotations

from identification.controller.check import ControllerFault
from identification.mismatch.curves.controller import gap_profile
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.effect import Block, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats

SURE = 0.2
"""Half width of the interval, in the gap found; ours."""


def numbers(found: Finding, _: Recording) -> dict[str, Estimate]:
    """Half width of the gap [% PV]."""
    value = found.values["gap_pct"]
    return {"gap_pct": exact(value, "% PV", SURE * value)}


def drawn(found: Finding, s: Recording, _: Floats) -> Shape | None:
    """How often OP stands still, over the size of the error."""
    if s.sp is None:
        return None
    return gap_profile(found.name, s.sp - s.pv, s.op, found.values["gap_pct"], s.usable)


EFFECT = Fault(
    name="controller-gap",
    block=Block.CONTROLLER,
    sentence="The controller stands still while the error is under {gap_pct}.",
    check="Look for a dead band or gap action in the controller's configuration.",
    caption="A plain controller moves OP at every error; under the gap it stands still.",
    finds=ControllerFault.GAP,
    numbers=numbers,
    drawn=drawn,
    titles={"gap_pct": "Gap"},
)
