"""A stated law stays the law where the set point of the record is off that of the controller."""

from __future__ import annotations

import numpy as np

from identification.controller.law_comparison import compare_laws
from identification.models import Pid
from identification.record import LoopRecord

STATED = Pid(6.4, 27.0, scan_s=1.0)
OFF = [-0.018, -0.018, -0.018, 0.003, 0.003, 0.003, 0.02, 0.02]
"""What the set point of the record is off that of the controller, by hours [%]."""


def loop_with_sp_off_its_record(off_by_hour: list[float]) -> LoopRecord:
    """A lag of 46 s and 4 s of dead time under PI, whose set point differs by hours from the recorded one [%]."""
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


def test_an_error_of_the_recorded_set_point_that_stays_is_no_other_law():
    """Of a set point that its record rounds, the stated law is still that of the record."""
    record = loop_with_sp_off_its_record(OFF)
    seen = compare_laws(record, 17.0, STATED)
    assert seen is not None
    assert seen.agree


def test_a_wrong_integral_time_is_still_seen():
    """Of the same loop, an integral time stated six times too long is another law than the record's."""
    record = loop_with_sp_off_its_record(OFF)
    seen = compare_laws(record, 17.0, Pid(6.4, 162.0, scan_s=1.0))
    assert seen is not None
    assert not seen.agree
    assert 0.8 < seen.found.ti_s / STATED.ti_s < 1.25
