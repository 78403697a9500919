"""A controller whose OP is constant while the error is small."""

import numpy as np

from identification.mismatch.effect import Block, Fault, Finding, Floats, Recording, within
from identification.mismatch.pictures import Axis, Drawn, Picture

GAPS_SHOWN, GAP_CLASSES, FEWEST_IN_CLASS = 4.0, 32, 5
"""Errors are drawn up to this many gaps, in this many size classes, each of at least this many samples."""


def gap_profile(found: Finding, s: Recording, _: Floats) -> Picture | None:
    """Share of constant OP over the size of the error, with the gap's end; None without SP."""
    if s.sp is None:
        return None
    width = found.values["gap_pct"]
    still = np.diff(s.op, prepend=s.op[0]) == 0
    edges = np.linspace(0.0, GAPS_SHOWN * width, GAP_CLASSES + 1)
    at = np.digitize(np.abs(s.sp - s.pv)[s.usable], edges) - 1
    count = np.bincount(at, minlength=GAP_CLASSES + 1)[:GAP_CLASSES]
    constant = np.bincount(at, still[s.usable], minlength=GAP_CLASSES + 1)[:GAP_CLASSES]
    held = count >= FEWEST_IN_CLASS
    middle = 0.5 * (edges[1:] + edges[:-1])
    curve = Drawn("recorded", middle[held], 100.0 * constant[held] / count[held])
    x, y = Axis("size of SP − PV", "%"), Axis("OP constant", "% of samples")
    return Picture("curve", x, y, (curve,), (width,))


EFFECT = Fault(
    name="controller-gap",
    block=Block.CONTROLLER,
    sentence="The controller does not act while the error is under {gap_pct}.",
    check="Look for a dead band or gap action in the controller's configuration.",
    caption="A controller without a gap moves OP at every error; with a gap it acts only on errors beyond the gap.",
    numbers=lambda found, _: {"gap_pct": within(0.2, found.values["gap_pct"], "% PV")},
    titles={"gap_pct": "Gap"},
    drawn=gap_profile,
)
