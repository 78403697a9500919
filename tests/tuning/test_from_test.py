"""Settings from an experiment are robust for every process within the intervals."""

from __future__ import annotations

import pytest

from identification.models import Estimate, Fopdt, Loop
from tuning.frequency_response import maximum_sensitivity
from tuning.from_test import TEST_MS, corners, settings_from


def within(wide):
    """Intervals of a process of gain 2, lag 100 s and dead time 20 s, with a relative half-width."""
    named = {"gain": 2.0, "lags_s": 100.0, "dead_time_s": 20.0}
    return {k: Estimate(v, v * (1 - wide), v * (1 + wide)) for k, v in named.items()}


def test_simc_is_that_of_its_rule():
    """Kp = T/(K (tau_c + L)) with tau_c = L, and Ti = min(T, 8 L) (Skogestad 2003, table 1)."""
    found = settings_from(Fopdt(2.0, 100.0, 20.0), corners(Fopdt(2.0, 100.0, 20.0), within(0.1)), 0.0).simc
    assert found.kp == pytest.approx(100.0 / (2.0 * 40.0))
    assert found.ti_s == pytest.approx(100.0)


@pytest.mark.parametrize("wide", [0.02, 0.3])
def test_settings_are_robust_at_every_corner(wide):
    """The maximum sensitivity is below its limit at all corners of the intervals."""
    process = Fopdt(2.0, 100.0, 20.0)
    processes = corners(process, within(wide))
    pid = settings_from(process, processes, 1.0).robust
    assert max(float(maximum_sensitivity(Loop(p, pid))) for p in processes) <= TEST_MS + 1e-6


def test_wider_intervals_give_less_gain():
    """A process with wider intervals gets a lower gain."""
    process = Fopdt(2.0, 100.0, 20.0)
    sure, unsure = (settings_from(process, corners(process, within(w)), 1.0).robust for w in (0.02, 0.3))
    assert abs(unsure.kp) < abs(sure.kp)
