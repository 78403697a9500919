"""A worn valve is told whatever makes the cycle, and no sound valve is."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.quality import Prepared, Scale
from benchmarks.world.draw import Drawn, drawn, run
from identification.models import Pid
from identification.record import LoopRecord

CONFIG = Config()


def judged(d: Drawn) -> Assessment:
    """What a day of a drawn loop comes to, a row a second."""
    t = run(d)
    record = LoopRecord(d.name, 0.0, 1.0, t.sp, t.pv, t.op, np.zeros(t.pv.size, bool))
    stated = Pid(d.controller.kp, d.controller.ti_s, scan_s=1.0)
    return assess(Prepared(record, Scale(0, 100, 0, 100, False), 0.0, 0.0, ()), stated, CONFIG)


def test_a_worn_valve_under_a_sine_is_told_with_its_width() -> None:
    """Of eight worn valves under a sine load at least four are found, beside the load or as the cause, with a width
    that is right within a fifth."""
    told = [(d, judged(d).verdict) for d in drawn(33, 8, ("worn-sine",))]
    worn = [(d, v) for d, v in told if v.fault == "backlash"]
    assert len(worn) >= 4
    for d, verdict in worn:
        m = verdict.measured
        assert m is not None
        assert m.play.valve.stickband == pytest.approx(d.valve.band, rel=0.2)


@pytest.mark.parametrize("kind", ["load", "tight"])
def test_a_sound_valve_is_at_fault_beside_nothing(kind: str) -> None:
    """Of sound valves under a load that cycles, or in a loop tuned too tight, none is called worn."""
    assert {str(judged(d).verdict.fault) for d in drawn(37, 6, (kind,))} <= {"none"}


@pytest.mark.parametrize("lost", ["bad", "manual"])
def test_a_night_of_which_half_is_lost_is_judged_by_the_rest(lost: str) -> None:
    """A worn valve under a sine is found where the last half of the night is bad, or in manual: a window without a
    good block is passed over."""
    d = drawn(521, 6, ("worn-sine",))[5]
    t = run(d)
    away = np.arange(t.pv.size) >= t.pv.size // 2
    masks = {"gap": away} if lost == "bad" else {"manual": away}
    record = LoopRecord(d.name, 0.0, 1.0, t.sp, t.pv, t.op, away & (lost == "bad"), masks=masks)
    stated = Pid(d.controller.kp, d.controller.ti_s, scan_s=1.0)
    found = assess(Prepared(record, Scale(0, 100, 0, 100, False), 0.0, 0.0, ()), stated, CONFIG).verdict
    assert found.fault == "backlash"
    assert found.require_measured.play.valve.stickband == pytest.approx(d.valve.band, rel=0.1)
