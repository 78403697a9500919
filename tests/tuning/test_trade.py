"""Settings from which an engineer may choose: none is dominated by another, and their limits hold on every
loop."""

from dataclasses import replace

import numpy as np
import pytest

from analyzer.loop.advice.settings_side_by_side import compared
from analyzer.loops.spec import LoopSpec
from analyzer.pages import compared as page
from identification.models import Backlash, Fopdt, Loop, Pid, Stiction
from identification.simulation.closed_loop import closed_loop
from proofs.valve_loops import backlash_case, corners, level_case, stick_case
from tuning.forecast import CALMER, DERIVATIVE, SMALLER, assess, loop_in_digits, run, settled, tried
from tuning.frequency_response import maximum_sensitivity
from tuning.limits import LIMITS
from tuning.recommend import recommend
from tuning.search import bench
from tuning.trade import trade


@pytest.fixture(scope="module")
def found():
    """Search tables and trade-offs of three loops each with backlash, stick-slip and backlash on an integrator."""
    out = []
    for make in (backlash_case, stick_case, level_case):
        for seed in range(3):
            case = make(seed)
            table = bench(case.loop, corners(case.loop)[:3], case.load, LIMITS)
            out.append((table, trade(table)))
    return out


def test_no_settings_on_the_curve_dominate_others(found):
    """Along the curve travel rises and error decreases, and each point is robust."""
    for table, t in found:
        travel, error = (np.array([getattr(c, name) for c in t.curve]) for name in ("travel", "error"))
        assert np.all(np.diff(travel) >= 0)
        assert np.all(np.diff(error) < 0)
        for c in t.curve:
            ms = maximum_sensitivity(replace(table.loops[0], controller=c.controller))
            assert ms <= LIMITS.ms_most_sample
    assert np.median([len(t.curve) for _, t in found]) >= 3


def test_the_choices_keep_their_limits_on_every_loop(found):
    """Simulated one by one, the choice with less travel has at most 25 % more error. The choice with less error
    has no more travel than allowed."""
    chosen = 0
    for table, t in found:
        for name, c in t.chosen.items():
            chosen += 1
            for one, load in zip(table.loops, table.loads, strict=True):
                old, new = (
                    assess(settled(run(loop_in_digits(replace(one, controller=pid)), load)))
                    for pid in (one.controller, c.controller)
                )
                travel = new.stem_travel / old.stem_travel
                error = new.average_absolute_error / old.average_absolute_error
                assert error <= (LIMITS.trade_error if name == CALMER else 1.0) + 0.01
                assert travel <= (1.0 if name == CALMER else LIMITS.travel_growth_sample) + 0.01
    assert chosen >= len(found)
    assert any(SMALLER in t.chosen for _, t in found)


def test_a_repaired_valve_is_the_process_alone():
    """The forecast for a repaired valve is a simulation in which the stem equals OP."""
    loop = Loop(Fopdt(1.2, 30.0, 3.0), Pid(0.4, 60.0), Backlash(3.0))
    load = 0.3 * np.sin(np.arange(4000) / 300.0)
    (free,) = tried(replace(loop, valve=None), load, {"free": loop.controller})
    r = closed_loop(replace(loop, valve=Backlash(0.0)), np.zeros(load.size), load, op_start=50.0)
    whole = assess(settled(r))
    assert free.stem_travel == pytest.approx(whole.op_travel, rel=1e-6)
    assert free.error == pytest.approx(whole.average_absolute_error, rel=1e-6)


def test_a_slow_lag_with_backlash_is_tuned_as_an_integrator():
    """If load rejection forbids an integral time as long as the lag, a shorter one reduces travel and error."""
    loop = Loop(Fopdt(44.2, 861.0, 3.5), Pid(0.6, 40.0), Backlash(3.0))
    rng = np.random.default_rng(2)
    load = 2.0 * np.sin(np.arange(9000) / 900.0) + 0.02 * rng.standard_normal(9000)
    p = recommend(loop, "valve", corners(loop), load)
    assert p.controller is not None
    assert p.controller.ti_s < loop.process.time_constant_s
    old, new = (
        assess(settled(run(replace(loop, controller=pid), load))) for pid in (loop.controller, p.controller)
    )
    assert new.stem_travel < 0.8 * old.stem_travel
    assert new.average_absolute_error < old.average_absolute_error


@pytest.mark.parametrize("td_s", [0.0, 5.0])
def test_a_derivative_that_stays_is_reported(td_s):
    """The table of settings of a loop with a derivative states that the derivative stays, and all its settings
    have it."""
    spec = LoopSpec("L", kp=0.4, ti=60.0, td=td_s, pv_lo=0.0, pv_hi=100.0)
    loop = Loop(Fopdt(1.2, 30.0, 3.0), Pid(0.4, 60.0, td_s), Backlash(3.0))
    load = 0.3 * np.sin(np.arange(4000) / 300.0)
    found = compared(loop, load, Pid(0.3, 90.0, td_s), 120.0, 100.0, LIMITS)
    assert {t.controller.td_s for t in found.tried} == {td_s}
    assert ("derivative" in page.table(found, spec, "%").note) == (td_s > 0.0)


def test_a_stem_that_rests_has_no_choices():
    """The page of a loop whose stem rests under its load is drawn without choices, cost and repair."""
    spec = LoopSpec("L", kp=0.4, ti=60.0, pv_lo=0.0, pv_hi=100.0)
    loop = Loop(Fopdt(1.2, 30.0, 3.0), Pid(0.4, 60.0), Stiction(40.0, 20.0))
    found = compared(loop, 0.01 * np.sin(np.arange(4000) / 300.0), None, 120.0, 100.0, LIMITS)
    assert found.tried[0].stem_travel == 0.0
    assert (found.curve, dict(found.everywhere), found.repaired) == ((), {}, None)
    assert page.trade_off_plot(found, "%") is None
    assert page.choices(found, spec) == []
    assert page.settings_page("L", "2026-03-02", found, spec).sections


def test_a_derivative_is_offered_only_where_it_reduces_the_error():
    """With backlash a derivative reduces the simulated error by more than 10 % without more travel than
    allowed. It is not offered under noise, or to a loop that has a derivative."""
    rng = np.random.default_rng(2)
    walk = np.cumsum(rng.normal(0.0, 0.02, 20_000))
    load = walk - np.convolve(walk, np.ones(2000) / 2000, "same")
    loop = Loop(Fopdt(1.0, 60.0, 20.0), Pid(1.5, 60.0, scan_s=1.0), Backlash(2.0))
    calm = trade(bench(loop, (loop,), load, LIMITS)).chosen
    offered = calm[DERIVATIVE].controller
    assert offered.td_s > 0.0
    old, new = (
        assess(settled(run(replace(loop, controller=pid), load))) for pid in (loop.controller, offered)
    )
    assert new.average_absolute_error < 0.9 * old.average_absolute_error
    assert new.stem_travel <= LIMITS.travel_growth_sample * old.stem_travel
    noisy = load + rng.normal(0.0, 0.3, load.size)
    assert DERIVATIVE not in trade(bench(loop, (loop,), noisy, LIMITS)).chosen
    has = replace(loop, controller=replace(loop.controller, td_s=4.0))
    assert DERIVATIVE not in trade(bench(has, (has,), load, LIMITS)).chosen
