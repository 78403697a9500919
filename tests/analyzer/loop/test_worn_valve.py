"""A worn valve is reported independently of the cause of the cycle, and no valve without a fault is reported."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.cause.worn_valve import WornValve
from analyzer.loop.decisions import Cause, Fault
from analyzer.loop.record.quality import Prepared, Scale
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.recorder import recorded
from identification.models import Pid
from identification.record import LoopRecord

CONFIG = Config()


def assessed(d: Drawn, record: LoopRecord) -> Assessment:
    """The assessment of a record of a drawn loop."""
    stated = Pid(d.controller.kp, d.controller.ti_s, scan_s=1.0)
    return assess(Prepared(record, Scale(0, 100, 0, 100, False), 0.0, 0.0, ()), stated, CONFIG)


def holed(d: Drawn, lost: int, every: int) -> LoopRecord:
    """A day of a loop in which the first `lost` rows of each `every` rows are bad."""
    t = run(d)
    bad = np.arange(t.pv.size) % every < lost
    return LoopRecord(d.name, 0.0, 1.0, t.sp, np.where(bad, 0.0, t.pv), t.op, bad, masks={"gap": bad})


def judged(d: Drawn, way: str = "plain") -> Assessment:
    """The assessment of a day of a drawn loop, recorded in the given way, by default one row a second."""
    r = recorded(run(d), way, d.seed)
    step_s = float(np.median(np.diff(r["stamp_s"])))
    record = LoopRecord(d.name, 0.0, step_s, r["sp"], r["pv"], r["op"], np.zeros(r["pv"].size, bool))
    return assessed(d, record)


def test_a_worn_valve_under_a_sine_is_found_with_its_width() -> None:
    """Of eight worn valves under a sine load at least four are found, with the load or as the cause, with widths
    within 20 %.
    """
    verdicts = [(d, judged(d).verdict) for d in drawn(33, 8, ("worn-sine",))]
    worn = [(d, v) for d, v in verdicts if v.fault == "backlash"]
    assert len(worn) >= 4
    for d, verdict in worn:
        m = verdict.measured
        assert m is not None
        assert m.backlash.valve.stickband == pytest.approx(d.valve.band, rel=0.2)


@pytest.mark.parametrize("kind", ["tight", pytest.param("load", marks=pytest.mark.slow)])
def test_a_valve_without_fault_is_never_called_worn(kind: str) -> None:
    """Of valves without fault under an oscillating load, or in a loop tuned too tight, none is called worn."""
    assert {str(judged(d).verdict.fault) for d in drawn(37, 6, (kind,))} <= {"none"}


@pytest.mark.parametrize("lost", ["bad", "manual"])
def test_a_night_with_half_of_it_lost_is_assessed_by_the_rest(lost: str) -> None:
    """A worn valve under a sine is found if the last half of the night is bad or in manual.

    A window without a good block is skipped.
    """
    d = drawn(521, 6, ("worn-sine",))[5]
    t = run(d)
    away = np.arange(t.pv.size) >= t.pv.size // 2
    masks = {"gap": away} if lost == "bad" else {"manual": away}
    record = LoopRecord(d.name, 0.0, 1.0, t.sp, t.pv, t.op, away & (lost == "bad"), masks=masks)
    found = assessed(d, record).verdict
    assert found.fault == "backlash"
    assert found.require_measured.backlash.valve.stickband == pytest.approx(d.valve.band, rel=0.1)


def loop(seed: int, kind: str, number: int) -> Drawn:
    """A loop of a kind by its number."""
    return drawn(seed, number + 1, (kind,))[number]


@pytest.mark.parametrize(("seed", "number"), [(574, 0), (574, 6), (581, 3)])
def test_backlash_wider_than_the_cycle_of_op_is_reported_with_the_load(seed, number):
    """Under a sine that moves OP by a fifth of the backlash, the load is the cause.

    The backlash is reported with a width within 5 %.
    """
    d = loop(seed, "worn-sine", number)
    verdict = judged(d).verdict
    assert verdict.cause is Cause.LOAD
    assert verdict.fault is Fault.BACKLASH
    assert verdict.require_measured.backlash.valve.stickband == pytest.approx(d.valve.band, rel=0.05)


def test_a_neighbours_cycle_through_a_valve_without_a_fault_is_no_valve_fault():
    """An external cycle of 68 s with a drifting phase gives no valve fault.

    Backlash of half the range of OP explains its harmonics by 78 nat in one stretch, but by less than ten in the
    whole day.
    """
    verdict = judged(loop(582, "load", 6)).verdict
    assert verdict.cause is not Cause.VALVE
    assert verdict.fault is Fault.NONE


def test_a_steady_loop_with_set_point_moves_has_no_fault():
    """In a steady loop between two set point moves, a free noise model replaces the process.

    Under a smooth load, the whole day gives its true process and an ideal valve, so no fault is reported.
    """
    verdict = judged(loop(588, "healthy", 2)).verdict
    assert verdict.cause is Cause.NONE
    assert verdict.fault is Fault.NONE


@pytest.mark.parametrize("number", [0, 3])
def test_slow_rows_of_a_loop_tuned_too_tight_show_no_backlash(number):
    """Recorded every 10 s, a loop tuned too tight with seven rows per cycle, or with OP between its limits, has no
    backlash.
    """
    verdict = judged(loop(574, "tight", number), "every 10 s").verdict
    assert verdict.cause is not Cause.VALVE
    assert verdict.fault is Fault.NONE


def test_a_limit_cycle_with_a_load_of_another_period_is_the_valves():
    """If a valve makes a cycle of 223 s under a sine load of 67 s, the valve is the cause, with a width within 5
    %.
    """
    d = loop(594, "worn-sine", 0)
    verdict = judged(d).verdict
    assert verdict.cause is Cause.VALVE
    assert verdict.fault is Fault.BACKLASH
    assert verdict.require_measured.backlash.valve.stickband == pytest.approx(d.valve.band, rel=0.05)


def test_a_limit_cycle_far_wider_than_its_backlash_is_the_valves():
    """In a loop tuned too tight, backlash makes a limit cycle in which OP moves by six times its width.

    It explains more than any line and is the cause, with a width within 5 %.
    """
    d = loop(598, "worn-tight", 3)
    verdict = judged(d).verdict
    assert verdict.cause is Cause.VALVE
    assert verdict.fault is Fault.BACKLASH
    assert verdict.require_measured.backlash.valve.stickband == pytest.approx(d.valve.band, rel=0.05)


def test_short_holes_all_day_hide_no_worn_valve():
    """If 4 of each 30 rows are bad all day, a worn valve under a sine is found with a width within 5 %.

    The holes are a thirtieth of a period and are bridged.
    """
    d = loop(574, "worn-sine", 6)
    found = assessed(d, holed(d, 4, 30)).verdict
    assert found.fault is Fault.BACKLASH
    assert found.require_measured.backlash.valve.stickband == pytest.approx(d.valve.band, rel=0.05)


def test_a_day_without_complete_blocks_neither_shows_nor_excludes_a_fault():
    """With 10 of each 20 rows bad, no block of 16 s is good: the whole day shows no worn valve.

    It does not exclude the worn valve that its stretch, in blocks of one row, shows.
    """
    d = loop(574, "worn-sine", 7)
    measured = judged(d).verdict.require_measured
    worn_model = WornValve(holed(d, 10, 20), measured, d.period_s, CONFIG.cause)
    assert worn_model.is_likelier
    assert not worn_model.is_seen


@pytest.mark.parametrize(
    ("seed", "kind", "number"), [(621, "load", 0), (621, "load", 1), (622, "healthy", 2)]
)
def test_a_historian_that_records_by_exception_makes_no_backlash(seed, kind, number):
    """PV stored after changes of 0.05 % lags in both directions, as a stem with backlash does.

    Under a load and in a steady loop the valve has no fault in that record and in the full one.
    """
    faults = [str(judged(loop(seed, kind, number), w).verdict.fault) for w in ("plain", "by exception")]
    assert faults == ["none", "none"]
