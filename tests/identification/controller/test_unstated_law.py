"""A controller without stated settings, recovered from SP, PV and OP."""

from __future__ import annotations

import numpy as np
import pytest

from identification.controller.pi_regression import Trends, unstated_law


def day(kp: float, ti: float, seed: int, n: int = 6000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """SP, PV and OP, each shape (n,), of a lag under a PI controller with limits, simulated in plain Python.

    SP alternates between two levels, the load varies slowly, PV is rounded to 0.1 and OP to 0.01; ti in
    samples.
    """
    rng = np.random.default_rng(seed)
    sp = np.where(np.arange(n) % 2000 < 1000, 55.0, 45.0)
    pv, op, held, x, load = np.empty(n), np.empty(n), 50.0, 50.0, 0.0
    for k in range(n):
        load += 0.05 * rng.standard_normal() - 0.002 * load
        pv[k] = np.round(x + 0.1 * rng.standard_normal(), 1)
        e = sp[k] - pv[k]
        held = min(max(held + kp / ti * e, 0.0), 100.0)
        out = min(max(kp * e + held, 0.0), 100.0)
        op[k] = np.round(out, 2)
        x += (50.0 + np.sign(kp) * (out - 50.0) + load - x) / 25.0
    return sp, pv, op


@pytest.mark.parametrize(
    ("kp", "ti"), [(2.0, 24.0), (0.8, 12.0), (4.0, 60.0), (-1.5, 30.0), (0.5, 200.0), (1.0, 9.0)]
)
def test_settings_are_recovered_within_a_twentieth(kp: float, ti: float) -> None:
    """Kp and Ti are recovered within 5 % for both signs, with integral times from nine to two hundred samples."""
    sp, pv, op = day(kp, ti, 7)
    found = unstated_law(Trends(sp, pv, op, (op > 0.05) & (op < 99.95)))
    assert found is not None
    assert found.kp == pytest.approx(kp, rel=0.05)
    assert found.kp / found.ki == pytest.approx(ti, rel=0.05)


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_a_script_follows_no_law(seed: int) -> None:
    """If a script moves OP, no settings are reported, whether PV responds or not."""
    sp, pv, _ = day(2.0, 24.0, seed)
    rng = np.random.default_rng(seed)
    op = np.repeat(50.0 + 10.0 * rng.standard_normal(pv.size // 100), 100)
    x, answered = 0.0, np.empty(pv.size)
    for k in range(pv.size):
        answered[k] = 50.0 + x
        x += (op[k] - 50.0 - x) / 25.0
    usable = np.ones(pv.size, bool)
    assert unstated_law(Trends(sp, pv, op, usable)) is None
    assert unstated_law(Trends(sp, answered, op, usable)) is None
