"""A process gain that changes over the recording: fouling, wear."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.course import course, over_record
from identification.mismatch.curves.drawn import Axis, Drawing, Shape
from identification.mismatch.effect import Block, Effect
from identification.record import Floats
from identification.simulation.effect import Param, Variant, each
from identification.simulation.parameters import Slot


def gain_over_time(d: Drawing) -> Shape:
    """The gain as it drifts."""
    at = over_record(d.inputs)

    def read(c: Floats) -> Floats:
        return np.asarray(c[Slot.K] * (1.0 + c[Slot.DRIFT] * d.inputs.clock[at]))

    return course(d, at, read, Axis("gain", "% PV/% OP"), rest=float(d.plain[Slot.K]))


EFFECT = Effect(
    name="gain-drift",
    block=Block.PROCESS,
    sentence="The process gain changed by {gain_drift} over the recording.",
    check="Ask what fouled, wore or changed over the recording.",
    timed=True,
    curve=gain_over_time,
    variants=(
        Variant(
            (Param(Slot.DRIFT, "gain_drift", "per record", -1.9, 1.9, title="Gain drift"),),
            each(Slot.DRIFT, -0.2, 0.2),
        ),
    ),
)
