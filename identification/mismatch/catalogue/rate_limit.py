"""A stem with a limited speed."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant, each
from identification.mismatch.pictures import stem_response, step_size

RATE = Param(Slot.RATE, "rate_pct_per_s", "%/s", 1e-3, 10.0, "op/dt", True, title="Maximum stem rate")

EFFECT = Effect(
    name="rate-limit",
    block=Block.VALVE,
    needs="every scan",
    sentence="The valve moves no faster than {rate_pct_per_s}, so large moves of OP arrive as ramps.",
    check="Look at air supply, booster and positioner; time a full stroke.",
    tests={
        "backlash": "One large and one small step of OP in the same direction.",
        "direction-asymmetry": "Steps of two sizes each way: with a rate limit the time grows with the size.",
    },
    curve=lambda d: stem_response(d, step_size(d) / float(d.best[Slot.RATE]), (Slot.RATE,)),
    variants=(Variant((RATE,), each(Slot.RATE, 0.005, 0.02, 0.08, 0.3, 1.0)),),
)
