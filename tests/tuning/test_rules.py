"""Tuning rules against the source study's figures."""

import math

import pytest

from identification.models import Fopdt, Integrator, Pid
from tuning.rules import backlash_rule, effective_delay, simc


def test_nominal_tuning_of_the_study():
    """K = 80, T = 200 s, L = 1 s gives Kp = 1 and Ti = 10 s, the study's nominal level loop."""
    c = simc(Fopdt(80, 200, 1))
    assert (c.kp, c.ti_s) == pytest.approx((1.0, 10.0))


def test_flow_loop_takes_its_time_constant():
    """At T/L = 2 the integral time is the time constant."""
    assert simc(Fopdt(1, 2, 1)).ti_s == 2.0


def test_integrator_is_the_limit_of_a_slow_lag():
    """A lag with a long time constant and the same slope gets the settings of the integrator."""
    lag, ramp = simc(Fopdt(400, 1000, 1)), simc(Integrator(0.4, 1))
    assert (lag.kp, lag.ti_s) == pytest.approx((ramp.kp, ramp.ti_s))


def test_gain_takes_the_sign_of_the_process():
    """A process of negative gain gets a direct-acting controller."""
    assert simc(Fopdt(-2, 20, 1)).kp == -simc(Fopdt(2, 20, 1)).kp


def test_half_the_scan_is_dead_time():
    """Half a scan is added to the dead time. A process without dead time gets a finite gain."""
    assert effective_delay(Fopdt(1, 10, 2), 1.0) == 2.5
    assert math.isfinite(simc(Fopdt(1, 10, 0)).kp)


def test_no_gain_is_an_error():
    """A process of gain zero cannot be tuned, and the error states the slope."""
    with pytest.raises(ValueError, match="slope 0"):
        simc(Integrator(0.0, 1))


def test_rule_for_backlash():
    """Ti rises to the time constant at the same gain. A longer Ti and an integrator stay unchanged."""
    process = Fopdt(80, 200, 1)
    assert backlash_rule(process, Pid(1, 10)) == Pid(1, 200)
    assert backlash_rule(process, Pid(1, 300)) == Pid(1, 300)
    assert backlash_rule(Integrator(0.4, 1), Pid(1, 10)) == Pid(1, 10)
