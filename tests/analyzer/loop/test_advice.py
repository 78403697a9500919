"""Advice for a verdict: the tuning model, its uncertainty, the load, and cases without advice."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from analyzer.loop.advice.advise import advise
from analyzer.loop.advice.propose import propose, tuning_model
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.cause.verdict import NO_CAUSE, not_assessed
from analyzer.loop.conclusion import concluded
from analyzer.loop.decisions import MissingData, Requirement, RequirementKind
from analyzer.loop.identification.identified import indistinguishable, load_of, scan_noise, tuned, uncertain
from analyzer.loop.identification.intervals import lag_factor
from analyzer.loop.oscillation.detection import Oscillations
from analyzer.loop.record.quality import prepare
from analyzer.loop.witness import witness
from analyzer.store.rows import night_row
from identification.estimation.problem import in_blocks
from identification.models import Backlash, Fopdt, Integrator, Pid
from proofs.plant import CONFIG, START_S, Sketch, prepared, series, simulate, spec
from tuning.describing import describe
from tuning.frequency_response import maximum_sensitivity
from tuning.limits import LIMITS

ROLES = ("sp", "pv", "op")
TANK = Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5)
PIPE = Sketch("valve", (12.0, 150.0, 6.0), 0.65, 30.0, backlash=2.5, load_std=0.1)
OSCILLATING_LOAD = Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.3, sine=3.0, sine_s=300.0)


def assessed(sketch: Sketch, hours: float = 3.0) -> Assessment:
    """One night of a sketch."""
    return assess(prepared(simulate(sketch, hours)), sketch.controller, CONFIG)


@pytest.fixture(scope="module")
def tank() -> Assessment:
    """A tank whose time constant is too long to be identified from the record."""
    return assessed(TANK)


@pytest.fixture(scope="module")
def pipe() -> Assessment:
    """A lag of 150 s with backlash, whose record identifies the time constant."""
    return assessed(PIPE, 6.0)


def settings(found: Assessment, sketch: Sketch, **stated: object):
    """The advice for one assessed sketch."""
    row = spec(kp=sketch.kp, ti=sketch.ti, **stated)
    return advise(found, row, sketch.controller, 100.0, CONFIG)


def test_backlash_before_a_known_lag_gets_ti_of_at_least_the_lag(pipe):
    """With backlash before an identifiable lag, Ti is at least about the lag and the gain is about kept."""
    advice = settings(pipe, PIPE)
    assert advice.action == "retune"
    assert advice.ti_new > 0.8 * PIPE.process[1]
    assert LIMITS.gain_down * 0.99 < advice.kp_new / PIPE.kp < LIMITS.gain_up * 1.01


def test_unknown_lag_is_modelled_as_an_integrator(tank):
    """If the record identifies only gain over time constant, settings are computed for an integrator of that
    slope.
    """
    fit = tank.verdict.fit
    assert lag_factor(fit, True, CONFIG.advice) is None
    process = tuned(fit, True, CONFIG.advice)
    assert isinstance(process, Integrator)
    assert process.slope == pytest.approx(TANK.process[0] / TANK.process[1], rel=0.1)


def test_known_lag_is_modelled_as_a_lag(pipe):
    """If the record identifies the time constant, settings are computed for that lag, which is right within 25 %."""
    process = tuned(pipe.verdict.fit, True, CONFIG.advice)
    assert isinstance(process, Fopdt)
    assert process.time_constant_s == pytest.approx(PIPE.process[1], rel=0.25)


def test_proposal_is_stable_on_the_true_process(tank, pipe):
    """On the true process the proposal's Ms stays below 2.5."""
    for found, sketch in ((tank, TANK), (pipe, PIPE)):
        new = propose(
            found.verdict, sketch.controller, found.oscillations.first.period_s, CONFIG
        ).proposal.controller
        loop = tuning_model(found.verdict, sketch.controller, CONFIG.advice)[0]
        true = replace(loop, process=Fopdt(*sketch.process), controller=new)
        assert maximum_sensitivity(true) < LIMITS.ms_most_sample


def test_samples_spread_about_the_fit(tank):
    """Samples keep the sign and the kind of the process; their slopes are within a factor of three of the fit."""
    loop, fit, _ = tuning_model(tank.verdict, TANK.controller, CONFIG.advice)
    samples = uncertain(fit, loop, 40)
    ratio = np.array([one.process.slope / loop.process.slope for one in samples])
    assert all(isinstance(one.process, Integrator) for one in samples)
    assert (ratio >= 0.333).all()
    assert (ratio <= 3.001).all()
    assert np.median(ratio) == pytest.approx(1.0, abs=0.1)


def test_same_seed_same_samples(tank):
    """The same night gives the same advice twice."""
    assert settings(tank, TANK) == settings(tank, TANK)


def test_load_keeps_the_noise_of_a_scan(tank):
    """The reconstructed load has the simulated noise from scan to scan, although block means have lost it."""
    m = tank.verdict.measured
    fit = tank.verdict.fit
    assert scan_noise(m.problem, TANK.controller) == pytest.approx(TANK.noise, rel=0.15)
    load = load_of(fit, TANK.controller)
    assert np.isfinite(load).all()
    jumps = np.median(np.abs(np.diff(load, 2))) * 1.4826 / math.sqrt(6)
    assert jumps == pytest.approx(TANK.noise, rel=0.3)


@pytest.mark.parametrize(
    ("filter_s", "rounding"), [(0.0, 0.0), (5.0, 0.0), (20.0, 0.0), (20.0, 0.001), (0.0, 0.05)]
)
def test_noise_is_estimated_with_a_filter_of_pv(filter_s: float, rounding: float) -> None:
    """White noise of PV is estimated from OP within 10 % for each PV filter of the controller; rounding of OP is no
    noise.
    """
    rng, n, size = np.random.default_rng(1), 20_000, 0.1
    noise, seen, last = size * rng.standard_normal(n), np.empty(n), 0.0
    for k in range(n):
        last += (noise[k] - last) / (1.0 + filter_s)
        seen[k] = last
    op = 50.0 - 3.0 * seen + np.sin(2 * np.pi * np.arange(n) / 900.0)
    op = np.round(op / rounding) * rounding if rounding else op
    problem = in_blocks(50.0 + noise, op, np.ones(n, dtype=bool), 1.0)
    assert scan_noise(problem, Pid(3.0, 100.0, scan_s=1.0, pv_filter_s=filter_s)) == pytest.approx(
        size, rel=0.1
    )


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize(("td", "narrow", "filter_s"), [(16.0, 8.0, 0.0), (30.0, 10.0, 3.0), (0.0, 8.0, 3.0)])
def test_noise_is_estimated_with_a_derivative(td: float, narrow: float, filter_s: float, every: int) -> None:
    """White noise of PV is estimated from OP within 10 % with a PID too, also from one scan in four.

    A derivative makes several times as much noise in OP as the gain does.
    """
    rng, n, size = np.random.default_rng(1), 80_000, 0.1
    noise, op, seen, last, slope = size * rng.standard_normal(n), np.empty(n), 0.0, 0.0, 0.0
    lag_s = td / narrow
    for k in range(n):
        seen += (noise[k] - seen) / (1.0 + filter_s)
        slope = (lag_s * slope + td * (seen - last)) / (lag_s + 1.0)
        last = seen
        op[k] = 50.0 - 3.0 * (seen + slope)
    op += np.sin(2 * np.pi * np.arange(n) / 900.0)
    problem = in_blocks(50.0 + noise[::every], op[::every], np.ones(n // every, dtype=bool), float(every))
    pid = Pid(3.0, 100.0, td, scan_s=1.0, td_filter=narrow, pv_filter_s=filter_s)
    assert scan_noise(problem, pid) == pytest.approx(size, rel=0.1)


def test_mirror_image_gets_mirrored_settings(pipe):
    """With OP mirrored and a direct-acting controller, the advice is the same with the other sign of the gain."""
    trends = simulate(PIPE, 6.0)
    turned = replace(PIPE, kp=-PIPE.kp)
    other = assess(prepared(replace(trends, op=100 - trends.op)), turned.controller, CONFIG)
    one, mirrored = settings(pipe, PIPE), settings(other, turned)
    assert mirrored.action == one.action == "retune"
    assert mirrored.kp_new == pytest.approx(-one.kp_new, rel=0.05)
    assert mirrored.ti_new == pytest.approx(one.ti_new, rel=0.1)


def test_units_and_form_of_the_plant(pipe):
    """In minutes and proportional band, the advice is the converted advice in seconds and percent."""
    plain = settings(pipe, PIPE)
    other = settings(pipe, PIPE, ti_unit="min", gain_unit="band")
    assert other.ti_new == pytest.approx(plain.ti_new / 60, rel=0.01)
    assert other.kp_new == pytest.approx(100 / plain.kp_new, rel=0.01)


def test_load_is_left_alone():
    """A loop that oscillates because of a load gets the action to find the disturbance, and no settings."""
    found = assessed(OSCILLATING_LOAD)
    advice = settings(found, OSCILLATING_LOAD)
    assert found.verdict.cause == "load"
    assert (advice.action, advice.kp_new, advice.ti_new) == ("find disturbance", None, None)
    assert (
        propose(found.verdict, OSCILLATING_LOAD.controller, 300.0, CONFIG).proposal.action
        == "find disturbance"
    )


def test_no_cause_no_settings(pipe):
    """Verdicts without a cause and verdicts that lack data get no settings."""
    row = spec(kp=1.0, ti=10.0)
    cases = [
        replace(pipe, verdict=v)
        for v in (NO_CAUSE, not_assessed(Requirement(MissingData.OP, RequirementKind.OP)))
    ]
    assert [advise(a, row, Pid(1, 10), 100.0, CONFIG).action for a in cases] == ["none", "needs data"]


def test_a_calm_loop_is_left_alone(pipe):
    """A loop with backlash that does not oscillate gets no settings.

    Its worn valve is still to be repaired at the next shutdown.
    """
    advice = settings(replace(pipe, oscillations=Oscillations()), PIPE)
    assert (advice.action, advice.due) == ("repair valve", "next shutdown")
    assert (advice.kp_new, advice.ti_new) == (None, None)


def test_one_hour_is_a_hint():
    """One hour of a clearly oscillating loop gives its cause with at most 75 %, no settings, and the missing data."""
    found = assessed(PIPE, 1.0)
    assert found.verdict.cause == "valve"
    assert max(found.verdict.confidence.values()) == 75
    advice = settings(found, PIPE)
    assert (advice.action, advice.kp_new) == ("needs data", None)
    assert "2 good hours" in advice.reason


@pytest.mark.parametrize(("every", "action"), [(15, "repair valve"), (5, "retune")])
def test_a_sample_for_each_half_of_ti_gives_no_settings(every, action):
    """At a sample every 15 s, a loop with Ti 30 s and no stated scan gets no settings.

    The repair of its worn valve is still advised, and the reason states the required interval. At 5 s the loop gets
    settings.
    """
    t = simulate(PIPE, 24.0)
    thin = {
        f"L.{n.upper()}": series(START_S + np.arange(0.0, t.pv.size, every), getattr(t, n)[::every])
        for n in ROLES
    }
    controller = replace(PIPE.controller, scan_s=float(every))
    found = assess(prepare(spec("L"), thin, CONFIG.quality), controller, CONFIG)
    advice = advise(found, spec(kp=PIPE.kp, ti=PIPE.ti), controller, 100.0, CONFIG)
    assert advice.action == action
    assert ("sample every 7.5 s" in advice.reason) == (action == "repair valve")


def test_cycles_too_fast_for_the_sampling_are_not_excluded():
    """With fewer than three samples per cycle, an oscillating loop is not reported as steady; the required
    sampling is reported.
    """
    t = simulate(TANK, 24.0)
    every = 90
    thin = {
        f"L.{n.upper()}": series(START_S + np.arange(0.0, t.pv.size, every), getattr(t, n)[::every])
        for n in ROLES
    }
    found = assess(prepare(spec("L"), thin, CONFIG.quality), TANK.controller, CONFIG)
    assert found.oscillations.first is None
    assert "has one every 90 s" in str(found.needs)
    advice = settings(found, TANK)
    assert (advice.action, advice.reason) == ("needs data", str(found.needs))
    row = night_row(concluded(found, advice, spec("L"), "2026-03-02", CONFIG.advice))
    assert row["oscillating_pct"] is None
    assert row["cause"] == "undecided"


def test_outdated_settings_are_reported_without_advice():
    """A loop that runs with other settings than stated is reported, with both pairs in the controller's own units."""
    stated = replace(PIPE, kp=PIPE.kp / 2, ti=3 * PIPE.ti)
    found = assess(prepared(simulate(PIPE, 6.0)), stated.controller, CONFIG)
    row = spec(kp=100 / stated.kp, ti=stated.ti / 60, ti_unit="min", gain_unit="band")
    advice = advise(found, row, stated.controller, 100.0, CONFIG)
    assert (advice.action, advice.kp_new, advice.ti_new) == ("check settings", None, None)
    assert f"stated Kp {100 / stated.kp:.3g} % band, Ti {stated.ti / 60:.3g} min" in advice.reason
    recorded = re.search(r"recorded about Kp ([\d.]+) % band, Ti ([\d.]+) min", advice.reason)
    assert recorded is not None
    assert float(recorded[1]) == pytest.approx(100 / PIPE.kp, rel=0.1)
    assert float(recorded[2]) == pytest.approx(PIPE.ti / 60, rel=0.15)


def test_a_model_beyond_its_record_gets_no_advice(pipe):
    """A fit whose dead time is a third of the record gets no settings, and the reason says why."""
    m = pipe.verdict.measured
    late = m.backlash.moved(dead_time_s=m.problem.duration_s / 3)
    verdict = replace(pipe.verdict, measured=replace(m, backlash=late), fault="backlash")
    p = propose(verdict, PIPE.controller, 100.0, CONFIG).proposal
    assert p.controller is None
    assert "dead time" in p.reason


def test_unstated_settings_are_requested(pipe):
    """Without kp and ti there are no new settings, and the reason says so; the valve fault is still reported."""
    advice = advise(pipe, spec(), None, 100.0, CONFIG)
    assert advice.action == "repair valve"
    assert "no kp and ti" in advice.reason


def test_settings_are_not_requested_if_they_would_not_help(pipe):
    """If the record does not allow settings, the reason is the record, with or without stated kp and ti."""
    packed = replace(
        pipe, for_settings=Requirement(MissingData.UNCOMPRESSED, RequirementKind.UNCOMPRESSED, (90.0,))
    )
    reasons = {advise(packed, spec(), pid, 100.0, CONFIG).reason for pid in (None, PIPE.controller)}
    assert reasons == {f"no new settings: {packed.for_settings}"}


def test_wrong_sign_is_reported(pipe):
    """A gain of the wrong sign gets no settings, and the reason says that the controller would act the wrong way."""
    turned = replace(PIPE.controller, kp=-PIPE.kp)
    p = propose(pipe.verdict, turned, 100.0, CONFIG).proposal
    assert (p.action, p.controller) == ("check settings", None)
    assert "wrong way" in p.reason


def test_missing_integral_action_is_reported(pipe):
    """If no integral action is stated for a loop that oscillates by integral action, its settings are to be
    checked.
    """
    p = propose(pipe.verdict, replace(PIPE.controller, ti_s=math.inf), 100.0, CONFIG).proposal
    assert (p.action, p.controller) == ("check settings", None)
    assert "check kp and ti" in p.reason


def test_backlash_is_in_the_model_if_it_causes_a_cycle(tank):
    """If the loop oscillates with the identified backlash, that backlash is in the model and in all its samples."""
    loop, fit, others = tuning_model(tank.verdict, TANK.controller, CONFIG.advice)
    assert loop.valve == Backlash(fit.valve.stickband)
    assert all(isinstance(one.valve, Backlash) for one in others)


def test_a_loop_without_a_cycle_stores_no_width_from_single_stretches(pipe):
    """For a loop without a cycle, stick-slip does not count as evidence, and no width is stored, if only single
    stretches support it.
    """
    m = pipe.verdict.require_measured
    tried = m.backlash.moved(valve=m.backlash.valve._replace(sliding=0.25 * m.backlash.valve.stickband))
    single = replace(m, stick_slip=tried, steady=0.0, response_nat=0.0)
    calm = replace(pipe.verdict, measured=single, steady=None)
    evidence = json.loads(witness(calm, False, prepared(simulate(PIPE, 6.0)), CONFIG) or "")
    assert "slope" in evidence
    assert "width" not in evidence
    assert max(evidence["profile"]) == 0.0


def test_loops_that_a_cycle_does_not_distinguish_have_its_loop_gain(pipe):
    """The product of process and describing function at the cycle is that of the fitted loop.

    This holds for an integrating process with a valve of equal width and with a wider one; each has its own residual
    load.
    """
    fit, period_s = pipe.verdict.fit, pipe.oscillations.first.period_s
    loop = tuning_model(pipe.verdict, PIPE.controller, CONFIG.advice)[0]
    # An integrator and a wider valve have less phase lag, which the dead time replaces.
    late = 0.25 * period_s
    fit = fit.moved(dead_time_s=fit.dead_time_s + late)
    loop = replace(loop, process=replace(loop.process, dead_time_s=loop.process.dead_time_s + late))
    swing, omega = 0.5 * fit.p.cycle_range, 2.0 * math.pi / period_s

    def product(one):
        p = one.process
        lag = p.gain * np.exp(-1j * omega * p.dead_time_s) / (1.0 + 1j * omega * p.time_constant_s)
        return lag * describe(one.valve, swing)

    found = indistinguishable(fit, loop, period_s)
    widths = [one.valve.width for one, _ in found]
    assert widths[0] == fit.valve.stickband
    assert widths[1] > 1.05 * widths[0]
    for one, load in found:
        assert one.process.time_constant_s > 5.0 * period_s
        assert product(one) == pytest.approx(product(loop), rel=1e-6)
        assert load.std() > 0.0
