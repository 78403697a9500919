"""A transmitter or its card that knows few values."""

import numpy as np

from identification.mismatch.effect import Block, Ends, Fault, Finding, Floats, Number, Recording
from identification.mismatch.pictures import PV, Picture, comb
from identification.mismatch.recording import STEP, level_gaps

OFTEN, FEWEST = 0.2, 4
"""Share of the mean count from which a value is one at which PV dwells, and samples there at least; ours."""
STEPS_SHOWN = 24
"""Steps of a coarse sensor that are drawn."""


def coarse_grid(s: Recording) -> Finding | None:
    """Values on a grid coarser than a historian's, the coarser where percent is of the recorded range."""
    gaps, limits = level_gaps(s.pv), s.limits.recorder
    least = limits.grid_step if s.ranged else limits.grid_step_of_range
    if gaps.size == 0 or gaps.size * 20 > s.pv.size or float(gaps.mean()) < least:
        return None
    if float(gaps.max()) > 4.0 * float(gaps.mean()):
        return None
    return Finding({STEP: grid_unit(s.pv)}, np.ones(s.pv.size, dtype=bool))


def grid_unit(pv: Floats) -> float:
    """The step of values [% PV]: their mean distance where PV dwells, so that none between is left out.

    A finer rounding over a converter's steps makes some longer and some shorter, and the mean is theirs.
    """
    levels, counts = np.unique(pv, return_counts=True)
    often = counts >= max(OFTEN * pv.size / levels.size, FEWEST)
    gaps = np.diff(levels)
    dwelt = gaps[often[1:] & often[:-1]]
    return float(dwelt.mean() if dwelt.size >= FEWEST - 1 else np.median(gaps))


def grid(found: Finding, s: Recording, _: Floats) -> Picture:
    """How often each value of PV occurs within some steps of a coarse sensor."""
    middle = float(np.median(s.pv))
    near = s.pv[np.abs(s.pv - middle) <= 0.5 * STEPS_SHOWN * found.values["step_pct"]]
    return comb(found.name, PV, *np.unique(near, return_counts=True))


EFFECT = Fault(
    name="quantization",
    block=Block.SENSOR,
    sentence="PV comes in steps of {step_pct}: the transmitter or its card is coarse.",
    check="Look at the transmitter's range and the input card's resolution.",
    caption="How often each value of PV was recorded: a coarse sensor leaves gaps between teeth.",
    tests={"stiction": "The grid: plateaus of a sticking valve do not share one."},
    order=2,
    find=coarse_grid,
    ends=Ends.SMALLER,
    numbers=(Number("step_pct", "% PV", "Step of values", share=0.01),),
    drawn=grid,
)
