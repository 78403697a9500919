"""PV that rises and falls with different time constants."""

from __future__ import annotations

import math

from identification.mismatch.curves.drawn import Drawing, Shape
from identification.mismatch.curves.process import pv_response
from identification.mismatch.effect import Block, Effect, Parameters
from identification.models import Estimate
from identification.simulation.effect import Param, Variant, each
from identification.simulation.parameters import Slot


def ratio(own: Parameters) -> dict[str, Estimate]:
    """Time constant down over up."""
    r = own["log_ratio_down_up"]
    return {"ratio_down_up": Estimate(math.exp(r.value), math.exp(r.low), math.exp(r.high), "")}


def pv_up_and_down(d: Drawing) -> Shape:
    """PV after a step of OP up, and down again."""
    return pv_response(d, back=True)


EFFECT = Effect(
    name="direction-asymmetry",
    block=Block.PROCESS,
    sentence=("PV rises and falls at different speeds (ratio of the time constants {ratio_down_up})."),
    check="Ask whether heating and cooling, filling and draining take different ways.",
    derived=ratio,
    titles={"ratio_down_up": "Time constant down over up"},
    curve=pv_up_and_down,
    variants=(
        Variant(
            (Param(Slot.ASYMMETRY, "log_ratio_down_up", "", -4.0, 4.0, hidden=True),),
            each(Slot.ASYMMETRY, -0.3, 0.3),
        ),
    ),
)
