"""A second-order position loop that rests within a dead band about its target."""

from identification.mismatch.effect import Block, Effect, Friction, Param, Slot, Variant
from identification.mismatch.pictures import stem_response

LENGTH = 8.0
"""Length of the drawn response, in lags."""
FREE = (
    Param(Slot.SERVO, "positioner_lag_s", "s", 0.2, 200.0, "dt", True, title="Positioner lag"),
    Param(Slot.DAMPING, "damping", "", 0.1, 1.2, title="Positioner damping"),
    Param(Slot.DEADBAND, "deadband_pct", "% OP", 0.0, 0.5, "op", title="Dead band"),
)

EFFECT = Effect(
    name="positioner",
    block=Block.VALVE,
    sentence="The positioner responds late (lag {positioner_lag_s}) and stops within {deadband_pct} of its target.",
    check="Look at the positioner's gain and dead band; a recorded stem position decides.",
    indistinguishable=("stiction",),
    friction=Friction.HINT,
    curve=lambda d: stem_response(d, LENGTH * float(d.best[Slot.SERVO]), tuple(p.slot for p in FREE)),
    variants=(
        Variant(
            FREE,
            tuple(
                {Slot.SERVO: lag, Slot.DAMPING: 0.45, Slot.DEADBAND: band}
                for lag in (0.5, 2.0, 8.0)
                for band in (0.02, 0.08)
            ),
            delays=(Slot.SERVO,),
        ),
    ),
)
