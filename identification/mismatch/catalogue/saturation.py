"""A valve that does nothing more beyond a position: a stop, a hand valve, a pump at its end."""

from __future__ import annotations

from identification.mismatch.curves.valve import flow_over_op
from identification.mismatch.effect import Block, Effect
from identification.simulation.effect import Param, Variant, each
from identification.simulation.parameters import Slot

EFFECT = Effect(
    name="saturation",
    block=Block.VALVE,
    sentence="Beyond {limit} the valve does nothing more.",
    check="Look at the mechanical stop, a throttled hand valve, or a pump at its end.",
    local=True,
    spoken={"limit": ("limit_pct", "low_limit_pct")},
    curve=flow_over_op,
    variants=(
        Variant(
            (Param(Slot.STOP_HI, "limit_pct", "% OP", 0.0, 1.0, "opspan", title="Upper limit"),),
            each(Slot.STOP_HI, 0.6, 0.75, 0.9),
        ),
        Variant(
            (Param(Slot.STOP_LO, "low_limit_pct", "% OP", 0.0, 1.0, "opspan", title="Lower limit"),),
            each(Slot.STOP_LO, 0.4, 0.25, 0.1),
            label="low",
        ),
    ),
)
