"""The explain engine on short loops simulated in plain Python: names, sizes, saved models, no false alarm."""

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


def answer_for(s: Recording) -> Answer:
    """The answer for one recording."""
    return answer(explain(s), s)


def value(found: Answer, name: str) -> float:
    """A number of the first effect."""
    return found.effects[0].parameters[name].value


def test_fault_free_loop_is_none() -> None:
    """A loop under load and noise without an effect has the verdict `none`."""
    found = answer_for(recording(Plant(), 1))
    assert found.verdict == "none"


def test_backlash_is_named_with_its_width() -> None:
    """Backlash of 2 % is reported with its width within 10 %, and the dead time is recovered within 0.4 s."""
    found = answer_for(recording(Plant(backlash=2.0), 2))
    assert found.verdict == "backlash"
    assert value(found, "backlash_pct") == pytest.approx(2.0, rel=0.1)
    assert found.moved["dead_time_s"][1] == pytest.approx(3.4, abs=0.4)


def test_second_lag_is_named_with_its_time() -> None:
    """A second lag of 8 s is reported with its time constant within 20 %."""
    found = answer_for(recording(Plant(second_lag_s=8.0), 3))
    assert found.verdict == "second-lag"
    assert value(found, "second_lag_s") == pytest.approx(8.0, rel=0.2)


def test_the_shorter_of_two_lags_is_the_added_one() -> None:
    """Two lags in series have the same response in each order. A model with the longer one as the added lag is
    reported with the shorter one."""
    found = explain(recording(Plant(second_lag_s=8.0), 3))
    model = found.best.model
    c = model.c.copy()
    c[Slot.T], c[Slot.T2] = model.c[Slot.T2], model.c[Slot.T]
    swapped = longest_first(replace(model, c=c))
    assert swapped.c[Slot.T] == max(c[Slot.T], c[Slot.T2])
    courses = [simulate(found.p.inputs, x)[200:] for x in (c, swapped.c)]  # both at rest at the start
    assert courses[0] == pytest.approx(courses[1], abs=0.001)
    assert longest_first(swapped) is swapped


def test_load_step_is_a_load() -> None:
    """A step at the process inlet is reported as a load step at its time."""
    n = 2400
    found = answer_for(recording(Plant(), 4, n, np.where(np.arange(n) > 1500, 4.0, 0.0)))
    assert (found.verdict, found.block) == ("load-step", "load")
    assert any(a <= 1560 and b >= 1440 for a, b in found.where["spans"])


def test_coarse_sensor_is_reported_as_quantization() -> None:
    """A sensor with steps of 0.5 % is reported as quantization of this step, without an effect of the process."""
    found = answer_for(recording(Plant(grid=0.5), 5))
    assert (found.verdict, found.block) == ("quantization", "sensor")
    assert value(found, "step_pct") == pytest.approx(0.5, rel=0.05)


def test_wrong_settings_are_reported_at_the_controller() -> None:
    """A stated Kp that differs from the true one is reported as wrong settings, and the true Kp is recovered
    within 3 %."""
    found = answer_for(recording(Plant(), 6, kp_factor=1.5))
    assert (found.verdict, found.block) == ("controller-settings", "controller")
    assert value(found, "kp") == pytest.approx(1.6, rel=0.03)


def test_saved_model_carries_to_another_recording() -> None:
    """A saved model with backlash has a misfit on another recording of less than 60 % of the baseline model's
    misfit."""
    s, later = recording(Plant(backlash=3.0), 7), recording(Plant(backlash=3.0), 8)
    found = explain(s)
    misfits = []
    for fit in (found.plain, found.best):
        data = to_data("L", found.p.inputs, fit.model.c, fit.names, 0.0, None)
        misfits.append(float(np.std(later.pv - carried(data, later.op, later.pv, later.dt_s))))
    assert misfits[1] < 0.6 * misfits[0]


def test_names_do_not_depend_on_units() -> None:
    """A loop recorded at half the span has the same effect with twice the width."""
    s = recording(Plant(backlash=2.0), 9)
    twice = replace(
        s, pv=50 + 2 * (s.pv - 50), op=50 + 2 * (s.op - 50), sp=None if s.sp is None else 50 + 2 * (s.sp - 50)
    )
    one, two = answer_for(s), answer_for(twice)
    assert one.verdict == two.verdict == "backlash"
    assert value(two, "backlash_pct") == pytest.approx(2 * value(one, "backlash_pct"), rel=0.05)
