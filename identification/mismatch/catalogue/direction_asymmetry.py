"""PV that rises and falls with different time constants."""

import math

from identification.mismatch.effect import Block, Effect, Estimate, Param, Parameters, Slot, Variant, each
from identification.mismatch.pictures import pv_response

LOG_RATIO = Param(Slot.ASYMMETRY, "log_ratio_down_up", "", -4.0, 4.0, hidden=True)


def ratio(own: Parameters) -> dict[str, Estimate]:
    """Time constant down over up."""
    r = own[LOG_RATIO.name]
    return {"ratio_down_up": Estimate(math.exp(r.value), math.exp(r.low), math.exp(r.high), "")}


EFFECT = Effect(
    name="direction-asymmetry",
    block=Block.PROCESS,
    sentence="PV rises and falls at different speeds (ratio of the time constants {ratio_down_up}).",
    check="Check whether heating and cooling, or filling and draining, use different equipment.",
    derived=ratio,
    titles={"ratio_down_up": "Time constant down over up"},
    curve=lambda d: pv_response(d, back=True),
    variants=(Variant((LOG_RATIO,), each(Slot.ASYMMETRY, -0.3, 0.3)),),
)
