"""A vessel that spills over above a level."""

from __future__ import annotations

import numpy as np

from identification.mismatch.curves.drawn import POINTS, Axis, Drawing, Drawn, Shape, banded
from identification.mismatch.effect import Block, Effect
from identification.record import Floats
from identification.simulation.effect import Param, Variant, each
from identification.simulation.open_loop import ModelInputs, outflow_head
from identification.simulation.parameters import Slot

FREE = (
    Param(Slot.T2, "vessel_before_s", "s", 0.1, 1e4, "dt", True, title="Time constant of the vessel before"),
    Param(Slot.BEGUN, "begun_pct", "% PV", -300.0, 300.0, hidden=True),
    Param(
        Slot.UPPER_CAP, "upper_cap_pct", "% PV", 0.0, 1.5, "pvspan", title="Overflow of the vessel before at"
    ),
    Param(Slot.PASSED, "passed", "", 0.0, 1.0, title="Share of it that falls on"),
    Param(Slot.CAP, "cap_pct", "% PV", 0.0, 1.0, "pvspan", title="Overflow at"),
)
MORE = 0.3
"""How far beyond the range recorded the picture goes, in that range."""


def at_rest(free: Floats, inputs: ModelInputs, c: Floats) -> Floats:
    """PV at rest under the feed that would bring a vessel without overflow to `free`, shape (n,) each [% PV]."""
    head, x, upper = outflow_head(inputs, c), free - inputs.level, c[Slot.UPPER_CAP] - inputs.level
    rooted = c[Slot.ROOT] > 0
    feed = 2.0 * head * (np.sqrt(np.maximum(1.0 + x / head, 0.0)) - 1.0) if rooted else x
    feed = (
        np.where(feed > upper, upper + c[Slot.PASSED] * (feed - upper), feed) if np.isfinite(upper) else feed
    )
    level = head * ((1.0 + feed / (2.0 * head)) ** 2 - 1.0) if rooted else feed
    return np.minimum(inputs.level + level, c[Slot.CAP])


def pv_over_free(d: Drawing) -> Shape:
    """PV over what an unbounded vessel would show."""
    low_pv, high_pv = d.inputs.pv_range
    free = np.linspace(low_pv, high_pv + MORE * (high_pv - low_pv), POINTS)
    y, low, high = banded(lambda c: at_rest(free, d.inputs, c), d)
    curves = (Drawn("found", free, y, low, high), Drawn("plain", free, free))
    return Shape(d.name, "curve", Axis("PV of a vessel without overflow", "%"), Axis("PV", "%"), curves)


EFFECT = Effect(
    name="overflow",
    block=Block.PROCESS,
    sentence="Above {spills_at} a vessel spills over.",
    spoken={"spills_at": ("cap_pct", "upper_cap_pct")},
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
        *(
            Variant(
                FREE[:count],
                tuple(
                    {Slot.T2: t, Slot.UPPER_CAP: c, Slot.PASSED: s, Slot.CAP: cap}
                    for t in (3.0, 10.0, 30.0, 100.0)
                    for c, cap in ((0.6, 0.7), (0.8, 0.85), (1.0, 0.95))
                    for s in (0.3, 0.8)
                ),
                label=label,
                delays=(Slot.T2,),
                needs="experiment",
            )
            for count, label in ((4, "of the vessel before"), (5, "of both vessels"))
        ),
    ),
)
