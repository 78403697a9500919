"""A stated control law compared with the recorded one, for controllers with terms that loops.csv does not
state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.controller.law_comparison import LawsCompared, compare_laws
from identification.controller.law_variants import fastest
from identification.models import ErrorForm, Pid
from identification.record import LoopRecord

N = 6000
TRUE = Pid(2.0, 80.0)


def recorded(
    acting, every: int = 1, rate: float = np.inf, kp: float = 2.0, weight: float = 1.0
) -> LoopRecord:
    """A lag of 60 s with dead time 8 s under a random-walk load, controlled by a PI; `acting` changes the error
    e."""
    rng = np.random.default_rng(6)
    load = np.cumsum(rng.standard_normal(N)) * 0.2
    load -= np.linspace(0.0, load[-1], N)
    sp = 50.0 + np.repeat([0.0, 2.0, -1.0, 1.0], N // 4) * (weight < 1.0)
    pv, op, y, integral, u = np.empty(N), np.empty(N), 0.0, 0.0, 50.0
    for k in range(N):
        y += (0.8 * ((op[k - 8] if k >= 8 else 50.0) - 50.0 + load[k]) - y) / 60.0
        pv[k] = 50.0 + y + 0.01 * rng.standard_normal()
        e = acting(sp[k] - pv[k])
        integral += kp * e / 80.0
        wanted = 50.0 + kp * (e + (weight - 1.0) * (sp[k] - 50.0)) + integral
        held = min(max(wanted, u - rate), u + rate)
        integral += held - wanted
        op[k] = u = held
    at = slice(0, None, every)
    return LoopRecord("L", 0.0, float(every), sp[at], pv[at], op[at], np.zeros(sp[at].size, dtype=bool))


def gapped(e: float) -> float:
    """An error with a gap of 0.4 %."""
    return np.sign(e) * max(abs(e) - 0.4, 0.0)


def compared(record: LoopRecord, stated: Pid) -> LawsCompared:
    """The comparison on the loop's own time scale."""
    found = compare_laws(record, 320.0, stated)
    assert found is not None
    return found


@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize(
    ("acting", "more"),
    [
        (gapped, {}),
        (lambda e: e * abs(e) / 100, {"kp": 150.0}),
        (lambda e: e, {"weight": 0.4}),
        (lambda e: e, {"rate": 0.05}),
    ],
    ids=["gap", "squared", "weight", "rate"],
)
def test_true_settings_agree_with_any_unstated_term(acting, more, every):
    """True gain and integral time agree with the record if the other terms of the control law are not stated."""
    assert compared(recorded(acting, every, **more), replace(TRUE, kp=more.get("kp", 2.0))).agree


@pytest.mark.parametrize("smooth", [4.0, 5.0, 10.0, 17.0, 30.0])
def test_an_unstated_filter_of_pv_is_no_other_setting(smooth):
    """True settings agree with the record of a controller that acts on PV behind a first-order filter. The
    filter is recovered within 12 %. Other gains with a shorter filter would leave less than 1 % of OP's
    variance."""
    seen = compared(behind_a_filter(smooth), Pid(1.0, 40.0, scan_s=1.0))
    assert seen.agree
    assert seen.found.pv_filter_s == pytest.approx(smooth, rel=0.12)


def behind_a_filter(smooth: float) -> LoopRecord:
    """A lag of 30 s with coarse noise under a random-walk load, controlled by a PI behind a filter of PV [s]."""
    rng = np.random.default_rng(8)
    load = np.cumsum(rng.standard_normal(N)) * 0.1
    load -= np.linspace(0.0, load[-1], N)
    pv, op, y, seen, integral = np.empty(N), np.empty(N), 0.0, 50.0, 0.0
    for k in range(N):
        y += ((op[k - 4] if k >= 4 else 50.0) - 50.0 + load[k] - y) / 30.0
        pv[k] = 50.0 + y + 0.05 * rng.standard_normal()
        seen += (1.0 - np.exp(-1.0 / smooth)) * (pv[k] - seen)
        integral += (50.0 - seen) / 40.0
        op[k] = 50.0 + (50.0 - seen) + integral
    return LoopRecord("L", 0.0, 1.0, np.full(N, 50.0), pv, op, np.zeros(N, dtype=bool))


def test_the_gap_is_found_and_the_square_named():
    """A gap is recovered within 10 %, and a squared error is reported by its name."""
    assert compared(recorded(gapped), TRUE).found.gap == pytest.approx(0.4, rel=0.1)
    squared = compared(recorded(lambda e: e * abs(e) / 100, kp=150.0), replace(TRUE, kp=150.0))
    assert squared.found.error_form is ErrorForm.SQUARED


@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize(
    "stated", [replace(TRUE, ti_s=80.0 / 60.0), replace(TRUE, ti_s=60.0 / 80.0), Pid(50.0, 80.0)]
)
def test_wrong_units_do_not_agree(stated, every):
    """Minutes or repeats instead of seconds, and a band instead of a gain, do not agree; the true law is
    recovered within 25 %."""
    seen = compared(recorded(lambda e: e, every), stated)
    assert not seen.agree
    assert seen.found.kp == pytest.approx(2.0, rel=0.25)
    assert seen.found.ti_s == pytest.approx(80.0, rel=0.25)


def test_integral_alone_is_found_as_such():
    """A controller with integral action alone is found without a gain, and its integral time within 1 %."""
    rng = np.random.default_rng(3)
    pv = 50.0 + np.convolve(rng.standard_normal(N), np.ones(60) / 60, mode="same")
    op = 50.0 + np.cumsum(50.0 - pv) / 40.0
    record = LoopRecord("L", 0.0, 1.0, np.full(N, 50.0), pv, op, np.zeros(N, dtype=bool))
    assert compared(record, Pid(0.0, 40.0)).agree
    found = compared(record, TRUE).found
    assert (found.kp, found.ti_s) == pytest.approx((0.0, 40.0), rel=0.01)


def test_a_rate_limit_is_found_and_a_sine_has_none():
    """A signal with many moves at its highest rate has a rate limit; a sine and noise have none."""
    t = np.arange(N)
    assert not fastest(50 + 5 * np.sin(t / 50)).any()
    assert not fastest(np.round(np.cumsum(np.random.default_rng(1).standard_normal(N)), 1)).any()
    assert fastest(np.cumsum(np.clip(np.random.default_rng(1).standard_normal(N), -1, 1))).mean() > 0.3


@pytest.mark.parametrize(
    ("more", "column", "true"),
    [({"rate": 0.05}, "op_rate", 0.05), ({"weight": 0.0}, "sp_weight", 0.0), ({}, "op_rate", np.inf)],
    ids=["rate", "weight", "none"],
)
def test_other_terms_are_recognized_with_true_settings(more, column, true):
    """A rate limit of OP and a gain without the set point are recognized, and none is reported where there is
    none."""
    found = compared(recorded(lambda e: e, **more), TRUE)
    assert found.agree
    assert getattr(found.found, column) == pytest.approx(true, rel=0.02)


def test_a_filter_and_a_limit_are_recognized():
    """A filter of PV of 7 s is recovered within a sixth, and a limit of OP at 51 % exactly."""
    rng = np.random.default_rng(4)
    load = np.cumsum(rng.standard_normal(N)) * 0.2
    load -= np.linspace(0.0, load[-1], N)
    pv, op, y, seen, integral = np.empty(N), np.empty(N), 0.0, 50.0, 50.0
    for k in range(N):
        y += (0.8 * ((op[k - 8] if k >= 8 else 50.0) - 50.0 + load[k]) - y) / 60.0
        pv[k] = 50.0 + y + 0.01 * rng.standard_normal()
        seen += (pv[k] - seen) / 8.0
        wanted = integral + 2.0 * (50.0 - seen) * (1.0 + 1.0 / 80.0)
        op[k] = min(wanted, 51.0)
        integral += 2.0 * (50.0 - seen) / 80.0 if wanted < 51.0 else 0.0
    record = LoopRecord("L", 0.0, 1.0, np.full(N, 50.0), pv, op, np.zeros(N, dtype=bool))
    found = compared(record, TRUE)
    assert found.agree
    assert found.found.op_hi == pytest.approx(51.0)
    assert found.found.pv_filter_s == pytest.approx(7.0, rel=1 / 6)
