"""Settings from a test: robust wherever the process lies in its intervals."""

from __future__ import annotations

import pytest

from identification.models import Estimate, Fopdt, Loop
from tuning.frequency_response import maximum_sensitivity
from tuning.from_test import TEST_MS, corners, settings_from


def told(wide):
    """A process of gain 2, lag 100 s, dead time 20 s, told within a share."""
    named = {"gain": 2.0, "lags_s": 100.0, "dead_time_s": 20.0}
    return {k: Estimate(v, v * (1 - wide), v * (1 + wide)) for k, v in named.items()}


def test_simc_is_that_of_its_rule():
    """Kp = T/(K (tau_c + L)) with tau_c = L, Ti = min(T, 8 L) (Skogestad 2003, table 1)."""
    found = settings_from(Fopdt(2.0, 100.0, 20.0), corners(Fopdt(2.0, 100.0, 20.0), told(0.1)), 0.0).simc
    assert found.kp == pytest.approx(100.0 / (2.0 * 40.0))
    assert found.ti_s == pytest.approx(100.0)


@pytest.mark.parametrize("wide", [0.02, 0.3])
def test_settings_are_robust_at_every_corner(wide):
    """The maximum sensitivity stays within its limit at all corners of the intervals."""
    process = Fopdt(2.0, 100.0, 20.0)
    among = corners(process, told(wide))
    pid = settings_from(process, among, 1.0).robust
    assert max(float(maximum_sensitivity(Loop(p, pid))) for p in among) <= TEST_MS + 1e-6


def test_wider_intervals_ask_for_less_gain():
    """What is known less well is tuned with less gain."""
    process = Fopdt(2.0, 100.0, 20.0)
    sure, unsure = (settings_from(process, corners(process, told(w)), 1.0).robust for w in (0.02, 0.3))
    assert abs(unsure.kp) < abs(sure.kp)
