"""A historian that keeps few points and interpolates linearly between them."""

import numpy as np

from identification.mismatch.effect import Block, Ends, Fault, Finding, Floats, Recording, exact
from identification.mismatch.pictures import PV, TIME, WINDOW, Drawn, Picture, most_active
from identification.mismatch.recording import straight, straightened


def straight_segments(s: Recording) -> Finding | None:
    """Straight segments whose breaks are on no grid (swinging door and similar)."""
    limits = s.limits.recorder
    if not straightened(s.pv, limits.straight, limits):
        return None
    found = straight(s.pv)
    return Finding({"straight_share": float(found.mean())}, found)


def straight_lines(found: Finding, s: Recording, _: Floats) -> Picture:
    """The most active stretch of a compressed trend, with the samples on straight lines."""
    part = most_active(s.pv, WINDOW)
    time, x, marked = np.arange(part.start, part.stop) * s.dt_s, s.pv[part], found.where[part]
    curves = (Drawn("points", time[marked], x[marked]), Drawn("recorded", time, x))
    return Picture("course", TIME, PV, curves)


EFFECT = Fault(
    name="compression",
    block=Block.RECORDER,
    sentence="The historian compressed the trends to straight lines; nothing can be judged on them.",
    check="Switch compression and exception off for PV, SP and OP, then explain again.",
    caption="Straight segments between few stored points: what happened between them is not known.",
    order=0,
    find=straight_segments,
    ends=Ends.ALL,
    numbers=lambda found, _: {"straight_share": exact(found.values["straight_share"], "")},
    titles={"straight_share": "Samples on straight lines"},
    drawn=straight_lines,
)
