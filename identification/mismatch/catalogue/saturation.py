"""A valve without further effect beyond a position: a stop, a hand valve, a pump at its limit."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant, each
from identification.mismatch.pictures import flow_over_op

UPPER = Param(Slot.STOP_HI, "limit_pct", "% OP", 0.0, 1.0, "opspan", title="Upper limit")
LOWER = Param(Slot.STOP_LO, "low_limit_pct", "% OP", 0.0, 1.0, "opspan", title="Lower limit")

EFFECT = Effect(
    name="saturation",
    block=Block.VALVE,
    sentence="Beyond {limit} a move of OP has no further effect.",
    check="Look at the mechanical stop, a throttled hand valve, or a pump at its end.",
    local=True,
    spoken={"limit": (UPPER.name, LOWER.name)},
    curve=flow_over_op,
    variants=(
        Variant((UPPER,), each(Slot.STOP_HI, 0.6, 0.75, 0.9)),
        Variant((LOWER,), each(Slot.STOP_LO, 0.4, 0.25, 0.1), label="low"),
    ),
)
