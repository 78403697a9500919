"""A transmitter whose range is smaller than that of the process."""

import numpy as np

from identification.mismatch.effect import Block, Estimate, Fault, Finding, Floats, Recording, exact
from identification.mismatch.pictures import PV, TIME, WINDOW, Drawn, Picture, around_run


def clipped(s: Recording) -> Finding | None:
    """PV at exactly its highest or lowest value far more often than at the adjacent values."""
    levels, counts = np.unique(s.pv, return_counts=True)
    best, limits = None, s.limits.recorder
    if levels.size < limits.clip_values:
        return None
    for end, near in ((-1, counts[-7:-1]), (0, counts[1:7])):
        top = int(counts[end])
        enough = top >= limits.clip_samples and top > limits.clip_ratio * float(near.mean())
        if enough and (best is None or top > best.where.sum()):
            best = Finding({"clip_pct": float(levels[end])}, s.pv == levels[end])
    return best


def end_of_range(found: Finding, s: Recording) -> dict[str, Estimate]:
    """The end of the range, known to a step of the recording [% PV]."""
    step = float(np.median(np.diff(np.unique(s.pv))))
    return {"clip_pct": exact(found.values["clip_pct"], "% PV", step)}


def range_end(found: Finding, s: Recording, free: Floats) -> Picture:
    """The longest stretch of PV at its range end, with the unclipped model."""
    part = around_run(found.where, WINDOW)
    time = np.arange(part.start, part.stop) * s.dt_s
    end = np.full(time.size, found.values["clip_pct"])
    curves = (
        Drawn("found", time, free[part]),
        Drawn("recorded", time, s.pv[part]),
        Drawn("limit", time, end),
    )
    return Picture("course", TIME, PV, curves)


EFFECT = Fault(
    name="sensor-clipping",
    block=Block.SENSOR,
    sentence="PV stops at {clip_pct} while OP continues: the transmitter's range ends there.",
    check="Widen the transmitter's range, or keep SP inside it.",
    caption="PV stays at the end of its range while the model moves beyond it.",
    order=3,
    find=clipped,
    censors=True,
    numbers=end_of_range,
    titles={"clip_pct": "Range ends at"},
    drawn=range_end,
)
