"""Clock and controller checked from SP, PV and OP."""

from __future__ import annotations

import numpy as np
import pytest

from identification.controller.check import StatedSettings, judge
from identification.controller.pi_regression import Trends
from tests.identification.recordings import BACKLASH, N, recording

pytestmark = pytest.mark.slow

GOOD = np.ones(N, dtype=bool)


def controller_output(e: np.ndarray, kp: float, ti: float, gap: float = 0.0) -> np.ndarray:
    """OP, shape (n,), of a PI controller that holds OP while |e| < gap."""
    out, u, last = np.empty_like(e), 50.0, 0.0
    for k, now in enumerate(e):
        if abs(now) >= gap:
            u += kp * (now - last) + kp * now / ti
            last = now
        out[k] = u
    return np.round(out, 2)


def test_true_settings_are_not_blamed() -> None:
    """A controller that does what is stated has no finding."""
    s = recording(1)
    assert s.stated is not None
    assert judge(Trends(s.sp, s.pv, s.op, GOOD), s.stated)[0] is None


@pytest.mark.parametrize(("kp", "ti"), [(2.1, 20.0), (1.8, 23.0)])
def test_wrong_settings_are_found(kp: float, ti: float) -> None:
    """Settings that are stated 15 % wrong are reported, and the true ones are recovered within 3 %."""
    s = recording(2)
    found, _ = judge(Trends(s.sp, s.pv, s.op, GOOD), StatedSettings(kp, ti))
    assert found is not None
    assert found.name == "controller-settings"
    assert found.values["kp"] == pytest.approx(1.8, rel=0.03)
    assert found.values["ti_samples"] == pytest.approx(20.0, rel=0.03)


def test_wrong_integral_time_is_found_where_the_loop_seldom_moves() -> None:
    """A wrong integral time is found from one set-point move, although most of the record is noise."""
    rng = np.random.default_rng(5)
    e = rng.normal(0, 0.02, N)
    e[2500:2700] += 6 * np.exp(-np.arange(200) / 50.0)
    op = controller_output(e, 1.8, 20.0) + np.round(rng.normal(0, 0.05, N), 2)
    found, _ = judge(Trends(np.full(N, 50.0), 50.0 - e, op, GOOD), StatedSettings(1.8, 32.0))
    assert found is not None
    assert found.name == "controller-settings"
    assert found.values["ti_samples"] == pytest.approx(20.0, rel=0.05)


def filtered_loop(seed: int, lag: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """PV with coarse noise, and OP in steps of a PI that acts on filtered PV with this lag [samples], each
    shape (N,)."""
    rng = np.random.default_rng(seed)
    slow = np.convolve(rng.normal(0, 0.6, N + 200), np.ones(200) / np.sqrt(200), mode="valid")[:N]
    pv = 50.0 + slow + rng.normal(0, 0.15, N)
    seen, at = np.empty(N), pv[0]
    for k in range(N):
        at += (pv[k] - at) * (1.0 - np.exp(-1.0 / lag))
        seen[k] = at
    return pv, np.round(controller_output(50.0 - seen, 1.8, 20.0) / step) * step


@pytest.mark.parametrize(("stated", "name"), [(28.0, None), (60.0, "controller-settings")])
def test_a_set_point_between_its_digits_is_no_other_integral_time(stated: float, name: str | None) -> None:
    """The rounding of SP from 42.765 to 42.75 does not change the verdict on the integral time. The true
    integral time of 28 samples has no finding. A wrong one is reported, and the true one is recovered within 3
    %."""
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
    found, recovered = judge(Trends(np.full(N, 42.75), pv, op, GOOD), StatedSettings(8.0, stated))
    assert recovered is not None
    assert recovered.offset == pytest.approx(0.015, abs=0.001)
    assert (None if found is None else found.name) == name
    assert found is None or found.values["ti_samples"] == pytest.approx(28.0, rel=0.03)


@pytest.mark.parametrize(("lag", "step"), [(1.5, 0.1), (3.0, 0.2), (6.0, 0.1)])
def test_filter_of_pv_is_no_fault(lag: float, step: float) -> None:
    """A controller that acts on a filtered PV has no finding: no wrong settings, no gap and no late clock."""
    pv, op = filtered_loop(7, lag, step)
    assert judge(Trends(np.full(N, 50.0), pv, op, GOOD), StatedSettings(1.8, 20.0))[0] is None


def test_wrong_settings_are_found_behind_a_filter() -> None:
    """With a filter of PV, wrong settings are reported, and the true settings are recovered within 5 %."""
    pv, op = filtered_loop(8, 3.0, 0.01)
    found, _ = judge(Trends(np.full(N, 50.0), pv, op, GOOD), StatedSettings(1.8, 30.0))
    assert found is not None
    assert found.name == "controller-settings"
    assert found.values["ti_samples"] == pytest.approx(20.0, rel=0.05)
    assert found.values["kp"] == pytest.approx(1.8, rel=0.05)


def test_integral_time_of_two_samples_is_not_assessed() -> None:
    """A thinned recording with an integral time shorter than a sample has no finding and no settings."""
    s = recording(2, BACKLASH)
    pv, op, sp = s.pv[::10], s.op[::10], s.sp[::10]
    assert judge(Trends(sp, pv, op, GOOD[::10]), StatedSettings(0.9, 2.0, 10.0)) == (None, None)


def test_thinned_recordings_blame_no_correct_controller() -> None:
    """With every fifth sample of an oscillating loop, correct settings have no finding and a gain of half the
    true one is reported."""
    s = recording(2, BACKLASH)
    pv, op, sp = s.pv[::5], s.op[::5], s.sp[::5]
    good = np.ones(pv.size, dtype=bool)
    assert judge(Trends(sp, pv, op, good), StatedSettings(1.8, 4.0, 5.0))[0] is None
    wrong, _ = judge(Trends(sp, pv, op, good), StatedSettings(0.9, 4.0, 5.0))
    assert wrong is not None
    assert wrong.name == "controller-settings"


def test_late_clock_is_found() -> None:
    """A PV time stamp that is three samples late is reported with its shift."""
    s = recording(3)
    late = np.concatenate((np.full(3, s.pv[0]), s.pv[:-3]))
    found, _ = judge(Trends(s.sp, late, s.op, GOOD), StatedSettings(1.8, 20.0))
    assert found is not None
    assert (found.name, found.values["late_samples"]) == ("clock-offset", 3.0)


def test_gap_is_found() -> None:
    """An OP that is held while the error is below 0.4 % is reported as a gap of this size within 30 %."""
    s = recording(4)
    op = controller_output(s.sp - s.pv, 1.8, 20.0, 0.4)
    found, _ = judge(Trends(s.sp, s.pv, op, GOOD), StatedSettings(1.8, 20.0))
    assert found is not None
    assert found.name == "controller-gap"
    assert found.values["gap_pct"] == pytest.approx(0.4, rel=0.3)


def test_held_output_is_logic() -> None:
    """OP that is held for a twentieth of the record at any error is reported as logic, not as a gap."""
    s = recording(5)
    op = s.op.copy()
    for first in (700, 2200, 3900):
        op[first : first + 90] = op[first]
    found, _ = judge(Trends(s.sp, s.pv, op, GOOD), StatedSettings(1.8, 20.0))
    assert found is not None
    assert found.name == "controller-logic"
