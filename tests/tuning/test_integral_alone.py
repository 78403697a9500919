"""Controllers with integral action alone: their response, their robustness, and settings in their own form."""

import math
from dataclasses import replace

import numpy as np
import pytest

from identification.models import Backlash, Fopdt, Loop, Pid
from proofs.valve_loops import load
from tuning.frequency_response import controller_response, is_stable, maximum_sensitivity, rejects_s
from tuning.recommend import recommend
from tuning.search import rejection

DELAY = Fopdt(1.0, 1e-3, 10.0)
"""A dead time with almost no lag."""
LAG = Fopdt(1.5, 60.0, 12.0)


def alone(share: float, scan_s: float = 0.0) -> Pid:
    """An integral whose gain, times process gain and dead time of DELAY, is a share [-]."""
    return Pid(0.0, 10.0 / share, scan_s=scan_s)


def test_its_response_is_that_of_an_integral():
    """C = 1/(Ti s), of either sign."""
    omega = np.geomspace(1e-4, 10.0, 50)
    for ti in (25.0, -25.0):
        response = controller_response(Pid(0.0, ti, scan_s=0.0), omega)
        np.testing.assert_allclose(response, 1.0 / (ti * 1j * omega), rtol=1e-6)


def test_half_a_dead_time_has_the_sensitivity_of_simc():
    """L = exp(-L s)/(2 L s), SIMC's loop with tau_c = L, has Ms 1.59 (Grimholt, Skogestad 2012)."""
    assert maximum_sensitivity(Loop(DELAY, alone(0.5))) == pytest.approx(1.59, abs=0.01)


def test_it_is_stable_up_to_a_quarter_turn():
    """exp(-L s) k/s has a phase of -180 degrees, and a size of 1, at k L = pi/2."""
    for share, stable in ((0.49, True), (0.51, False)):
        assert is_stable(Loop(DELAY, alone(math.pi * share, 0.01))) is stable


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tight_one_gets_a_longer_time_and_no_gain(sign):
    """A loop with seven times a robust integral gets a longer integral time, robust, and still no gain."""
    loop = Loop(replace(LAG, gain=sign * LAG.gain), Pid(0.0, sign * 35.0))
    found = recommend(loop, "tuning", load=load(np.random.default_rng(3), 6000, 1.0, 10.0, 0.02))
    assert found.controller.kp == 0.0
    assert sign * found.controller.ti_s > 70.0
    assert maximum_sensitivity(replace(loop, controller=found.controller)) < 2.01


def test_a_step_of_the_load_costs_its_integral_time():
    """The integral of the error after a unit step of the load at OP is 1/Ki (final value theorem)."""
    pid = Pid(0.0, 300.0)
    assert rejects_s(pid) == rejection(LAG, pid).integral == 300.0


def test_backlash_gets_settings_of_its_form_or_none():
    """With a worn valve the search tries integral times alone, and says so if none is better."""
    loop = Loop(LAG, Pid(0.0, 80.0), Backlash(1.5))
    found = recommend(loop, "valve", load=load(np.random.default_rng(4), 6000, 0.5, 400.0, 0.02))
    assert {c.controller.kp for c in found.candidates} <= {0.0}
    assert found.controller is None or found.controller.kp == 0.0
    assert found.reason
