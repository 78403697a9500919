"""A historian that keeps few points and draws straight lines between them."""

from __future__ import annotations

from identification.mismatch import recording_faults
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.curves.recorder import straightened
from identification.mismatch.effect import Block, Ends, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats


def find(s: Recording) -> Finding | None:
    """Straight segments whose breaks stand on no grid."""
    return recording_faults.compression(s.pv, s.limits.recorder)


def numbers(found: Finding, _: Recording) -> dict[str, Estimate]:
    """Share of the samples that lie on straight lines."""
    return {"straight_share": exact(found.values["straight_share"], "")}


def drawn(found: Finding, s: Recording, _: Floats) -> Shape:
    """The busiest stretch, with the samples that lie on straight lines."""
    return straightened(found.name, s.pv, found.where, s.dt_s)


EFFECT = Fault(
    name="compression",
    block=Block.RECORDER,
    sentence=("The historian compressed the trends to straight lines; nothing can be judged on them."),
    check="Switch compression and exception off for PV, SP and OP, then ask again.",
    caption=("Straight segments between few stored points: what happened between them is not known."),
    order=0,
    find=find,
    ends=Ends.ALL,
    numbers=numbers,
    drawn=drawn,
    titles={"straight_share": "Samples on straight lines"},
)
