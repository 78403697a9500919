"""A process gain that changes over the recording: fouling, wear."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Variant, each
from identification.mismatch.pictures import GAIN, Drawing, Picture, course_picture

DRIFT = Param(Slot.DRIFT, "gain_drift", "per record", -1.9, 1.9, title="Gain drift")


def gain_over_time(d: Drawing) -> Picture:
    """The gain as it drifts."""
    rest = float(d.plain[Slot.K])
    return course_picture(d, GAIN, lambda x, c: c[Slot.K] * (1.0 + c[Slot.DRIFT] * x.clock), rest)


EFFECT = Effect(
    name="gain-drift",
    block=Block.PROCESS,
    sentence="The process gain changed by {gain_drift} over the recording.",
    check="Ask what fouled, wore or changed over the recording.",
    timed=True,
    curve=gain_over_time,
    variants=(Variant((DRIFT,), each(Slot.DRIFT, -0.2, 0.2)),),
)
