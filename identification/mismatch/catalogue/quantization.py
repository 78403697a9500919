"""A transmitter or input card with few distinct values."""

import numpy as np

from identification.limits import RecorderLimits
from identification.mismatch.effect import Block, Ends, Fault, Finding, Floats, Recording, within
from identification.mismatch.pictures import PV, Picture, comb
from identification.mismatch.recording import STEP, level_gaps

STEPS_SHOWN = 24
"""Number of steps of a coarse sensor that are drawn."""


def coarse_grid(s: Recording) -> Finding | None:
    """Values on a grid coarser than a historian's; the threshold is larger where percent is of the recorded range."""
    gaps, limits = level_gaps(s.pv), s.limits.recorder
    least = limits.grid_step if s.ranged else limits.grid_step_of_range
    if gaps.size == 0 or gaps.size * limits.grid_samples > s.pv.size or float(gaps.mean()) < least:
        return None
    if float(gaps.max()) > limits.grid_uneven * float(gaps.mean()):
        return None
    return Finding({STEP: grid_unit(s.pv, limits)}, np.ones(s.pv.size, dtype=bool))


def grid_unit(pv: Floats, limits: RecorderLimits) -> float:
    """The step of values [% PV]: their mean distance where PV stays longest, so that no value between is missing.

    A finer rounding of a converter's steps makes some longer and some shorter; the mean is the converter's.
    """
    levels, counts = np.unique(pv, return_counts=True)
    often = counts >= max(limits.dwells * pv.size / levels.size, limits.dwell_samples)
    gaps = np.diff(levels)
    dwelt = gaps[often[1:] & often[:-1]]
    return float(dwelt.mean() if dwelt.size >= limits.dwell_samples - 1 else np.median(gaps))


def grid(found: Finding, s: Recording, _: Floats) -> Picture:
    """Number of occurrences of each PV value within some steps of a coarse sensor."""
    middle = float(np.median(s.pv))
    near = s.pv[np.abs(s.pv - middle) <= 0.5 * STEPS_SHOWN * found.values["step_pct"]]
    return comb(PV, *np.unique(near, return_counts=True))


EFFECT = Fault(
    name="quantization",
    block=Block.SENSOR,
    sentence="PV comes in steps of {step_pct}: the transmitter or its card is coarse.",
    check="Look at the transmitter's range and the input card's resolution.",
    caption="How often each value of PV was recorded: a coarse sensor leaves gaps between teeth.",
    tests={"stiction": "Compare the plateaus of PV: those of a sticking valve are not on a common grid."},
    order=2,
    find=coarse_grid,
    ends=Ends.SMALLER,
    numbers=lambda found, _: {STEP: within(0.01, found.values[STEP], "% PV")},
    titles={STEP: "Step of values"},
    drawn=grid,
)
