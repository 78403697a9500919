"""A valve supply that varies slowly and changes gain and bias together."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant
from identification.mismatch.pictures import Axis, course_picture
from identification.simulation.open_loop import head
from identification.simulation.parameters import KNOTS

AT_REST = Param(Slot.HEAD_BIAS, "flow_at_rest_pct", "% OP", -60.0, 60.0, title="Flow at rest")
KNOT = tuple(Param(int(Slot.HEAD) + i, f"head_{i + 1}", "", -2.0, 2.0, hidden=True) for i in range(KNOTS))
SUPPLY = Axis("supply", "% of its mean")
ADDED = 1e4
"""Flow at rest [% OP] for which an added course does not affect the gain; ours."""

EFFECT = Effect(
    name="supply-variation",
    block=Block.LOAD,
    sentence="The supply to the valve varies and changes gain and bias together.",
    check="Look at the supply's pressure or temperature over the same hours.",
    tests={
        "gain-drift": (
            "A longer recording: a supply returns to its earlier value, fouling does not; other loops show the "
            "supply too."
        ),
        "load-step": "The supply's own pressure or temperature trend.",
        "coupling": "The supply's own trend next to the other loop's OP.",
    },
    timed=True,
    needs="moves",
    curve=lambda d: course_picture(d, SUPPLY, lambda inputs, c: 100.0 * head(inputs, c)),
    variants=(
        Variant(
            (AT_REST, *KNOT),
            ({Slot.HEAD_BIAS: 8.0},),
            penalty=-5.0,
            opponent=Variant(KNOT, ({},), fixed={Slot.HEAD_BIAS: ADDED}),
        ),
    ),
)
