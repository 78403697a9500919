"""A process gain that goes with where PV has been for many time constants: coating, wetting, a catalyst."""

from __future__ import annotations

from identification.mismatch.effect import Block, Effect
from identification.simulation.effect import Param, Variant
from identification.simulation.parameters import Slot

SIZES = (-0.1, 0.1)
"""Relative change of gain per 10 % of PV with which the search begins; ours."""
MEMORIES = (8.0, 25.0)
"""Memories with which it begins, in time constants; ours: what a vessel forgets within five is its own dynamics."""

EFFECT = Effect(
    name="gain-with-history",
    block=Block.PROCESS,
    sentence="the process gain goes with where PV has been over the last {recall_s}, {recall} of it per 10 % of PV",
    check="Ask what PV changes slowly in the process: coating, wetting, scale, a catalyst, a bed that fills.",
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
