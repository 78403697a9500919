"""A transmitter or its card that knows few values."""

from __future__ import annotations

from identification.mismatch import recording_faults
from identification.mismatch.curves.drawn import Shape
from identification.mismatch.curves.recorder import grid
from identification.mismatch.effect import Block, Ends, Fault, exact
from identification.mismatch.recording import Finding, Recording
from identification.models import Estimate
from identification.record import Floats

SURE = 0.01
"""Half width of the interval, in the step found; ours."""


def find(s: Recording) -> Finding | None:
    """Values on a grid coarser than a historian's."""
    return recording_faults.quantization(s.pv, s.ranged, s.limits.recorder)


def numbers(found: Finding, _: Recording) -> dict[str, Estimate]:
    """Step of the values [% PV]."""
    value = found.values["step_pct"]
    return {"step_pct": exact(value, "% PV", SURE * value)}


def drawn(found: Finding, s: Recording, _: Floats) -> Shape:
    """How often each value of PV occurs."""
    return grid(found.name, s.pv, found.values["step_pct"])


EFFECT = Fault(
    name="quantization",
    block=Block.SENSOR,
    sentence="PV comes in steps of {step_pct}: the transmitter or its card is coarse.",
    check="Look at the transmitter's range and the input card's resolution.",
    caption="How often each value of PV was recorded: a coarse sensor leaves gaps between teeth.",
    tests={
        "stiction": "The grid: plateaus of a sticking valve do not share one.",
    },
    order=2,
    find=find,
    ends=Ends.SMALLER,
    numbers=numbers,
    drawn=drawn,
    titles={"step_pct": "Step of values"},
)
