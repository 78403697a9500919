"""Controllers with integral action alone: their response, their robustness, and settings of the same form."""

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
    """An integral controller whose gain, times process gain and dead time of DELAY, is a share [-]."""
    return Pid(0.0, 10.0 / share, scan_s=scan_s)


def test_its_response_is_that_of_an_integral():
    """The response is C = 1/(Ti s), for both signs."""
    omega = np.geomspace(1e-4, 10.0, 50)
    for ti in (25.0, -25.0):
        response = controller_response(Pid(0.0, ti, scan_s=0.0), omega)
        np.testing.assert_allclose(response, 1.0 / (ti * 1j * omega), rtol=1e-6)


def test_half_a_dead_time_has_the_sensitivity_of_simc():
    """L = exp(-L s)/(2 L s), SIMC's loop with tau_c = L, has Ms 1.59 (Grimholt, Skogestad 2012)."""
    assert maximum_sensitivity(Loop(DELAY, alone(0.5))) == pytest.approx(1.59, abs=0.01)


def test_it_is_stable_up_to_half_pi():
    """The loop is stable up to k L = pi/2, where exp(-L s) k/s has a phase of -180 degrees and magnitude 1."""
    for share, stable in ((0.49, True), (0.51, False)):
        assert is_stable(Loop(DELAY, alone(math.pi * share, 0.01))) is stable


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tight_integral_gets_a_longer_time_and_no_gain(sign):
    """A loop with seven times a robust integral gain gets a longer, robust integral time and no proportional
    gain."""
    loop = Loop(replace(LAG, gain=sign * LAG.gain), Pid(0.0, sign * 35.0))
    found = recommend(loop, "tuning", load=load(np.random.default_rng(3), 6000, 1.0, 10.0, 0.02))
    assert found.controller.kp == 0.0
    assert sign * found.controller.ti_s > 70.0
    assert maximum_sensitivity(replace(loop, controller=found.controller)) < 2.01


def test_the_integral_of_the_error_is_the_integral_time():
    """The integral of the error after a unit step of the load at OP is 1/Ki (final value theorem)."""
    pid = Pid(0.0, 300.0)
    assert rejects_s(pid) == rejection(LAG, pid).integral == 300.0


def test_backlash_gets_integral_settings_or_none():
    """With valve backlash the search tries integral times only, and states a reason if no time is better."""
    loop = Loop(LAG, Pid(0.0, 80.0), Backlash(1.5))
    found = recommend(loop, "valve", load=load(np.random.default_rng(4), 6000, 0.5, 400.0, 0.02))
    assert {c.controller.kp for c in found.candidates} <= {0.0}
    assert found.controller is None or found.controller.kp == 0.0
    assert found.reason
