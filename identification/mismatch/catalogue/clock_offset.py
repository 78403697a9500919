"""PV stamped by another clock than OP."""

from identification.controller.check import LATE_SAMPLES
from identification.controller.pi_regression import LATE_STEP
from identification.mismatch.effect import Block, Fault, Number
from identification.mismatch.fault_pictures import other_clock

EFFECT = Fault(
    name="clock-offset",
    block=Block.RECORDER,
    sentence="PV is stamped {shift_s} later than OP: the two clocks differ.",
    check="Record PV and OP from one source or synchronize the clocks.",
    caption="OP recorded, and rebuilt with PV's clock set right (found) and as stamped.",
    numbers=(
        Number("shift_s", "s", "PV late by", LATE_SAMPLES, in_time=True, half=lambda s: LATE_STEP * s.dt_s),
    ),
    drawn=other_clock,
)
