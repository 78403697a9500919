"""Clock and controller judged from SP, PV and OP."""

from __future__ import annotations

import numpy as np
import pytest

from identification.controller.check import StatedSettings, judge
from identification.controller.pi_regression import Trends
from tests.identification.scenes import PLAY, N, recording

pytestmark = pytest.mark.slow

GOOD = np.ones(N, dtype=bool)


def law(e: np.ndarray, kp: float, ti: float, gap: float = 0.0) -> np.ndarray:
    """OP, shape (n,), of a plain PI that stands still while |e| < gap."""
    out, u, last = np.empty_like(e), 50.0, 0.0
    for k, now in enumerate(e):
        if abs(now) >= gap:
            u += kp * (now - last) + kp * now / ti
            last = now
        out[k] = u
    return np.round(out, 2)


def test_true_settings_are_not_blamed() -> None:
    """A controller that does what is stated is not named."""
    s = recording(1)
    assert s.stated is not None
    assert judge(Trends(s.sp, s.pv, s.op, GOOD), s.stated)[0] is None


@pytest.mark.parametrize(("kp", "ti"), [(2.1, 20.0), (1.8, 23.0)])
def test_wrong_settings_are_found(kp: float, ti: float) -> None:
    """Settings stated 15 % wrong are named and the true ones given within 3 %."""
    s = recording(2)
    found, _ = judge(Trends(s.sp, s.pv, s.op, GOOD), StatedSettings(kp, ti))
    assert found is not None
    assert found.name == "controller-settings"
    assert found.values["kp"] == pytest.approx(1.8, rel=0.03)
    assert found.values["ti_samples"] == pytest.approx(20.0, rel=0.03)


def test_wrong_integral_time_is_found_where_the_loop_seldom_moves() -> None:
    """With one set point move in the record most spans hold noise alone; the few that move decide."""
    rng = np.random.default_rng(5)
    e = rng.normal(0, 0.02, N)
    e[2500:2700] += 6 * np.exp(-np.arange(200) / 50.0)
    op = law(e, 1.8, 20.0) + np.round(rng.normal(0, 0.05, N), 2)
    found, _ = judge(Trends(np.full(N, 50.0), 50.0 - e, op, GOOD), StatedSettings(1.8, 32.0))
    assert found is not None
    assert found.name == "controller-settings"
    assert found.values["ti_samples"] == pytest.approx(20.0, rel=0.05)


def filtered_loop(seed: int, lag: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """PV with coarse noise, and OP in steps of a PI that acts on PV behind a filter of that lag [samples], (N,)."""
    rng = np.random.default_rng(seed)
    slow = np.convolve(rng.normal(0, 0.6, N + 200), np.ones(200) / np.sqrt(200), mode="valid")[:N]
    pv = 50.0 + slow + rng.normal(0, 0.15, N)
    seen, at = np.empty(N), pv[0]
    for k in range(N):
        at += (pv[k] - at) * (1.0 - np.exp(-1.0 / lag))
        seen[k] = at
    return pv, np.round(law(50.0 - seen, 1.8, 20.0) / step) * step


@pytest.mark.parametrize(("stated", "name"), [(28.0, None), (60.0, "controller-settings")])
def test_a_set_point_between_its_digits_is_no_other_integral_time(stated: float, name: str | None) -> None:
    """SP of 42.765 is recorded as 42.75, PV in steps of .02: the integral sums the difference of .015 up. The true
    integral time of 28 samples is still believed, a wrong one still named and the true one given within 3 %."""
    rng = np.random.default_rng(3)
    noise, load = rng.normal(0, 0.06, N), np.cumsum(rng.normal(0, 0.02, N))
    pv, op, y, u, last = np.empty(N), np.empty(N), 42.765, 50.0, 0.0
    for k in range(N):
        pv[k] = y + noise[k]
        e = 42.765 - pv[k]
        u += 8.0 * (e - last) + 8.0 * e / 28.0
        op[k], last = u, e
        y += 0.01 * (u - 50.0 - load[k])
    pv, op = np.round(pv / 0.02) * 0.02, np.round(op / 0.05) * 0.05
    found, told = judge(Trends(np.full(N, 42.75), pv, op, GOOD), StatedSettings(8.0, stated))
    assert told is not None
    assert told.offset == pytest.approx(0.015, abs=0.001)
    assert (None if found is None else found.name) == name
    assert found is None or found.values["ti_samples"] == pytest.approx(28.0, rel=0.03)


@pytest.mark.parametrize(("lag", "step"), [(1.5, 0.1), (3.0, 0.2), (6.0, 0.1)])
def test_filter_of_pv_is_no_fault(lag: float, step: float) -> None:
    """A controller that acts on a filtered PV has neither other settings nor a gap nor a late clock."""
    pv, op = filtered_loop(7, lag, step)
    assert judge(Trends(np.full(N, 50.0), pv, op, GOOD), StatedSettings(1.8, 20.0))[0] is None


def test_wrong_settings_show_behind_a_filter() -> None:
    """With the filter recovered beside them the true settings are given within 5 %."""
    pv, op = filtered_loop(8, 3.0, 0.01)
    found, _ = judge(Trends(np.full(N, 50.0), pv, op, GOOD), StatedSettings(1.8, 30.0))
    assert found is not None
    assert found.name == "controller-settings"
    assert found.values["ti_samples"] == pytest.approx(20.0, rel=0.05)
    assert found.values["kp"] == pytest.approx(1.8, rel=0.05)


def test_integral_within_a_sample_is_not_judged() -> None:
    """Of a thinned recording with an integral time of two samples nothing is said."""
    s = recording(2, PLAY)
    pv, op, sp = s.pv[::10], s.op[::10], s.sp[::10]
    assert judge(Trends(sp, pv, op, GOOD[::10]), StatedSettings(0.9, 2.0, 10.0)) == (None, None)


def test_thinned_recordings_blame_no_sound_controller() -> None:
    """Of every fifth sample, oscillation and all, neither clock nor settings within a fifth are blamed."""
    s = recording(2, PLAY)
    pv, op, sp = s.pv[::5], s.op[::5], s.sp[::5]
    good = np.ones(pv.size, dtype=bool)
    assert judge(Trends(sp, pv, op, good), StatedSettings(1.8, 4.0, 5.0))[0] is None
    wrong, _ = judge(Trends(sp, pv, op, good), StatedSettings(0.9, 4.0, 5.0))
    assert wrong is not None
    assert wrong.name == "controller-settings"


def test_late_clock_is_found() -> None:
    """PV stamped three samples late is named with its shift."""
    s = recording(3)
    late = np.concatenate((np.full(3, s.pv[0]), s.pv[:-3]))
    found, _ = judge(Trends(s.sp, late, s.op, GOOD), StatedSettings(1.8, 20.0))
    assert found is not None
    assert (found.name, found.values["late_samples"]) == ("clock-offset", 3.0)


def test_gap_is_found() -> None:
    """An OP that stands while the error is under 0.4 % is a gap of that size."""
    s = recording(4)
    op = law(s.sp - s.pv, 1.8, 20.0, 0.4)
    found, _ = judge(Trends(s.sp, s.pv, op, GOOD), StatedSettings(1.8, 20.0))
    assert found is not None
    assert found.name == "controller-gap"
    assert found.values["gap_pct"] == pytest.approx(0.4, rel=0.3)


def test_held_output_is_logic() -> None:
    """OP held for a twentieth of the record whatever the error is logic, not a gap."""
    s = recording(5)
    op = s.op.copy()
    for first in (700, 2200, 3900):
        op[first : first + 90] = op[first]
    found, _ = judge(Trends(s.sp, s.pv, op, GOOD), StatedSettings(1.8, 20.0))
    assert found is not None
    assert found.name == "controller-logic"
