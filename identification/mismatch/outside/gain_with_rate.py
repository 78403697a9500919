"""Moves that count for more the faster they are: a relief port, a booster that opens, feed that overshoots."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import POINTS, Axis, Drawing, Drawn, Shape, banded, step
from identification.mismatch.curves.valve import step_size
from identification.mismatch.effect import Block, Effect
from identification.record import Floats
from identification.simulation.effect import Act, Param, Signal, Variant
from identification.simulation.lag import lagged
from identification.simulation.parameters import own_slot

HURRY, HURRY_T = own_slot("HURRY"), own_slot("HURRY_T", 1.0)
LAGS = (0.2, 0.6)
"""How long a move counts as fast, where the search begins, in time constants; ours."""
DRAWN = 5.0
"""Length of the picture, in that time."""


def hurried(flow: Floats, c: Floats, dt_s: float) -> Floats:
    """Flow, shape (n,) [% OP], with the square of what it is ahead of its own lag, of the move's sign."""
    ahead = flow - lagged(flow, float(c[HURRY_T]), dt_s)
    return flow + c[HURRY] * np.abs(ahead) * ahead / 10.0  # type: ignore[no-any-return]


def flow_after_step(d: Drawing) -> Shape:
    """Flow after a step of OP."""
    fine = DRAWN * float(d.best[HURRY_T]) / POINTS
    time, op = step(step_size(d), POINTS, fine)
    y, low, high = banded(lambda c: hurried(op, c, fine), d)
    curves = (Drawn("found", time, y, low, high), Drawn("plain", time, op))
    return Shape(d.name, "response", Axis("time", "s"), Axis("flow", "% OP"), curves)


EFFECT = Effect(
    name="gain-with-rate",
    block=Block.VALVE,
    sentence="moves count for more the faster they are, a sudden one of 10 % by {hurry} of itself, for {hurry_s}",
    check="Look for a booster, a relief port or a feed that overshoots, and at fast moves of OP beside slow ones.",
    acts=(Act(HURRY, 0.0, Signal.FLOW, hurried),),
    curve=flow_after_step,
    variants=(
        Variant(
            (
                Param(HURRY, "hurry", "", -20.0, 20.0, title="Extra of a move of 10 %"),
                Param(HURRY_T, "hurry_s", "s", 0.02, 3.0, "T", True, title="Lasts"),
            ),
            tuple({HURRY_T: lag} for lag in LAGS),
            linear=HURRY,
        ),
    ),
)
