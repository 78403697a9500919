"""What is named, and that nothing is where nothing hides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.controller.check import StatedSettings
from identification.mismatch.answer import answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.recording import Recording
from identification.models import Integrator, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from tests.identification.recordings import BACKLASH, STICKING, N, noise, recording, setpoints

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_plain_loop_is_none(seed: int) -> None:
    """A plain loop under load and noise is `none`."""
    s = recording(seed)
    assert answer(explain(s), s).verdict == "none"


def test_one_outlier_and_a_gap_are_none() -> None:
    """One wild value and a hole in the recording are no physics."""
    s = recording(4)
    pv, usable = s.pv.copy(), s.usable.copy()
    pv[2100] += 15.0
    usable[3000:3060] = False
    pv[3000:3060] = pv[2999]
    s = replace(s, pv=pv, usable=usable)
    assert answer(explain(s), s).verdict == "none"


def test_play_is_named_with_its_width() -> None:
    """Play of 2 % is named and its interval lies within 0.2 % of the truth."""
    s = recording(5, BACKLASH)
    said = answer(explain(s), s)
    assert said.verdict == "backlash"
    assert said.effects[0].parameters["backlash_pct"].value == pytest.approx(2.0, abs=0.2)
    assert said.moved["dead_time_s"][1] == pytest.approx(3.4, abs=0.3)


def test_sticking_is_not_taken_for_play() -> None:
    """A stickband of 2 % with a jump of 1.2 % is stiction, not play."""
    s = recording(6, STICKING)
    said = answer(explain(s), s)
    assert said.verdict == "stiction"
    assert said.effects[0].parameters["slip_jump_pct"].value == pytest.approx(1.2, rel=0.15)


def test_load_step_is_named_where_it_is() -> None:
    """A step of the load is a load, and its span is where it came."""
    load = np.where(np.arange(N) > 2600, 2.5 * (1 - np.exp(-(np.arange(N) - 2600) / 20.0)), 0.0)
    s = recording(7, load=np.nan_to_num(load))
    said = answer(explain(s), s)
    assert said.verdict == "load-step"
    assert any(first <= 2600 <= last for first, last in said.where["spans"])


def test_compressed_trends_end_at_the_recorder() -> None:
    """Straight segments off any grid are the finding; nothing of the valve is said."""
    s = recording(8, BACKLASH)
    kept = np.arange(0, N, 9)
    pv = np.interp(np.arange(N), kept, s.pv[kept] + 1e-3 * np.random.default_rng(0).normal(size=kept.size))
    s = replace(s, pv=pv)
    said = answer(explain(s), s)
    assert (said.verdict, said.block) == ("compression", "recorder")
    assert len(said.effects) == 1


def test_process_that_never_settles_is_an_integrator_of_its_kind() -> None:
    """A pressure whose process integrates is named so; as a flow, which cannot, it is left unnamed."""
    law = Pid(0.9, 23.0)
    n = noise(9)
    r = closed_loop(Loop(Integrator(0.05, 5.0), law), setpoints(9), 0.3 * n)
    held = StatedSettings(law.kp, law.ti_s)
    s = Recording(
        r.sp,
        np.round(r.pv, 2),
        np.round(r.op, 2),
        np.ones(N, dtype=bool),
        1.0,
        r.time_s,
        held,
        kind="pressure",
    )
    said = answer(explain(s), s)
    assert (said.verdict, said.block) == ("integrator", "process")
    assert answer(explain(replace(s, kind="flow")), s).verdict != "integrator"


def test_bursts_of_a_sensor_are_no_load_steps() -> None:
    """One-sided bursts on PV itself are unexplained: they did not come through the process."""
    s = recording(10)
    rng = np.random.default_rng(10)
    pv = s.pv.copy()
    for first in rng.integers(200, N - 200, 8):
        pv[first : first + 40] += 2.0 * rng.exponential(1.0, 40)
    said = answer(explain(replace(s, pv=pv, stated=None)), s)
    assert said.verdict in ("unexplained", "none")


def test_samples_held_over_a_hole_are_not_taken_for_a_load() -> None:
    """Where the stamps have a hole, the values held over it raise no load step though nobody marked them."""
    s = recording(11)
    kept = np.ones(N, dtype=bool)
    kept[2300:2320] = kept[3600:3650] = False
    held = np.maximum.accumulate(np.where(kept, np.arange(N), 0))
    s = replace(s, pv=s.pv[held], op=s.op[held], stamp_s=s.stamp_s[kept])
    assert answer(explain(s), s).verdict == "none"


def test_wrong_settings_do_not_hide_the_play() -> None:
    """Of wrongly stated settings and a play in the valve the settings are the verdict, and both are told."""
    s = recording(12, BACKLASH)
    s = replace(s, stated=StatedSettings(3.0, 20.0))
    said = answer(explain(s), s)
    assert said.verdict == "controller-settings"
    assert [e.name for e in said.effects] == ["controller-settings", "backlash"]


def test_samples_missing_all_over_leave_a_verdict() -> None:
    """Play of 2 % is named with its width where one sample in twelve is missing, as from a poll that fails."""
    s = recording(5, BACKLASH)
    lost = np.random.default_rng(0).random(s.pv.size) < 1 / 12
    held = np.maximum.accumulate(np.where(lost, 0, np.arange(s.pv.size)))
    s = replace(s, pv=s.pv[held], usable=~lost)
    said = answer(explain(s), s)
    assert said.verdict == "backlash"
    assert said.effects[0].parameters["backlash_pct"].value == pytest.approx(2.0, abs=0.2)
