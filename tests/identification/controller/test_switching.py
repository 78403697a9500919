"""OP that switches between two values, from synthetic signals."""

import numpy as np

from identification.controller.switching import switching

USE = np.ones(5000, dtype=bool)


def test_a_thermostat_and_a_pulsed_output_switch():
    """An OP that alternates between 0 and 100 is reported with its values and its number of switches, also with
    averages at the edges."""
    op = np.where(np.arange(5000) % 60 < 20, 100.0, 0.0)
    op[20::60] = 40.0
    found = switching(op, USE)
    assert found is not None
    assert (found.low, found.high) == (0.0, 100.0)
    assert found.switches == 83 + 83  # up at every 60th sample except the first, down 20 later


def test_a_pid_does_not_switch():
    """A random walk of OP, an OP that winds up between its limits, and an OP with coarse steps are not reported
    as switching."""
    walk = 50 + np.cumsum(np.random.default_rng(2).standard_normal(5000)) * 0.3
    saturated = np.clip(50 + 80 * np.sin(np.arange(5000) / 100), 0, 100)
    assert switching(walk, USE) is None
    assert switching(saturated, USE) is None
    assert switching(np.where(walk > 50, 50.4, 50.0), USE) is None
    assert switching(np.where(np.arange(5000) < 2500, 30.0, 60.0), USE) is None
