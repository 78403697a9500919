"""A small fixed part of benchmarks/world: the causes of simulated loops, and the check of a simulated present
loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.advice.advise import advise, withheld
from analyzer.loop.advice.propose import tuning_model
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.decisions import SignKind
from analyzer.loop.identification.agreement import agreement
from analyzer.loop.identification.identified import load_of
from analyzer.loop.identification.intervals import intervals
from analyzer.loop.record.judged_stretch import controller_of
from analyzer.loop.record.quality import prepare
from benchmarks.world.__main__ import spec_of
from benchmarks.world.draw import HOURS, Drawn, drawn, run
from benchmarks.world.recorder import recorded
from benchmarks.world.settings import outcome
from benchmarks.world.simulate import BACKLASH, Controller, Process, Valve, sensitivity
from identification.models import Pid

START_S = 1_772_409_600.0
PROCESS = Process(1.2, 150.0, 0.0, 15.0)
TIGHT = Drawn("T", "tight", PROCESS, Controller(11.5, 110.0), Valve(), 21, 0.0, 0.0, 1.0, 0.0)
SINE = Drawn("L", "load", PROCESS, Controller(2.5, 150.0), Valve(), 23, 0.0, 260.0, 1.0, 0.0)
BACKLASH_LOOP = Drawn(
    "B", "backlash", PROCESS, Controller(3.5, 40.0), Valve(BACKLASH, 3.0), 24, 0.0, 0.0, 1.0, 0.0
)
FAULT_FREE = Drawn("H", "healthy", PROCESS, Controller(2.5, 150.0), Valve(), 25, 0.0, 0.0, 1.0, 2.0)


def assessed(
    d: Drawn, way: str = "plain", hours: float = 8, scan_s: float | None = 1.0, filter_s: float = 0.0
) -> tuple[Assessment, Pid]:
    """The assessment of some hours of a loop, and the loop's controller. The scan is stated or not; the filter
    of PV is not stated."""
    made = run(d, hours=hours, settings=replace(d.controller, pv_filter_s=filter_s))
    r, spec = recorded(made, way, 1), replace(spec_of(d), scan_s=scan_s)
    stamp, good = START_S + r["stamp_s"], np.zeros(r["pv"].size, dtype=bool)
    found = {f"{d.name}.{role.upper()}": Series(stamp, r[role], good) for role in ("sp", "pv", "op")}
    made = prepare(spec, found, Config().quality)
    pid = controller_of(spec, made)
    assert pid is not None
    return assess(made, pid, Config()), pid


@pytest.mark.parametrize("way", ["plain", "rows missing"])
@pytest.mark.parametrize(("loop", "cause"), [(FAULT_FREE, "none"), (SINE, "load"), (TIGHT, "tuning")])
def test_the_loop_or_its_load_causes_the_oscillation(loop: Drawn, cause: str, way: str) -> None:
    """A badly tuned loop (Ms above 4) has the cause tuning, a well tuned one under a sine the cause load,
    without a sine none. Missing rows do not change the cause."""
    assert (sensitivity(loop.process, loop.controller)[0] > 4.0) == (cause == "tuning")
    assert assessed(loop, way)[0].verdict.cause == cause


@pytest.mark.parametrize(("kind", "seed", "number"), [("backlash", 115, 7), ("load", 117, 2)])
def test_the_likelier_model_or_the_constant_phase_names_the_cause(kind: str, seed: int, number: int) -> None:
    """Backlash is reported where its model explains PV far better than a load does. A sine is reported by its
    constant phase."""
    d = drawn(seed, 8, (kind,))[number]
    verdict = assessed(d, hours=HOURS)[0].verdict
    assert verdict.cause == d.cause
    assert verdict.signs[0].kind is (SignKind.KEPT_PHASE if kind == "load" else SignKind.LIKELIER)


def test_a_simulated_present_loop_is_accepted_only_where_it_agrees() -> None:
    """The identified loop of a valve with backlash has the recorded reversals, error and travel, and is
    accepted. With a derivative action that the plant's controller lacks, its valve moves at least three times
    as much, and it is rejected."""
    found, pid = assessed(BACKLASH_LOOP)
    limits = Config().advice
    assert (found.verdict.cause, found.verdict.fault) == ("valve", "backlash")
    loop, fit, _ = tuning_model(found.verdict, pid, limits)
    load = load_of(fit, pid)
    assert agreement(loop, fit, load).worst(limits) is None
    wrong = replace(loop, controller=replace(pid, td_s=20.0, td_filter=0.0))
    made = agreement(wrong, fit, load)
    assert made.worst(limits) is not None
    assert made.stem_travel > 3.0


@pytest.mark.parametrize("loop", [FAULT_FREE, BACKLASH_LOOP], ids=["fault-free", "backlash"])
def test_a_filter_of_pv_is_recognized_although_stated_gains_agree_without_it(loop: Drawn) -> None:
    """If noise is a small part of OP, the stated gains agree with any filter of PV. The filter is recognized
    nevertheless, and no filter is reported where there is none."""
    behind, plain = (assessed(loop, filter_s=smooth)[0].shown for smooth in (5.0, 0.0))
    assert plain is None
    assert behind is not None
    assert behind.pv_filter_s == pytest.approx(5.0, rel=0.12)


def test_rounding_does_not_prevent_settings() -> None:
    """A record rounded to a tenth of a percent is accepted like the full record. Without moves within one
    digit, its simulated OP travel is the recorded one."""
    found, pid = assessed(BACKLASH_LOOP, "rounded")
    limits = Config().advice
    loop, fit, _ = tuning_model(found.verdict, pid, limits)
    made = agreement(loop, fit, load_of(fit, pid))
    assert made.worst(limits) is None
    assert made.op_travel == pytest.approx(1.0, abs=0.2)


def test_a_stated_scan_replaces_close_rows() -> None:
    """A valve with backlash is recorded in rows slower than a quarter of the integral time. If the scan is
    stated, the control law gives OP between the rows, and settings are computed. Without the scan, settings
    need a sample in each quarter of the integral time."""
    fast = replace(BACKLASH_LOOP, controller=replace(BACKLASH_LOOP.controller, ti_s=36.0))
    found, pid = assessed(fast, "every 10 s", HOURS)
    spec = spec_of(fast)
    assert found.verdict.cause == "valve"
    assert withheld(found, spec, pid, 100.0, Config()) is None
    blind, _ = assessed(fast, "every 10 s", HOURS, scan_s=None)
    kept = withheld(blind, replace(spec, scan_s=None), replace(pid, scan_s=10.0), 100.0, Config())
    assert kept is not None
    assert "a sample every 9 s" in kept.reason


def test_intervals_in_slow_rows_contain_the_true_values() -> None:
    """In rows of 10 s, backlash, slope, gain, time constant and dead time are in their intervals, although OP
    between the rows is unknown. In rows of every scan the same intervals are narrower."""
    slow, fast = (assessed(BACKLASH_LOOP, way, HOURS) for way in ("every 10 s", "plain"))
    p = BACKLASH_LOOP.process
    true = {
        "backlash_pct": BACKLASH_LOOP.valve.band,
        "gain": p.gain,
        "time_constant_s": p.lag_s,
        "dead_time_s": p.dead_s,
    }
    true["slope_pct_per_s"] = p.gain / p.lag_s
    limits = Config().advice
    slow_rows, close = (intervals(found.verdict.fit, True, limits, pid) for found, pid in (slow, fast))
    assert set(true) <= set(slow_rows)
    for name, value in true.items():
        assert slow_rows[name].low <= value <= slow_rows[name].high, name
        assert slow_rows[name].high - slow_rows[name].low > close[name].high - close[name].low, name


def test_backlash_is_reported_in_addition_to_a_load_that_causes_the_oscillation() -> None:
    """Under one sine, a valve with backlash is reported with its width, and a valve without backlash has no
    fault."""
    with_backlash = replace(SINE, kind="worn-sine", valve=Valve(BACKLASH, 2.0))
    verdict, other = (assessed(d)[0].verdict for d in (with_backlash, SINE))
    assert (verdict.fault, other.fault) == ("backlash", "none")
    assert verdict.measured is not None
    assert verdict.measured.backlash.valve.stickband == pytest.approx(2.0, rel=0.15)


def test_models_that_do_not_ring_as_recorded_choose_no_settings() -> None:
    """A tight loop whose models have 84 % of the recorded error gets no settings that raise the error of the
    true plant. The models alone would choose the slowest settings, which double this error."""
    d = drawn(613, 7, ("tight",))[6]
    made = recorded(run(d), "every 10 s", d.seed)
    spec, good = spec_of(d), np.zeros(made["pv"].size, dtype=bool)
    stamp = START_S + made["stamp_s"]
    one = prepare(
        spec,
        {f"{d.name}.{r.upper()}": Series(stamp, made[r], good) for r in ("sp", "pv", "op")},
        Config().quality,
    )
    pid = controller_of(spec, one)
    assert pid is not None
    found = assess(one, pid, Config())
    new = advise(found, spec, pid, 100.0, Config(), record=one.record)
    assert new.kp_new is not None
    error, *_ = outcome(d, replace(d.controller, kp=new.kp_new, ti_s=new.ti_new))
    assert error < 1.0


def test_settings_are_also_tested_on_the_widest_stickband() -> None:
    """A sticking valve identified with half its stickband and three times the dead time gets settings that
    lower the true error. The settings are also tested on the widest stickband that the oscillation allows.
    Without that test they raised the error by 38 %."""
    d = drawn(685, 8, ("stiction",))[2]
    found, pid = assessed(d, hours=HOURS)
    spec = spec_of(d)
    advice = advise(found, spec, pid, 100.0, Config())
    assert found.verdict.fit.valve.stickband < 0.6 * d.valve.band
    assert advice.kp_new is not None
    assert advice.ti_new is not None
    error, travel, *_ = outcome(d, replace(d.controller, kp=advice.kp_new, ti_s=advice.ti_new))
    assert error < 1.0
    assert travel < 0.7


@pytest.mark.parametrize("way", ["every 5 s", "averages"])
def test_a_constant_frequency_is_not_a_valve_fault(way: str) -> None:
    """A load that is a sine keeps its phase over 700 periods, which no limit cycle of a valve does. In rows of
    5 s, backlash explains a fast loop under this load better than a linear model does."""
    d = drawn(689, 4, ("load",))[3]
    verdict = assessed(d, way, hours=HOURS)[0].verdict
    assert (verdict.cause, verdict.fault) == ("load", "none")
    assert verdict.measured is not None
    assert verdict.measured.kept.share > 0.99


@pytest.mark.parametrize(("number", "helped"), [(4, False), (5, True)], ids=["none help", "some help"])
def test_settings_of_a_sticking_valve_are_tested_under_a_whole_day(number: int, helped: bool) -> None:
    """A sticking loop with a period of 20 minutes gets no settings, because settings that look good on a part
    of the day raise the true travel. A loop with a period of 7 minutes gets settings that halve the travel."""
    d = drawn(701, 6, ("stiction",))[number]
    spec, made = spec_of(d), recorded(run(d), "plain", d.seed)
    stamp, good = START_S + made["stamp_s"], np.zeros(made["pv"].size, dtype=bool)
    series = {f"{d.name}.{r.upper()}": Series(stamp, made[r], good) for r in ("sp", "pv", "op")}
    one = prepare(spec, series, Config().quality)
    found = assess(one, controller_of(spec, one), Config())
    assert found.verdict.cause == "valve"
    advice = advise(found, spec, controller_of(spec, one), 100.0, Config(), record=one.record)
    assert (advice.kp_new is not None) == helped
    if advice.kp_new is not None and advice.ti_new is not None:
        error, travel, *_ = outcome(d, replace(d.controller, kp=advice.kp_new, ti_s=advice.ti_new))
        assert error <= 1.0
        assert travel <= 0.5
