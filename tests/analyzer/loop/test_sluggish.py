"""A loop that responds far more slowly than its process allows gets settings that make the true plant faster."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.advice.sluggish import faster_settings
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.pairs import RAMP_S, RAMPS, ramps
from benchmarks.world.simulate import sensitivity
from identification.models import Pid
from identification.record import LoopRecord

CONFIG = Config()


def recorded(d: Drawn) -> LoopRecord:
    """A day of a drawn loop, one row a second."""
    t = run(d)
    return LoopRecord(d.name, 0.0, 1.0, t.sp, t.pv, t.op, np.zeros(t.pv.size, bool))


def stated(d: Drawn) -> Pid:
    """Its settings."""
    return Pid(d.controller.kp, d.controller.ti_s, scan_s=d.controller.scan_s)


@pytest.fixture(scope="module")
def slow() -> list[Drawn]:
    """Six loops with a fifth to a twenty-fifth of SIMC's gain, and up to six times its integral time."""
    return drawn(31, 6, ("sluggish",))


def test_new_settings_reduce_the_error_of_the_true_plant(slow: list[Drawn]) -> None:
    """At least three of six loops get settings; each reduces the error of the true plant by at least 20 % and is
    robust.
    """
    count = 0
    for d in slow:
        found = faster_settings(recorded(d), stated(d), "", CONFIG)
        if found is None:
            continue
        count += 1
        new = replace(d.controller, kp=found.new.kp, ti_s=found.new.ti_s)
        before, after = run(d), run(d, settings=new)
        error = [float(np.mean(np.abs(t.pv - t.sp))) for t in (before, after)]
        assert error[1] < 0.8 * error[0]
        assert sensitivity(d.process, new)[0] < 2.2
    assert count >= 3


def test_a_level_is_slow_on_purpose(slow: list[Drawn]) -> None:
    """A level gets no faster settings, because it buffers flow."""
    for d in slow:
        assert faster_settings(recorded(d), stated(d), "level", CONFIG) is None


def test_without_set_point_moves_no_settings_are_given(slow: list[Drawn]) -> None:
    """A load alone does not show the response time of PV to OP."""
    still = replace(slow[0], moves=0.0)
    assert faster_settings(recorded(still), stated(still), "", CONFIG) is None


@pytest.mark.parametrize("seed", [41, 42])
def test_a_well_tuned_loop_is_unchanged(seed: int) -> None:
    """Of four well tuned loops none gets other settings."""
    assert [faster_settings(recorded(d), stated(d), "", CONFIG) for d in drawn(seed, 4, ("healthy",))] == [
        None
    ] * 4


def test_one_block_interval_alone_is_enough(slow: list[Drawn], monkeypatch: pytest.MonkeyPatch) -> None:
    """With one block interval alone, at least three of the loops get settings too."""
    monkeypatch.setattr("analyzer.loop.advice.sluggish.CLOCKS", (4.0,))
    assert sum(faster_settings(recorded(d), stated(d), "", CONFIG) is not None for d in slow) >= 3


def test_block_intervals_that_contradict_each_other_give_no_settings() -> None:
    """Under set point ramps, one block interval gives a process 29 times as steep as the other, with high precision.

    The settings for it would make the loop unstable, so no settings are given.
    """
    d = drawn(665, 12, ("healthy",))[11]
    t = run(d, sp=50.0 + ramps(d, RAMPS, RAMP_S, 3.0))
    record = LoopRecord(d.name, 0.0, 1.0, t.sp, t.pv, t.op, np.zeros(t.pv.size, bool))
    assert faster_settings(record, stated(d), "", CONFIG) is None
    bad = replace(d.controller, kp=0.99, ti_s=7.61)
    assert sensitivity(d.process, bad)[0] == np.inf


def test_a_first_step_doubles_the_gain_if_a_much_higher_gain_is_likely() -> None:
    """A loop at a sixth of SIMC's gain whose record is not enough for final settings gets twice its gain.

    The integral time is kept, and the loop is robust on the true plant.
    """
    d = drawn(551, 2, ("sluggish",))[1]
    found = faster_settings(recorded(d), stated(d), "", CONFIG)
    assert found is not None
    assert found.change is None
    assert found.new.kp == pytest.approx(2.0 * d.controller.kp, rel=0.02)
    assert found.new.ti_s == d.controller.ti_s
    assert sensitivity(d.process, replace(d.controller, kp=found.new.kp))[0] <= 1.7
