"""Stiction: the stem holds through the stickband, then jumps; after the jump it rests, halts, slides or swings."""

from identification.estimation.descent import LEAST_BAND, LEAST_JUMP, reaching
from identification.mismatch.effect import Block, Effect, Estimate, Friction, Param, Parameters, Slot, Variant
from identification.mismatch.pictures import stem_over_op
from identification.models import Motion
from identification.simulation.valve_chain import COASTS

BAND = Param(Slot.STICKBAND, "stickband_pct", "% OP", 1e-4, 2.0, "op", True, title="Stickband")
TIME = Param(Slot.STEM_T, "stem_time_s", "s", 0.02, 2.0, "dt", True, title="Stem's natural time")
JUMP = Param(Slot.JUMP, "slip_jump_pct", "% OP", 1e-5, 2.0, "op", True, title="Slip jump")
BANDS = (0.01, 0.03, 0.08, 0.2, 0.5)
"""Stickbands at which the search begins, relative to OP's range."""


def widened_by_scatter(own: Parameters) -> dict[str, Estimate]:
    """Widen all intervals by the scatter of real friction. It differs from slip to slip, and one slip more or less
    changes all later ones, so the likelihood's optimum is much narrower than the true uncertainty."""
    band, jump, time = own[BAND.name], own[JUMP.name], own.get(TIME.name)
    most = band.value * LEAST_BAND
    widened = {
        BAND.name: reaching(band, band.value / LEAST_BAND, most),
        JUMP.name: reaching(jump, jump.value / LEAST_JUMP, most),
    }
    if time is not None:
        widened[TIME.name] = reaching(time, time.value / LEAST_JUMP, time.value * LEAST_JUMP)
    return widened


EFFECT = Effect(
    name="stiction",
    block=Block.VALVE,
    sentence="The valve sticks: OP has to move by {stickband_pct}, then the stem jumps by {slip_jump_pct}.",
    check="Look at packing and actuator; stroke the valve in steps under the stickband and watch the stem.",
    tests={"positioner": "A recorded stem position, or a stem watched by eye while OP ramps slowly."},
    indistinguishable=("positioner",),
    derived=widened_by_scatter,
    friction=Friction.STICKS,
    curve=stem_over_op,
    variants=(
        *(
            Variant(
                (BAND, JUMP),
                tuple({Slot.STICKBAND: s, Slot.JUMP: j * s} for s in BANDS for j in (0.4, 0.8)),
                {Slot.COAST: coast},
                label=motion,
            )
            for motion, coast in COASTS.items()
        ),
        Variant(
            (BAND, JUMP, TIME),
            tuple({Slot.STICKBAND: s, Slot.JUMP: 0.6 * s, Slot.STEM_T: 0.25} for s in BANDS),
            {Slot.COAST: COASTS[Motion.SLIDES]},
            label="has mass",
            delays=(Slot.STEM_T,),
        ),
    ),
)
