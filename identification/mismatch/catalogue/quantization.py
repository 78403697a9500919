"""A transmitter or its card that knows few values."""

from identification.mismatch import recording_faults
from identification.mismatch.effect import Block, Ends, Fault, Number
from identification.mismatch.fault_pictures import grid

SURE = 0.01
"""Half width of the interval, in the step found; ours."""

EFFECT = Fault(
    name="quantization",
    block=Block.SENSOR,
    sentence="PV comes in steps of {step_pct}: the transmitter or its card is coarse.",
    check="Look at the transmitter's range and the input card's resolution.",
    caption="How often each value of PV was recorded: a coarse sensor leaves gaps between teeth.",
    tests={"stiction": "The grid: plateaus of a sticking valve do not share one."},
    order=2,
    find=lambda s: recording_faults.quantization(s.pv, s.ranged, s.limits.recorder),
    ends=Ends.SMALLER,
    numbers=(Number("step_pct", "% PV", "Step of values", share=SURE),),
    drawn=grid,
)
