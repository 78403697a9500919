"""A vessel that overflows above a level."""

import numpy as np

from identification.mismatch.effect import Block, Effect, Floats, Param, Slot, Start, Variant, each
from identification.mismatch.pictures import POINTS, Axis, Drawing, Picture, with_baseline
from identification.simulation.open_loop import ModelInputs, outflow_head

VESSEL = "Overflow of the vessel before at"
CAP = Param(Slot.CAP, "cap_pct", "% PV", 0.0, 1.0, "pvspan", title="Overflow at")
OF_VESSEL = (
    Param(Slot.T2, "vessel_before_s", "s", 0.1, 1e4, "dt", True, title="Time constant of the vessel before"),
    Param(Slot.BEGUN, "begun_pct", "% PV", -300.0, 300.0, hidden=True),
    Param(Slot.UPPER_CAP, "upper_cap_pct", "% PV", 0.0, 1.5, "pvspan", title=VESSEL),
    Param(Slot.PASSED, "passed", "", 0.0, 1.0, title="Share of it that falls on"),
)
STARTS: tuple[Start, ...] = tuple(
    {Slot.T2: t, Slot.UPPER_CAP: upper, Slot.PASSED: s, Slot.CAP: cap}
    for t in (3.0, 10.0, 30.0, 100.0)
    for upper, cap in ((0.6, 0.7), (0.8, 0.85), (1.0, 0.95))
    for s in (0.3, 0.8)
)
MORE = 0.3
"""Extent of the picture beyond the recorded range, relative to that range."""


def at_rest(free: Floats, inputs: ModelInputs, c: Floats) -> Floats:
    """PV at rest for the feed that would bring a vessel without overflow to `free`, shape (n,) each [% PV]."""
    head, x, upper = outflow_head(inputs, c), free - inputs.level, c[Slot.UPPER_CAP] - inputs.level
    rooted = c[Slot.ROOT] > 0
    feed = 2.0 * head * (np.sqrt(np.maximum(1.0 + x / head, 0.0)) - 1.0) if rooted else x
    feed = (
        np.where(feed > upper, upper + c[Slot.PASSED] * (feed - upper), feed) if np.isfinite(upper) else feed
    )
    level = head * ((1.0 + feed / (2.0 * head)) ** 2 - 1.0) if rooted else feed
    return np.minimum(inputs.level + level, c[Slot.CAP])


def pv_over_free(d: Drawing) -> Picture:
    """PV over the PV of a vessel without overflow."""
    low_pv, high_pv = d.inputs.pv_range
    free = np.linspace(low_pv, high_pv + MORE * (high_pv - low_pv), POINTS)
    axes = Axis("PV of a vessel without overflow", "%"), Axis("PV", "%")
    return with_baseline(d, "curve", axes, free, lambda c: at_rest(free, d.inputs, c), free)


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
        Variant((CAP,), each(Slot.CAP, 0.7, 0.85, 0.95)),
        *(
            Variant(free, STARTS, label=label, delays=(Slot.T2,), needs="experiment")
            for free, label in (
                (OF_VESSEL, "of the vessel before"),
                ((*OF_VESSEL, CAP), "of both vessels"),
            )
        ),
    ),
)
