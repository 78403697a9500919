"""PV has time stamps from another clock than OP."""

import numpy as np

from identification.controller.check import LATE_SAMPLES
from identification.controller.pi_regression import LATE_STEP, shifted
from identification.mismatch.effect import Block, Fault, Finding, Floats, Recording, exact
from identification.mismatch.pictures import WINDOW, Picture, biggest_move, rebuilt_course


def other_clock(found: Finding, s: Recording, _: Floats) -> Picture | None:
    """OP about its biggest move, recomputed with PV as stamped and with corrected clock; None without settings."""
    if s.sp is None or s.stated is None:
        return None
    part = biggest_move(s.sp if float(np.ptp(s.sp)) > 0 else s.op, WINDOW // 4, s.usable)
    right = s.sp - shifted(s.pv, found.values[LATE_SAMPLES])
    laws = {"found": (right, s.stated), "stated": (s.sp - s.pv, s.stated)}
    return rebuilt_course(s, part, laws)


EFFECT = Fault(
    name="clock-offset",
    block=Block.RECORDER,
    sentence="PV is stamped {shift_s} later than OP: the two clocks differ.",
    check="Record PV and OP from one source or synchronize the clocks.",
    caption="OP recorded, and rebuilt with PV's clock set right (found) and as stamped.",
    numbers=lambda found, s: {"shift_s": exact(found.values[LATE_SAMPLES] * s.dt_s, "s", LATE_STEP * s.dt_s)},
    titles={"shift_s": "PV late by"},
    drawn=other_clock,
)
