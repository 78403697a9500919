"""An integrating process: only its gain over time constant is defined."""

from identification.mismatch.effect import Block, Effect, Floats, Slot, Variant
from identification.mismatch.pictures import pv_response


def from_settling(c: Floats) -> None:
    """Convert a settling loop's parameters, in place, to the integrator of the same slope: unit gain, T over gain."""
    c[Slot.T] /= max(abs(c[Slot.K]), 1e-6)
    c[Slot.K], c[Slot.BIAS] = 1.0, 0.0


EFFECT = Effect(
    name="integrator",
    block=Block.PROCESS,
    sentence="The process integrates: it does not settle by itself.",
    check="Tune as an integrating loop.",
    types=("level", "pressure"),
    curve=pv_response,
    variants=(Variant((), ({},), {Slot.LEAK: 0.0}, replaces=(Slot.K,), enter=from_settling),),
)
