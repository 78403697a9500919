"""Advice from a verdict: the model that settings are sought on, its uncertainty, the load, and abstentions."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from analyzer.loop.advice.advise import advise, propose, sought_for
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
SWUNG = Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.3, sine=3.0, sine_s=300.0)


def assessed(sketch: Sketch, hours: float = 3.0) -> Assessment:
    """One night of a sketch."""
    return assess(prepared(simulate(sketch, hours)), sketch.controller, CONFIG)


@pytest.fixture(scope="module")
def tank() -> Assessment:
    """A tank whose time constant outlasts what the record tells."""
    return assessed(TANK)


@pytest.fixture(scope="module")
def pipe() -> Assessment:
    """A lag of 150 s with play, whose record tells the time constant."""
    return assessed(PIPE, 6.0)


def settings(found: Assessment, sketch: Sketch, **stated: object):
    """The advice on one assessed sketch."""
    row = spec(kp=sketch.kp, ti=sketch.ti, **stated)
    return advise(found, row, sketch.controller, 100.0, CONFIG)


def test_play_before_a_known_lag_gets_ti_of_at_least_the_lag(pipe):
    """With play before a lag that the record tells, Ti is at least the lag and the gain about kept."""
    advice = settings(pipe, PIPE)
    assert advice.action == "retune"
    assert advice.ti_new > 0.8 * PIPE.process[1]
    assert LIMITS.gain_down * 0.99 < advice.kp_new / PIPE.kp < LIMITS.gain_up * 1.01


def test_unknown_lag_is_sought_as_an_integrator(tank):
    """Where the record tells gain over time constant alone, settings are sought for an integrator of that slope."""
    fit = tank.verdict.fit
    assert lag_factor(fit, True, CONFIG.advice) is None
    process = tuned(fit, True, CONFIG.advice)
    assert isinstance(process, Integrator)
    assert process.slope == pytest.approx(TANK.process[0] / TANK.process[1], rel=0.1)


def test_known_lag_is_sought_as_a_lag(pipe):
    """Where the record tells the time constant, settings are sought for that lag, within a quarter."""
    process = tuned(pipe.verdict.fit, True, CONFIG.advice)
    assert isinstance(process, Fopdt)
    assert process.time_constant_s == pytest.approx(PIPE.process[1], rel=0.25)


def test_proposal_is_stable_on_the_true_process(tank, pipe):
    """On the true process the proposal's Ms stays below 2.5."""
    for found, sketch in ((tank, TANK), (pipe, PIPE)):
        new = propose(
            found.verdict, sketch.controller, found.oscillations.first.period_s, CONFIG
        ).proposal.controller
        loop = sought_for(found.verdict, sketch.controller, CONFIG.advice)[0]
        true = replace(loop, process=Fopdt(*sketch.process), controller=new)
        assert maximum_sensitivity(true) < LIMITS.ms_most_sample


def test_samples_spread_about_the_fit(tank):
    """Samples keep the sign and kind of the process; their slopes spread no more than threefold about the fit's."""
    loop, fit, _ = sought_for(tank.verdict, TANK.controller, CONFIG.advice)
    samples = uncertain(fit, loop, 40)
    ratio = np.array([one.process.slope / loop.process.slope for one in samples])
    assert all(isinstance(one.process, Integrator) for one in samples)
    assert (ratio >= 0.333).all()
    assert (ratio <= 3.001).all()
    assert np.median(ratio) == pytest.approx(1.0, abs=0.1)


def test_same_seed_same_samples(tank):
    """The same night gets the same advice twice."""
    assert settings(tank, TANK) == settings(tank, TANK)


def test_load_keeps_the_noise_of_a_scan(tank):
    """The reconstructed load moves from scan to scan by the noise that was put in, though blocks have lost it."""
    m = tank.verdict.measured
    fit = tank.verdict.fit
    assert scan_noise(m.window, TANK.controller) == pytest.approx(TANK.noise, rel=0.15)
    load = load_of(fit, TANK.controller)
    assert np.isfinite(load).all()
    jumps = np.median(np.abs(np.diff(load, 2))) * 1.4826 / math.sqrt(6)
    assert jumps == pytest.approx(TANK.noise, rel=0.3)


@pytest.mark.parametrize(
    ("filter_s", "rounding"), [(0.0, 0.0), (5.0, 0.0), (20.0, 0.0), (20.0, 0.001), (0.0, 0.05)]
)
def test_noise_is_read_behind_a_filter_of_pv(filter_s: float, rounding: float) -> None:
    """White noise of PV is read from OP within a tenth, whatever filter the controller has before it, and OP's
    rounding is no noise."""
    rng, n, size = np.random.default_rng(1), 20_000, 0.1
    noise, seen, last = size * rng.standard_normal(n), np.empty(n), 0.0
    for k in range(n):
        last += (noise[k] - last) / (1.0 + filter_s)
        seen[k] = last
    op = 50.0 - 3.0 * seen + np.sin(2 * np.pi * np.arange(n) / 900.0)
    op = np.round(op / rounding) * rounding if rounding else op
    window = in_blocks(50.0 + noise, op, np.ones(n, dtype=bool), 1.0)
    assert scan_noise(window, Pid(3.0, 100.0, scan_s=1.0, pv_filter_s=filter_s)) == pytest.approx(
        size, rel=0.1
    )


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize(("td", "narrow", "filter_s"), [(16.0, 8.0, 0.0), (30.0, 10.0, 3.0), (0.0, 8.0, 3.0)])
def test_noise_is_read_behind_a_derivative(td: float, narrow: float, filter_s: float, every: int) -> None:
    """White noise of PV is read from OP within a tenth behind a PID too, also from one scan in four: a derivative
    makes several times as much of it in OP as the gain does."""
    rng, n, size = np.random.default_rng(1), 80_000, 0.1
    noise, op, seen, last, slope = size * rng.standard_normal(n), np.empty(n), 0.0, 0.0, 0.0
    lag_s = td / narrow
    for k in range(n):
        seen += (noise[k] - seen) / (1.0 + filter_s)
        slope = (lag_s * slope + td * (seen - last)) / (lag_s + 1.0)
        last = seen
        op[k] = 50.0 - 3.0 * (seen + slope)
    op += np.sin(2 * np.pi * np.arange(n) / 900.0)
    window = in_blocks(50.0 + noise[::every], op[::every], np.ones(n // every, dtype=bool), float(every))
    pid = Pid(3.0, 100.0, td, scan_s=1.0, td_filter=narrow, pv_filter_s=filter_s)
    assert scan_noise(window, pid) == pytest.approx(size, rel=0.1)


def test_mirror_image_gets_mirrored_settings(pipe):
    """With OP turned about and a direct-acting controller, the advice is the same with the gain's sign turned."""
    trends = simulate(PIPE, 6.0)
    turned = replace(PIPE, kp=-PIPE.kp)
    other = assess(prepared(replace(trends, op=100 - trends.op)), turned.controller, CONFIG)
    one, mirrored = settings(pipe, PIPE), settings(other, turned)
    assert mirrored.action == one.action == "retune"
    assert mirrored.kp_new == pytest.approx(-one.kp_new, rel=0.05)
    assert mirrored.ti_new == pytest.approx(one.ti_new, rel=0.1)


def test_units_and_form_of_the_plant(pipe):
    """In minutes and proportional band the advice is the one in seconds and percent, converted."""
    plain = settings(pipe, PIPE)
    other = settings(pipe, PIPE, ti_unit="min", gain_unit="band")
    assert other.ti_new == pytest.approx(plain.ti_new / 60, rel=0.01)
    assert other.kp_new == pytest.approx(100 / plain.kp_new, rel=0.01)


def test_load_is_left_alone():
    """A loop that a machine swings gets the action to find the disturbance, and no settings."""
    found = assessed(SWUNG)
    advice = settings(found, SWUNG)
    assert found.verdict.cause == "load"
    assert (advice.action, advice.kp_new, advice.ti_new) == ("find disturbance", None, None)
    assert propose(found.verdict, SWUNG.controller, 300.0, CONFIG).proposal.action == "find disturbance"


def test_no_cause_no_settings(pipe):
    """Verdicts without a cause and verdicts that abstain get no settings."""
    row = spec(kp=1.0, ti=10.0)
    asked = [
        replace(pipe, verdict=v)
        for v in (NO_CAUSE, not_assessed(Requirement(MissingData.OP, RequirementKind.OP)))
    ]
    assert [advise(a, row, Pid(1, 10), 100.0, CONFIG).action for a in asked] == ["none", "needs data"]


def test_a_calm_loop_is_left_alone(pipe):
    """A loop with play that does not oscillate gets no settings, for at its own nothing cycles; its valve, worn all
    the same, is for the next shutdown."""
    advice = settings(replace(pipe, oscillations=Oscillations()), PIPE)
    assert (advice.action, advice.due) == ("repair valve", "next shutdown")
    assert (advice.kp_new, advice.ti_new) == (None, None)


def test_one_hour_is_a_hint():
    """One hour of a plainly cycling loop: its cause at 75 % at most, no settings, and what they would need."""
    found = assessed(PIPE, 1.0)
    assert found.verdict.cause == "valve"
    assert max(found.verdict.confidence.values()) == 75
    advice = settings(found, PIPE)
    assert (advice.action, advice.kp_new) == ("needs data", None)
    assert "2 good hours" in advice.reason


@pytest.mark.parametrize(("every", "action"), [(15, "repair valve"), (5, "retune")])
def test_a_sample_for_each_half_of_ti_gives_no_settings(every, action):
    """At 15 s a sample a loop with Ti 30 s, whose scan is not stated, gets no settings but what they would need, and
    its worn valve is stroked all the same, for that needs none; at 5 s it gets some."""
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


def test_cycles_too_fast_for_the_sampling_are_not_denied():
    """Below three samples a cycle a cycling loop is not said to be calm: what it takes to see is said."""
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


def test_stale_settings_are_told_and_nothing_is_advised():
    """A loop that runs at another gain and Ti than stated is told so, both pairs in the controller's own units."""
    stated = replace(PIPE, kp=PIPE.kp / 2, ti=3 * PIPE.ti)
    found = assess(prepared(simulate(PIPE, 6.0)), stated.controller, CONFIG)
    row = spec(kp=100 / stated.kp, ti=stated.ti / 60, ti_unit="min", gain_unit="band")
    advice = advise(found, row, stated.controller, 100.0, CONFIG)
    assert (advice.action, advice.kp_new, advice.ti_new) == ("check settings", None, None)
    assert f"stated Kp {100 / stated.kp:.3g} % band, Ti {stated.ti / 60:.3g} min" in advice.reason
    told = re.search(r"recorded about Kp ([\d.]+) % band, Ti ([\d.]+) min", advice.reason)
    assert told is not None
    assert float(told[1]) == pytest.approx(100 / PIPE.kp, rel=0.1)
    assert float(told[2]) == pytest.approx(PIPE.ti / 60, rel=0.15)


def test_a_model_beyond_its_record_gets_no_advice(pipe):
    """A fit whose dead time is a third of the record gets no settings, and its reason says why."""
    m = pipe.verdict.measured
    late = m.play.moved(dead_time_s=m.window.duration_s / 3)
    verdict = replace(pipe.verdict, measured=replace(m, play=late), fault="backlash")
    p = propose(verdict, PIPE.controller, 100.0, CONFIG).proposal
    assert p.controller is None
    assert "dead time" in p.reason


def test_unstated_settings_are_asked_for(pipe):
    """Without kp and ti there are no new ones, and the reason says what is missing; the valve is told anyway."""
    advice = advise(pipe, spec(), None, 100.0, CONFIG)
    assert advice.action == "repair valve"
    assert "no kp and ti" in advice.reason


def test_settings_are_not_asked_for_where_they_would_help_nothing(pipe):
    """On a record that bears no settings the reason is the record, stated kp and ti or not."""
    packed = replace(
        pipe, for_settings=Requirement(MissingData.UNCOMPRESSED, RequirementKind.UNCOMPRESSED, (90.0,))
    )
    reasons = {advise(packed, spec(), pid, 100.0, CONFIG).reason for pid in (None, PIPE.controller)}
    assert reasons == {f"no new settings: {packed.for_settings}"}


def test_wrong_sign_is_told(pipe):
    """A gain of the wrong sign gets no settings and says that the controller would act the wrong way."""
    turned = replace(PIPE.controller, kp=-PIPE.kp)
    p = propose(pipe.verdict, turned, 100.0, CONFIG).proposal
    assert (p.action, p.controller) == ("check settings", None)
    assert "wrong way" in p.reason


def test_integral_off_is_told(pipe):
    """Without integral action, as stated, a loop that cycles by it is sent to check its settings."""
    p = propose(pipe.verdict, replace(PIPE.controller, ti_s=math.inf), 100.0, CONFIG).proposal
    assert (p.action, p.controller) == ("check settings", None)
    assert "check kp and ti" in p.reason


def test_play_is_the_model_where_it_cycles_by_itself(tank):
    """Where the loop with the identified play cycles, that play is the model, and so are its samples."""
    loop, fit, others = sought_for(tank.verdict, TANK.controller, CONFIG.advice)
    assert loop.valve == Backlash(fit.valve.stickband)
    assert all(isinstance(one.valve, Backlash) for one in others)


def test_a_calm_loop_witnesses_no_width_that_its_stretches_do_not_bear_out(pipe):
    """Stick-slip that was tried on a calm loop is not told slip by slip: its width is none where single stretches
    alone speak for it."""
    m = pipe.verdict.require_measured
    tried = m.play.moved(valve=m.play.valve._replace(sliding=0.25 * m.play.valve.stickband))
    single = replace(m, stick_slip=tried, steady=0.0, asked=0.0)
    calm = replace(pipe.verdict, measured=single, steady=None)
    said = json.loads(witness(calm, False, prepared(simulate(PIPE, 6.0)), CONFIG) or "")
    assert "slope" in said
    assert "width" not in said
    assert max(said["profile"]) == 0.0


def test_loops_that_a_cycle_cannot_tell_apart_have_its_loop_gain(pipe):
    """The product of process and describing function at the cycle is that of the fitted loop, for a process that
    integrates, behind a valve as wide and a wider one; the load is what each leaves of the same record."""
    fit, period_s = pipe.verdict.fit, pipe.oscillations.first.period_s
    loop = sought_for(pipe.verdict, PIPE.controller, CONFIG.advice)[0]
    late = 0.25 * period_s  # an integrator and a wider valve take their phase from the dead time
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
