"""A share of each move that acts in the opposite direction, faster or slower than the rest."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant
from identification.mismatch.pictures import pv_response

SHARE = Param(Slot.SHARE, "opposing_share", "", -5.0, 0.0, title="Opposing share")
TIME = Param(
    Slot.MODE_T, "opposing_time_constant_s", "s", 0.1, 1e4, "dt", True, title="Opposing time constant"
)
SHARES, TIMES = (-0.01, -0.03, -0.1, -0.3, -0.8), (0.3, 2.0, 8.0, 30.0)

EFFECT = Effect(
    name="inverse-response",
    block=Block.PROCESS,
    needs="every scan",
    sentence="After a move of OP, PV first moves in the opposite direction (inverse response).",
    check="This is normal for boilers and reboilers; tune the loop slower than the inverse response.",
    tests={
        "flow-dependent-delay": "Steps at two flow levels: an inverse response appears at both.",
        "positioner": "Three separate steps of OP: an inverse response must appear after each.",
    },
    curve=lambda d: pv_response(d, faster=Slot.MODE_T),
    variants=(
        Variant(
            (SHARE, TIME),
            tuple({Slot.SHARE: s, Slot.MODE_T: t} for s in SHARES for t in TIMES),
            modes=(0.005, 0.02, 0.08, 0.25),
            mode_share=(-5.0, -0.002),
        ),
    ),
)
