"""Control laws of records without stated settings; proofs/controllers_plant.py shares no code with the package."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.record.judged_stretch import recorded
from identification.controller.free_law import FreeLaw, free_law
from identification.controller.law_comparison import compare_laws
from identification.controller.law_variants import fastest
from identification.models import ErrorForm, Pid
from identification.record import LoopRecord
from proofs.controllers_plant import Controlled, controlled

SCALE_S = 300.0


def law_of(c: Controlled, every: int = 1) -> FreeLaw:
    """The control law of a recording with one sample every `every` seconds, rounded to three digits."""
    sp, pv, op = (np.round(x[::every], 3) for x in (c.sp, c.pv, c.op))
    found = free_law(LoopRecord("L", 0.0, float(every), sp, pv, op, np.zeros(sp.size, dtype=bool)), SCALE_S)
    assert found is not None
    return found


def near(law: FreeLaw, c: Controlled, within: float) -> bool:
    """Whether gain and integral time agree with the simulated controller."""
    kp, ti, _ = c.ideal
    return abs(law.found.kp / kp - 1.0) < within and abs(law.found.ti_s / ti - 1.0) < within


@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize("form", ["PI", "gap", "error squared", "PV filter", "slow scan", "limit of OP"])
def test_settings_are_found_with_any_other_term_of_the_controller(form: str, every: int) -> None:
    """Gain and integral time are recovered within 10 % at 1 s and 25 % at 10 s for every form of the
    controller."""
    c = controlled(form, "worn", 71, days=0.5)
    assert near(law_of(c, every), c, {1: 0.10, 10: 0.25}[every])


def test_other_terms_of_the_controller_are_found_with_its_settings() -> None:
    """A gap, a squared error and a filter of PV are found without stated settings."""
    gap, squared, behind = (
        controlled(form, "set point moves", 71, days=0.5) for form in ("gap", "error squared", "PV filter")
    )
    assert law_of(gap).found.gap == pytest.approx(float(str(gap.extras["gap"])), rel=0.1)
    assert law_of(squared).found.error_form is ErrorForm.SQUARED
    filter_s = float(str(behind.extras["pv_filter_s"]))
    assert law_of(behind).found.pv_filter_s == pytest.approx(filter_s, rel=0.25)


def test_a_limit_of_the_rate_is_found_among_moves_of_noise() -> None:
    """A rate limit of OP that acts after set-point moves is recovered within 2 %, and the settings within 5 %."""
    c = controlled("limit of OP's rate", "set point moves", 41, days=0.5)
    law = law_of(c)
    assert law.found.op_rate == pytest.approx(float(str(c.extras["op_rate"])), rel=0.02)
    assert near(law, c, 0.05)


@pytest.mark.parametrize("digits", [1, 2, 9])
def test_the_highest_rate_of_a_sine_is_no_limit(digits: int) -> None:
    """The highest rate of a sine is not reported as a rate limit, also if the sine is rounded."""
    assert not fastest(np.round(50.0 + 10.0 * np.sin(np.arange(40_000) / 80.0), digits)).any()


def test_a_set_point_weight_is_found_from_set_point_moves() -> None:
    """The set-point weight of the gain is recovered within 0.1."""
    c = controlled("set point weight", "set point moves", 72, days=0.5)
    assert law_of(c).found.sp_weight == pytest.approx(float(str(c.extras["sp_weight"])), abs=0.1)


def test_a_stated_weight_is_no_finding() -> None:
    """A stated set-point weight that agrees with the record within its uncertainty is kept as stated."""
    c = controlled("set point weight", "set point moves", 46, days=0.5)
    sp, pv, op = (np.round(x[::10], 3) for x in (c.sp, c.pv, c.op))
    record = LoopRecord("L", 0.0, 10.0, sp, pv, op, np.zeros(sp.size, dtype=bool))
    stated = Pid(c.ideal[0], c.ideal[1], scan_s=1.0, sp_weight=float(str(c.extras["sp_weight"])))
    seen = compare_laws(record, SCALE_S, stated)
    assert seen is not None
    assert seen.found == stated


def test_a_direct_acting_integral_is_reported_too() -> None:
    """An integral-only controller is recovered within 5 % for both directions without stated settings."""
    c = controlled("integral only", "healthy", 71, days=0.5)
    for way in (1.0, -1.0):
        pv = 50.0 + way * (c.pv - 50.0)
        record = LoopRecord("L", 0.0, 1.0, c.sp, pv, c.op, np.zeros(pv.size, dtype=bool))
        found = recorded(record, SCALE_S, Config().settings)
        assert found is not None
        assert found.found.ti_s == pytest.approx(way * c.ideal[1], rel=0.05)


def test_integral_action_alone_has_no_gain() -> None:
    """An integral-only controller has a gain of zero, not a small gain."""
    c = controlled("integral only", "healthy", 71, days=0.5)
    found = law_of(c).found
    assert found.kp == 0.0
    assert found.ti_s == pytest.approx(c.ideal[1], rel=0.05)


def test_a_scheduled_gain_is_reported_as_several_laws() -> None:
    """A scheduled gain is reported as several control laws, a constant gain as one."""
    assert law_of(controlled("gain schedule", "worn", 71, days=0.5)).several
    assert not law_of(controlled("PI", "worn", 71, days=0.5)).several


@pytest.mark.parametrize("every", [1, 10])
def test_intervals_contain_the_settings(every: int) -> None:
    """The 90 % intervals contain the gain in at least nine of twelve loops, and the integral time in at least
    nine."""
    covered = np.zeros(2, dtype=int)
    for form in ("PI", "PV filter", "gap", "limit of OP's rate"):
        for seed in (73, 74, 75):
            c = controlled(form, "worn", seed, days=0.25)
            law, (kp, ti, _) = law_of(c, every), c.ideal
            covered += [law.kp.low <= kp <= law.kp.high, law.ti_s.low <= ti <= law.ti_s.high]
    assert (covered >= 9).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_op_that_a_script_moves_follows_no_law(seed: int) -> None:
    """Scripted steps of OP are explained by no control law, although PV responds to them."""
    rng = np.random.default_rng(seed)
    op, pv, x = np.repeat(50.0 + 10.0 * rng.standard_normal(60), 100), np.empty(6000), 0.0
    for k in range(pv.size):
        pv[k] = 50.0 + x + 0.05 * rng.standard_normal()
        x += (op[k] - 50.0 - x) / 25.0
    record = LoopRecord("L", 0.0, 1.0, np.full(pv.size, 50.0), pv, op, np.zeros(pv.size, dtype=bool))
    found = free_law(record, 100.0)
    assert found is None or found.explained < 0.9


@pytest.mark.parametrize("kind", ["noise", "drift", "sine", "constant"])
def test_signals_that_follow_no_law_have_none(kind: str) -> None:
    """OP that does not depend on PV is explained by no control law."""
    rng, k = np.random.default_rng(5), np.arange(20_000)
    pv, op = {
        "noise": (rng.normal(size=k.size), rng.normal(size=k.size)),
        "drift": (np.cumsum(rng.normal(size=k.size)), np.cumsum(rng.normal(size=k.size))),
        "sine": (np.sin(k / 50.0) + 0.1 * rng.normal(size=k.size), np.cumsum(rng.normal(size=k.size))),
        "constant": (rng.normal(size=k.size), np.full(k.size, 40.0)),
    }[kind]
    found = free_law(
        LoopRecord("L", 0.0, 1.0, np.full(k.size, 50.0), 50.0 + pv, 50.0 + op, np.zeros(k.size, dtype=bool)),
        SCALE_S,
    )
    assert found is None or found.explained < 0.9
