"""A vessel that spills over above a level."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import POINTS, Axis, Drawing, Drawn, Shape, banded
from identification.mismatch.effect import Block, Effect
from identification.simulation.effect import Param, Variant, each
from identification.simulation.parameters import Slot

MORE = 0.3
"""How far beyond the range recorded the picture goes, in that range."""


def pv_over_free(d: Drawing) -> Shape:
    """PV over what an unbounded vessel would show."""
    low_pv, high_pv = d.inputs.pv_range
    free = np.linspace(low_pv, high_pv + MORE * (high_pv - low_pv), POINTS)
    y, low, high = banded(lambda c: np.minimum(free, c[Slot.CAP]), d)
    curves = (Drawn("found", free, y, low, high), Drawn("plain", free, free))
    return Shape(d.name, "curve", Axis("PV of a vessel without overflow", "%"), Axis("PV", "%"), curves)


EFFECT = Effect(
    name="overflow",
    block=Block.PROCESS,
    sentence="Above {cap_pct} the vessel spills over.",
    check="Look at the overflow's height and keep SP under it.",
    tests={
        "sensor-clipping": (
            "Lower OP after the cap: a vessel that overflowed comes back at once, a clipped one later."
        ),
    },
    types=("level",),
    local=True,
    curve=pv_over_free,
    variants=(
        Variant(
            (Param(Slot.CAP, "cap_pct", "% PV", 0.0, 1.0, "pvspan", title="Overflow at"),),
            each(Slot.CAP, 0.7, 0.85, 0.95),
        ),
    ),
)
