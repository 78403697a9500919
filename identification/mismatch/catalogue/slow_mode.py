"""A share of each move that arrives much later, with its own time constant."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant
from identification.mismatch.pictures import pv_response

SHARE = Param(Slot.SHARE, "slow_share", "", 0.0, 0.95, title="Slow share")
TIME = Param(Slot.MODE_T, "slow_time_constant_s", "s", 1.5, 60.0, "T", True, title="Slow time constant")

EFFECT = Effect(
    name="slow-mode",
    block=Block.PROCESS,
    sentence="A share of {slow_share} of each move arrives late, with a time constant of {slow_time_constant_s}.",
    check="Find out which mass or recycle warms or fills slowly; tune for the fast part.",
    tests={
        "gain-drift": "Steps of both signs: a slow mode follows the sign of the step, a drift does not.",
        "load-step": "The same step again: a slow mode comes back with it, a load does not.",
        "integrator": "Hold OP for five of the longest time constants and see whether PV settles.",
    },
    curve=pv_response,
    variants=(
        Variant(
            (SHARE, TIME),
            tuple({Slot.SHARE: s, Slot.MODE_T: t} for s in (0.1, 0.4) for t in (4.0, 10.0)),
            modes=(3.0, 6.0, 15.0),
            mode_share=(0.002, 0.95),
        ),
    ),
)
