"""The explain engine itself on short loops that a plain Python plant made: names, sizes, saving, no false alarm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer import Answer, answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.model_file import carried, to_data
from identification.mismatch.recording import Recording
from identification.mismatch.selection import longest_first
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot
from tests.identification.plain_loop import Plant, recording


def said(s: Recording) -> Answer:
    """The answer to one recording."""
    return answer(explain(s), s)


def value(found: Answer, name: str) -> float:
    """A number of the first effect."""
    return found.effects[0].parameters[name].value


def test_sound_loop_is_none() -> None:
    """Nothing is named where a plain loop under load and noise was recorded."""
    found = said(recording(Plant(), 1))
    assert found.verdict == "none"


def test_play_is_named_with_its_width() -> None:
    """Play of 2 % is backlash, its width within a tenth, and the dead time comes back to the true one."""
    found = said(recording(Plant(backlash=2.0), 2))
    assert found.verdict == "backlash"
    assert value(found, "backlash_pct") == pytest.approx(2.0, rel=0.1)
    assert found.moved["dead_time_s"][1] == pytest.approx(3.4, abs=0.4)


def test_second_lag_is_named_with_its_time() -> None:
    """A second lag of 8 s is named, its time within a fifth."""
    found = said(recording(Plant(second_lag_s=8.0), 3))
    assert found.verdict == "second-lag"
    assert value(found, "second_lag_s") == pytest.approx(8.0, rel=0.2)


def test_the_shorter_of_two_lags_is_the_added_one() -> None:
    """Two lags in series answer alike in either order; a model with the longer one added is told with the shorter."""
    found = explain(recording(Plant(second_lag_s=8.0), 3))
    model = found.best.model
    c = model.c.copy()
    c[Slot.T], c[Slot.T2] = model.c[Slot.T2], model.c[Slot.T]
    turned = longest_first(replace(model, c=c))
    assert turned.c[Slot.T] == max(c[Slot.T], c[Slot.T2])
    courses = [simulate(found.p.inputs, x)[200:] for x in (c, turned.c)]  # both at rest at the start
    assert courses[0] == pytest.approx(courses[1], abs=0.001)
    assert longest_first(turned) is turned


def test_load_step_is_a_load() -> None:
    """A step that came in at the inlet is the load's, and stands at its time."""
    n = 2400
    found = said(recording(Plant(), 4, n, np.where(np.arange(n) > 1500, 4.0, 0.0)))
    assert (found.verdict, found.block) == ("load-step", "load")
    assert any(a <= 1560 and b >= 1440 for a, b in found.where["spans"])


def test_coarse_sensor_is_the_recorders() -> None:
    """A sensor that knows steps of 0.5 % alone is quantization of that step, and no physics."""
    found = said(recording(Plant(grid=0.5), 5))
    assert (found.verdict, found.block) == ("quantization", "sensor")
    assert value(found, "step_pct") == pytest.approx(0.5, rel=0.05)


def test_wrong_settings_are_the_controllers() -> None:
    """Where another Kp is stated than runs, the controller is named with the one that runs."""
    found = said(recording(Plant(), 6, kp_factor=1.5))
    assert (found.verdict, found.block) == ("controller-settings", "controller")
    assert value(found, "kp") == pytest.approx(1.6, rel=0.03)


def test_saved_model_carries_to_another_recording() -> None:
    """A model with play, saved and run over another recording, leaves half of what the plain model leaves."""
    s, later = recording(Plant(backlash=3.0), 7), recording(Plant(backlash=3.0), 8)
    found = explain(s)
    left = []
    for fit in (found.plain, found.best):
        data = to_data("L", found.p.inputs, fit.model.c, fit.names, 0.0, None)
        left.append(float(np.std(later.pv - carried(data, later.op, later.pv, later.dt_s))))
    assert left[1] < 0.6 * left[0]


def test_names_do_not_hang_on_units() -> None:
    """The same loop recorded at half the span, twice the percent, has the same effect with twice the width."""
    s = recording(Plant(backlash=2.0), 9)
    twice = replace(
        s, pv=50 + 2 * (s.pv - 50), op=50 + 2 * (s.op - 50), sp=None if s.sp is None else 50 + 2 * (s.sp - 50)
    )
    one, two = said(s), said(twice)
    assert one.verdict == two.verdict == "backlash"
    assert value(two, "backlash_pct") == pytest.approx(2 * value(one, "backlash_pct"), rel=0.05)
