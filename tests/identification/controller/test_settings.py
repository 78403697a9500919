"""Settings of a controller recovered from its SP, PV and OP."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.controller.pid_regression import fit_pi
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.record import LoopRecord
from identification.simulation.closed_loop import closed_loop

N = 6000


def oscillating(pid: Pid, process: Fopdt, width: float = 1.0, seed: int = 1) -> LoopRecord:
    """A loop with backlash under a little noise."""
    noise = 0.02 * np.random.default_rng(seed).standard_normal(N)
    return closed_loop(Loop(process, pid, Backlash(width)), np.full(N, 50.0), noise)


@pytest.mark.parametrize(
    ("pid", "process", "period_s"),
    [
        (Pid(1.0, 10.0), Fopdt(80.0, 200.0, 1.0), 38.0),
        (Pid(0.8, 100.0), Fopdt(40.0, 1200.0, 8.0), 500.0),
        (Pid(-0.8, 100.0), Fopdt(-40.0, 1200.0, 8.0), 500.0),
    ],
    ids=["fast level", "slow level", "direct acting"],
)
def test_settings_are_recovered(pid, process, period_s):
    """Gain and integral time are recovered within 2 %, and the control law explains more than 99.9 % of OP's
    moves."""
    found = fit_pi(oscillating(pid, process), period_s)
    assert found is not None
    assert found.kp == pytest.approx(pid.kp, rel=0.02)
    assert found.ti_s == pytest.approx(pid.ti_s, rel=0.02)
    assert found.explained > 0.999


def test_scaling_pv_scales_the_gain_alone():
    """PV in another unit changes the gain in inverse proportion and does not change the integral time."""
    record = oscillating(Pid(1.0, 10.0), Fopdt(80.0, 200.0, 1.0))
    other = replace(record, pv=50 + 4 * (record.pv - 50))
    one, four = fit_pi(record, 38.0), fit_pi(other, 38.0)
    assert one is not None
    assert four is not None
    assert four.kp == pytest.approx(one.kp / 4)
    assert four.ti_s == pytest.approx(one.ti_s)


def test_samples_in_manual_do_not_count():
    """Manual moves of OP in a quarter of the record do not change the settings if the mask marks them."""
    record = oscillating(Pid(1.0, 10.0), Fopdt(80.0, 200.0, 1.0))
    op, manual = record.op.copy(), np.zeros(N, dtype=bool)
    manual[2000:3500] = True
    op[2000:3500] = 30 + 5 * np.sin(np.arange(1500) / 9)
    found = fit_pi(replace(record, op=op, masks={"manual": manual}), 38.0)
    assert found is not None
    assert found.kp == pytest.approx(1.0, rel=0.02)
    assert found.ti_s == pytest.approx(10.0, rel=0.02)


def test_a_loop_at_rest_has_no_settings():
    """Without moves of OP or of the error, no settings are reported."""
    still = LoopRecord("L", 0.0, 1.0, np.full(N, 50.0), np.full(N, 50.0), np.full(N, 40.0), np.zeros(N, bool))
    assert fit_pi(still, 60.0) is None
    assert fit_pi(replace(still, op=40 + np.sin(np.arange(N) / 9)), 60.0) is None


def test_no_settings_explain_an_independent_op():
    """If OP does not respond to PV, the control law explains less than 10 %."""
    rng = np.random.default_rng(5)
    pv, op = 50 + rng.standard_normal(N), 40 + np.cumsum(0.1 * rng.standard_normal(N))
    found = fit_pi(LoopRecord("L", 0.0, 1.0, np.full(N, 50.0), pv, op, np.zeros(N, bool)), 60.0)
    assert found is None or found.explained < 0.1
