"""A process gain that goes with where PV has been for many time constants: coating, wetting, a catalyst."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.course import course, over_record
from identification.mismatch.curves.drawn import Axis, Drawing, Shape
from identification.mismatch.effect import Block, Effect
from identification.record import Floats
from identification.simulation.effect import Param, Variant
from identification.simulation.open_loop import gain_over_record
from identification.simulation.parameters import Slot

SIZES = (-0.1, 0.1)
"""Relative change of gain per 10 % of PV with which the search begins; ours."""
MEMORIES = (8.0, 25.0)
"""Memories with which it begins, in time constants; ours: what a vessel forgets within five is its own dynamics."""


def gain_by_history(d: Drawing) -> Shape:
    """The gain over the recording, as PV's past makes it."""
    at = over_record(d.inputs)

    def read(c: Floats) -> Floats:
        return np.asarray(c[Slot.K] * gain_over_record(d.inputs, c)[at])

    return course(d, at, read, Axis("gain", "% PV/% OP"), rest=float(d.plain[Slot.K]))


EFFECT = Effect(
    name="gain-with-history",
    block=Block.PROCESS,
    sentence="the process gain goes with where PV has been over the last {recall_s}, by {recall} of it per 10 % PV",
    check="Ask what PV changes slowly in the process: coating, wetting, scale, a catalyst, a bed that fills.",
    curve=gain_by_history,
    variants=(
        Variant(
            (
                Param(Slot.RECALL, "recall", "", -5.0, 5.0, title="Gain per 10 % of PV"),
                Param(Slot.RECALL_T, "recall_s", "s", 5.0, 200.0, "T", True, title="Memory"),
                Param(Slot.HEAD_BIAS, "flow_at_rest_pct", "% OP", -60.0, 60.0, hidden=True),
            ),
            tuple({Slot.RECALL: size, Slot.RECALL_T: memory} for size in SIZES for memory in MEMORIES),
        ),
    ),
)
