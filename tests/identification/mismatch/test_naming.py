"""Effects are reported by their names, and no effect is reported where there is none."""

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
def test_loop_without_an_effect_is_none(seed: int) -> None:
    """A loop under load and noise without an effect has the verdict `none`."""
    s = recording(seed)
    assert answer(explain(s), s).verdict == "none"


def test_one_outlier_and_a_gap_are_none() -> None:
    """One outlier and a gap in the recording give the verdict `none`."""
    s = recording(4)
    pv, usable = s.pv.copy(), s.usable.copy()
    pv[2100] += 15.0
    usable[3000:3060] = False
    pv[3000:3060] = pv[2999]
    s = replace(s, pv=pv, usable=usable)
    assert answer(explain(s), s).verdict == "none"


def test_backlash_is_named_with_its_width() -> None:
    """Backlash of 2 % is reported and its width is recovered within 0.2 %."""
    s = recording(5, BACKLASH)
    found = answer(explain(s), s)
    assert found.verdict == "backlash"
    assert found.effects[0].parameters["backlash_pct"].value == pytest.approx(2.0, abs=0.2)
    assert found.moved["dead_time_s"][1] == pytest.approx(3.4, abs=0.3)


def test_stiction_is_not_reported_as_backlash() -> None:
    """A stickband of 2 % with a jump of 1.2 % is reported as stiction, not as backlash."""
    s = recording(6, STICKING)
    found = answer(explain(s), s)
    assert found.verdict == "stiction"
    assert found.effects[0].parameters["slip_jump_pct"].value == pytest.approx(1.2, rel=0.15)


def test_load_step_is_named_where_it_is() -> None:
    """A step of the load is reported as a load step, and its span contains the time of the step."""
    load = np.where(np.arange(N) > 2600, 2.5 * (1 - np.exp(-(np.arange(N) - 2600) / 20.0)), 0.0)
    s = recording(7, load=np.nan_to_num(load))
    found = answer(explain(s), s)
    assert found.verdict == "load-step"
    assert any(first <= 2600 <= last for first, last in found.where["spans"])


def test_compressed_trends_are_reported_at_the_recorder() -> None:
    """Straight segments are reported as compression, and no effect of the valve is reported."""
    s = recording(8, BACKLASH)
    kept = np.arange(0, N, 9)
    pv = np.interp(np.arange(N), kept, s.pv[kept] + 1e-3 * np.random.default_rng(0).normal(size=kept.size))
    s = replace(s, pv=pv)
    found = answer(explain(s), s)
    assert (found.verdict, found.block) == ("compression", "recorder")
    assert len(found.effects) == 1


def test_process_that_never_settles_is_an_integrator_of_its_kind() -> None:
    """An integrating process is reported as an integrator for a pressure. It is not for a flow, which cannot
    integrate."""
    pid = Pid(0.9, 23.0)
    n = noise(9)
    r = closed_loop(Loop(Integrator(0.05, 5.0), pid), setpoints(9), 0.3 * n)
    held = StatedSettings(pid.kp, pid.ti_s)
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
    found = answer(explain(s), s)
    assert (found.verdict, found.block) == ("integrator", "process")
    assert answer(explain(replace(s, kind="flow")), s).verdict != "integrator"


def test_bursts_of_a_sensor_are_no_load_steps() -> None:
    """One-sided bursts on PV are not reported as load steps, because they do not pass through the process."""
    s = recording(10)
    rng = np.random.default_rng(10)
    pv = s.pv.copy()
    for first in rng.integers(200, N - 200, 8):
        pv[first : first + 40] += 2.0 * rng.exponential(1.0, 40)
    found = answer(explain(replace(s, pv=pv, stated=None)), s)
    assert found.verdict in ("unexplained", "none")


def test_samples_held_over_a_gap_are_not_reported_as_a_load() -> None:
    """Values that are held over a gap of the time stamps give no load step, although no mask marks them."""
    s = recording(11)
    kept = np.ones(N, dtype=bool)
    kept[2300:2320] = kept[3600:3650] = False
    held = np.maximum.accumulate(np.where(kept, np.arange(N), 0))
    s = replace(s, pv=s.pv[held], op=s.op[held], stamp_s=s.stamp_s[kept])
    assert answer(explain(s), s).verdict == "none"


def test_wrong_settings_do_not_hide_backlash() -> None:
    """With wrongly stated settings and backlash, the verdict is the settings and both effects are reported."""
    s = recording(12, BACKLASH)
    s = replace(s, stated=StatedSettings(3.0, 20.0))
    found = answer(explain(s), s)
    assert found.verdict == "controller-settings"
    assert [e.name for e in found.effects] == ["controller-settings", "backlash"]


def test_scattered_missing_samples_do_not_prevent_a_verdict() -> None:
    """Backlash of 2 % is reported with its width if one sample in twelve is missing, as with a failing poll."""
    s = recording(5, BACKLASH)
    lost = np.random.default_rng(0).random(s.pv.size) < 1 / 12
    held = np.maximum.accumulate(np.where(lost, 0, np.arange(s.pv.size)))
    s = replace(s, pv=s.pv[held], usable=~lost)
    found = answer(explain(s), s)
    assert found.verdict == "backlash"
    assert found.effects[0].parameters["backlash_pct"].value == pytest.approx(2.0, abs=0.2)
