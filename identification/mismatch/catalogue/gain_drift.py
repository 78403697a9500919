"""A process gain that changes over the recording: fouling, wear."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant, each
from identification.mismatch.pictures import gain_course

DRIFT = Param(Slot.DRIFT, "gain_drift", "per record", -1.9, 1.9, title="Gain drift")


EFFECT = Effect(
    name="gain-drift",
    block=Block.PROCESS,
    sentence="The process gain drifts over the recording (relative change {gain_drift}).",
    check="Find out what fouled, wore or changed over the recording.",
    timed=True,
    curve=lambda d: gain_course(d, lambda x, c: 1.0 + c[Slot.DRIFT] * x.clock),
    variants=(Variant((DRIFT,), each(Slot.DRIFT, -0.2, 0.2)),),
)
