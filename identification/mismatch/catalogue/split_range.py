"""A second valve that takes over above a point, after a dead zone and optionally a lag."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Start, Variant
from identification.mismatch.pictures import flow_over_op

FREE = (
    Param(Slot.SPLIT, "split_pct", "% OP", 0.0, 1.0, "opspan", title="Split point"),
    Param(Slot.RATIO, "gain_ratio", "", -5.0, 5.0, title="Gain above over below"),
    Param(Slot.SPLIT_DEAD, "dead_zone_pct", "% OP", 0.0, 0.5, "op", title="Dead zone"),
    Param(Slot.SPLIT_LAG, "second_valve_lag_s", "s", 0.001, 3.0, "T", True, title="Lag of the second valve"),
)
STARTS: tuple[Start, ...] = tuple(
    {Slot.SPLIT: s, Slot.RATIO: r, Slot.SPLIT_DEAD: d, Slot.SPLIT_LAG: 0.1}
    for s in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
    for r in (0.5, 0.8, 1.25, 2.0)
    for d in (0.005, 0.03)
)

EFFECT = Effect(
    name="split-range",
    block=Block.VALVE,
    sentence="At {split_pct} another valve takes over, with {gain_ratio} times the gain.",
    check="Look at where the two valves hand over, and whether their ranges overlap or leave a gap.",
    curve=flow_over_op,
    variants=(Variant(FREE[:3], STARTS), Variant(FREE, STARTS, label="with a lag")),
)
