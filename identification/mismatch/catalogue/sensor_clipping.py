"""A transmitter whose range ends before the process does."""

import numpy as np

from identification.mismatch import recording_faults
from identification.mismatch.effect import Block, Fault, Number, Recording
from identification.mismatch.fault_pictures import range_end


def step(s: Recording) -> float:
    """A step of the recording [% PV], to which the end is known."""
    return float(np.median(np.diff(np.unique(s.pv))))


EFFECT = Fault(
    name="sensor-clipping",
    block=Block.SENSOR,
    sentence="PV stops at {clip_pct} while OP goes on: the transmitter's range ends there.",
    check="Widen the transmitter's range, or keep SP inside it.",
    caption="PV stands at the end of its range while the model goes on beyond it.",
    order=3,
    find=lambda s: recording_faults.clipped(s.pv, s.limits.recorder),
    censors=True,
    numbers=(Number("clip_pct", "% PV", "Range ends at", half=step),),
    drawn=range_end,
)
