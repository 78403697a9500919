"""A stated control law agrees with the record if the recorded set point differs from that of the controller."""

from __future__ import annotations

import numpy as np

from identification.controller.law_comparison import compare_laws
from identification.models import Pid
from identification.record import LoopRecord

STATED = Pid(6.4, 27.0, scan_s=1.0)
OFF = [-0.018, -0.018, -0.018, 0.003, 0.003, 0.003, 0.02, 0.02]
"""Difference between the recorded set point and that of the controller, by hours [%]."""


def loop_with_sp_off_its_record(off_by_hour: list[float]) -> LoopRecord:
    """A lag of 46 s and 4 s of dead time under PI control. Its set point differs from the recorded one by hours
    [%]."""
    n, rng = 3600 * len(off_by_hour), np.random.default_rng(3)
    sp, load = np.repeat(off_by_hour, 3600), np.cumsum(rng.normal(0.0, 0.05, n))
    pv, op, y, total = np.zeros(n), np.zeros(n), 0.0, 0.0
    for k in range(n):
        if k > 0:
            y += (2.4 * (op[max(k - 4, 0)] + load[k]) - y) / 46.0
        pv[k] = round(y + rng.normal(0.0, 0.05), 2)
        error = sp[k] - pv[k]
        total += STATED.kp / STATED.ti_s * error
        op[k] = STATED.kp * error + total
    return LoopRecord("L", 0.0, 1.0, np.full(n, 50.0), 50.0 + pv, 50.0 + op, np.zeros(n, bool))


def test_a_constant_error_of_the_recorded_set_point_is_no_other_law():
    """The stated control law agrees with a record whose set point is rounded."""
    record = loop_with_sp_off_its_record(OFF)
    seen = compare_laws(record, 17.0, STATED)
    assert seen is not None
    assert seen.agree


def test_a_wrong_integral_time_is_still_found():
    """In the same loop, an integral time that is stated six times too long does not agree, and the true one is
    recovered within 25 %."""
    record = loop_with_sp_off_its_record(OFF)
    seen = compare_laws(record, 17.0, Pid(6.4, 162.0, scan_s=1.0))
    assert seen is not None
    assert not seen.agree
    assert 0.8 < seen.found.ti_s / STATED.ti_s < 1.25
