"""Recommended settings: what they preserve, what they improve, and when none are given."""

import math
from dataclasses import replace

import numpy as np
import pytest

import tuning.first_step
import tuning.recommend
from identification.models import Backlash, Fopdt, Integrator, Loop, Pid, Stiction
from identification.signals.spectrum import spectrum
from proofs.valve_loops import backlash_case, corners, level_case, load, stick_case
from tuning.forecast import assess, run, settled
from tuning.frequency_response import integral_s, maximum_sensitivity, resonance_s
from tuning.limit_cycle import confirm
from tuning.limits import LIMITS
from tuning.ringing import error_ratio, from_ringing, observed_ringing, process_of, sensitivity_at
from tuning.rules import backlash_rule, simc
from tuning.search import allowed, rejection

STUDY = Loop(Fopdt(80, 200, 1), Pid(1, 10), Backlash(1.0))


def recommend(loop, cause, uncertainty=None, **known):
    """The recommendation for a loop; its uncertainty samples are the corners unless others are given."""
    others = corners(loop) if uncertainty is None else uncertainty
    return tuning.recommend.recommend(loop, cause, others, **known)


def figures(loop, controller, load):
    """Stem travel [%/h] and average absolute error [% PV] with a controller on a load."""
    a = assess(settled(run(replace(loop, controller=controller), load)))
    return a.stem_travel, a.average_absolute_error


def test_rule_for_backlash_reduces_stem_travel():
    """Ti := max(Ti, T) at the same gain reduces stem travel by more than half on average of ten random loops
    with backlash."""
    cuts = []
    for seed in range(10):
        case = backlash_case(seed)
        old, _ = figures(case.loop, case.loop.controller, case.load)
        new, _ = figures(case.loop, backlash_rule(case.loop.process, case.loop.controller), case.load)
        cuts.append(1 - new / old)
    assert min(cuts) > 0
    assert np.mean(cuts) > 0.5


@pytest.fixture(scope="module")
def proposals():
    """Recommendations for six loops each with backlash, stick-slip and backlash on an integrator."""
    makers = (backlash_case, stick_case, level_case)
    cases = [maker(seed) for maker in makers for seed in range(6)]
    return [(c, recommend(c.loop, "valve", load=c.load)) for c in cases]


def test_proposals_keep_robustness_and_load_rejection(proposals):
    """Every recommendation keeps the limits of Ms, on the loop and on all corners, and the stated factors of
    load rejection."""
    for case, p in proposals:
        if p.controller is None:
            continue
        assert maximum_sensitivity(replace(case.loop, controller=p.controller)) <= LIMITS.ms_most
        for one in corners(case.loop):
            assert maximum_sensitivity(replace(one, controller=p.controller)) <= LIMITS.ms_most_sample
        most, got = allowed(case.loop, LIMITS), rejection(case.loop.process, p.controller)
        assert got.peak <= most.peak
        assert got.integral <= most.integral * (1 + 1e-9)


def test_proposals_have_no_limit_cycle_or_a_smaller_one(proposals):
    """Simulated without noise, recommended settings have no limit cycle, or one with less travel and an allowed
    amplitude."""
    for case, p in proposals:
        if p.controller is None:
            continue
        after = confirm(replace(case.loop, controller=p.controller)).cycle
        before = confirm(case.loop).cycle
        if after is not None:
            growth = (
                LIMITS.cycle_growth_stick if isinstance(case.loop.valve, Stiction) else LIMITS.cycle_growth
            )
            assert after.stem_travel <= before.stem_travel
            assert after.pv_amplitude <= growth * before.pv_amplitude


def test_proposals_travel_less_than_the_rule_for_backlash(proposals):
    """With backlash, recommended settings have less travel than the rule, and no more error than the present
    settings."""
    shares = []
    for case, p in proposals[:6]:
        assert p.action == "retune"
        old, error = figures(case.loop, case.loop.controller, case.load)
        new, new_error = figures(case.loop, p.controller, case.load)
        rule, _ = figures(case.loop, backlash_rule(case.loop.process, case.loop.controller), case.load)
        shares.append((new / old, rule / old))
        assert new_error <= error
        assert p.controller.ti_s >= case.loop.process.time_constant_s * 0.995
    assert np.mean([s[0] for s in shares]) < 0.15
    assert np.mean([s[0] for s in shares]) < np.mean([s[1] for s in shares])


def test_stick_slip_travels_less(proposals):
    """Where stick-slip is retuned, stem travel or error decreases, and the error does not increase."""
    found = [(c, p) for c, p in proposals[6:12] if p.action == "retune"]
    assert found
    for case, p in found:
        old, error = figures(case.loop, case.loop.controller, case.load)
        new, new_error = figures(case.loop, p.controller, case.load)
        assert new < old or new_error < 0.9 * error
        assert new_error <= error * 1.001
        assert "Tuning cannot end stick-slip" in p.reason


def test_settings_near_the_present_ones_must_halve_travel():
    """Settings near the present ones are recommended only if they halve travel. For other settings a reduction
    of a fifth is enough, so some sticking valves get settings under the usual limits only."""
    near = replace(LIMITS, near_gain=10.0, near_time=100.0)
    pairs = []
    for case in (stick_case(seed) for seed in range(6)):
        usual, strict = (recommend(case.loop, "valve", load=case.load, limits=x) for x in (LIMITS, near))
        travels = [
            next(c.travel for c in p.candidates if c.controller == p.controller) if p.controller else None
            for p in (usual, strict)
        ]
        pairs.append(travels)
    assert all(strict is None or strict <= 0.5 for _, strict in pairs)
    assert any(usual is not None and strict is None for usual, strict in pairs)


def test_reason_for_an_integrating_level_names_what_ends_the_cycle(proposals):
    """On an integrator the limit cycle remains, with a longer period, and the reason names P-only control and a
    gap."""
    found = [p for _, p in proposals[12:] if p.action == "retune"]
    assert len(found) >= 4
    for p in found:
        assert p.after.cycle.period_s > p.before.cycle.period_s
        assert "P control or a gap" in p.reason


def test_study_level_loop():
    """The study's level loop gets a Ti of at least T and more than half its gain, and rests."""
    p = recommend(STUDY, "valve")
    assert p.action == "retune"
    assert p.controller.ti_s >= 200
    assert 0.5 < p.controller.kp <= 1.1
    assert p.after.cycle is None
    assert p.before.cycle.period_s == pytest.approx(38.0, abs=0.05)
    assert "38 s" in p.reason


def test_sign_is_a_mirror():
    """A process of negative gain with a direct-acting controller gets the mirrored recommendation."""
    case = backlash_case(3)
    loop = case.loop
    other = Loop(
        replace(loop.process, gain=-loop.process.gain),
        replace(loop.controller, kp=-loop.controller.kp),
        loop.valve,
    )
    a, b = recommend(loop, "valve", load=case.load), recommend(other, "valve", load=case.load)
    assert a.controller.kp == -b.controller.kp
    assert a.controller.ti_s == b.controller.ti_s


def test_uncertainty_samples_are_respected():
    """A sample with 2.5 times the slope keeps the gain low, and the recommended settings are stable on it."""
    steep = replace(STUDY, process=Fopdt(200, 200, 1))
    p = recommend(STUDY, "valve", uncertainty=[steep])
    if p.controller is not None:
        assert maximum_sensitivity(replace(steep, controller=p.controller)) <= LIMITS.ms_most_sample


def test_tight_tuning_gets_simc():
    """A loop at three times its nominal gain gets SIMC's settings, with Ms below its limit and the same sign."""
    for sign in (1.0, -1.0):
        process = Fopdt(sign * 1.5, 100, 8)
        nominal = simc(process, scan_s=1.0)
        p = recommend(Loop(process, replace(nominal, kp=3 * nominal.kp)), "tuning")
        assert p.action == "retune"
        assert p.controller.kp == pytest.approx(nominal.kp, rel=0.01)
        assert p.controller.ti_s == pytest.approx(nominal.ti_s, rel=0.01)
        assert p.ms < LIMITS.ms_most < p.ms_before


def test_a_derivative_stays_as_it_is_and_robust():
    """A tight loop with a derivative gets a gain and an integral time that are robust with this derivative."""
    process = Fopdt(1.0, 60.0, 10.0)
    nominal = simc(process, scan_s=1.0)
    loop = Loop(process, replace(nominal, kp=3 * nominal.kp, td_s=6.0))
    p = recommend(loop, "tuning")
    assert p.controller is not None
    assert p.controller.td_s == loop.controller.td_s
    assert maximum_sensitivity(replace(loop, controller=p.controller)) <= LIMITS.ms_most


def test_tight_loop_gets_the_robust_settings_of_least_error_on_its_load():
    """If the load is known, a tight loop gets robust SIMC settings with no more error than the settings without
    this knowledge."""
    process = Fopdt(1.5, 100, 8)
    nominal = simc(process, scan_s=1.0)
    loop = Loop(process, replace(nominal, kp=3 * nominal.kp))
    fast = load(np.random.default_rng(3), 6000, 1.0, 10.0, 0.02)
    unknown, known = recommend(loop, "tuning"), recommend(loop, "tuning", load=fast)
    _, error = figures(loop, unknown.controller, fast)
    _, less = figures(loop, known.controller, fast)
    assert less <= error
    assert known.ms <= LIMITS.ms_most


def test_robustness_costs_at_most_the_stated_error():
    """Under a slow load, robust settings for a tight loop raise the error by at most tight_error_growth. The reason
    states this, and the loop is more robust."""
    process = Fopdt(1.5, 100, 8)
    nominal = simc(process, scan_s=1.0)
    loop = Loop(process, replace(nominal, kp=2 * nominal.kp))
    slow = load(np.random.default_rng(3), 6000, 1.0, 300.0, 0.02)
    p = recommend(loop, "tuning", load=slow)
    assert p.controller is not None
    (_, before), (_, after) = (figures(loop, pid, slow) for pid in (loop.controller, p.controller))
    assert 1.0 < after / before <= 1.01 * LIMITS.tight_error_growth
    assert maximum_sensitivity(replace(loop, controller=p.controller)) < maximum_sensitivity(loop)
    assert "average absolute error" in p.reason


def test_a_tight_loop_is_made_robust_though_its_error_hardly_falls():
    """Robust settings for a tight loop are recommended also if they hardly lower the error, because robustness
    is the aim."""
    process = Fopdt(1.5, 100, 8)
    nominal = simc(process, scan_s=1.0)
    loop = Loop(process, replace(nominal, kp=3.2 * nominal.kp))
    p = recommend(loop, "tuning", load=load(np.random.default_rng(3), 6000, 1.0, 20.0, 0.02))
    assert p.action == "retune"
    assert p.ms <= LIMITS.ms_most


@pytest.mark.parametrize("corner_s", [10.0, 40.0])
def test_a_fast_load_does_not_switch_control_off(corner_s):
    """Under a load that the loop only amplifies, gain and travel decrease without more error. The gain stays
    above lambda tuning with three dead times, because another day's load may be slower."""
    process = Fopdt(1.5, 100, 8)
    nominal = simc(process, scan_s=1.0)
    loop = Loop(process, replace(nominal, kp=3 * nominal.kp))
    fast = load(np.random.default_rng(3), 6000, 1.0, corner_s, 0.02)
    p = recommend(loop, "tuning", load=fast)
    (travel, now), (less, error) = (figures(loop, pid, fast) for pid in (loop.controller, p.controller))
    assert error <= now
    assert less < 0.7 * travel
    assert p.controller.kp >= 0.98 * 100 / (
        1.5 * 4 * 8.5
    )  # T / (K (lambda + L)), half a scan counts as dead time


def test_gain_with_backlash_stays_near_the_present(proposals):
    """With backlash the gain stays within the stated factors, unless it was above the nominal gain."""
    for case, p in proposals[:6]:
        nominal = simc(case.loop.process, scan_s=1.0).kp
        low = min(LIMITS.gain_down * abs(case.loop.controller.kp), LIMITS.gain_down_backlash * abs(nominal))
        assert low * 0.99 <= abs(p.controller.kp) <= LIMITS.gain_up * abs(case.loop.controller.kp) * 1.01


def test_robust_loop_is_not_called_tight():
    """A loop at nominal tuning with the cause tuning gets the action undecided, and the reason states its Ms."""
    process = Fopdt(1.5, 100, 8)
    p = recommend(Loop(process, simc(process, scan_s=1.0)), "tuning")
    assert p.action == "undecided"
    assert "Ms 1." in p.reason


def test_a_load_gets_no_settings():
    """With the cause load, no settings are recommended."""
    p = recommend(STUDY, "load")
    assert (p.action, p.controller) == ("find disturbance", None)
    assert "Look upstream" in p.reason


@pytest.mark.parametrize(("cause", "action"), [("none", "none"), ("undecided", "undecided")])
def test_without_a_cause_nothing_changes(cause, action):
    """Without a cause no settings are recommended."""
    p = recommend(STUDY, cause)
    assert (p.action, p.controller) == (action, None)
    assert p.reason


def test_wide_backlash_needs_a_repair():
    """Backlash above the limit gets the action to repair, with temporary settings and no permanent ones."""
    p = recommend(replace(STUDY, valve=Backlash(14.0)), "valve")
    assert p.action == "repair valve"
    assert p.controller is None
    assert p.meanwhile is not None
    assert "cannot compensate" in p.reason


def test_refusals_state_their_reason():
    """A wrong sign, a valve of unknown size, an unknown cause and a load with a missing value are refused with
    a reason."""
    assert recommend(replace(STUDY, controller=Pid(-1, 10)), "valve").action == "check settings"
    assert "wrong way" in recommend(replace(STUDY, controller=Pid(-1, 10)), "valve").reason
    assert "settings need a size" in recommend(replace(STUDY, valve=None), "valve").reason
    with pytest.raises(ValueError, match="cause is one of"):
        recommend(STUDY, "gremlins")
    with pytest.raises(ValueError, match="1 of its 5000 values"):
        recommend(STUDY, "valve", load=np.r_[np.nan, np.zeros(4999)])


@pytest.mark.parametrize("ti", [0.0, math.inf])
def test_a_loop_without_integral_action_is_handled(ti):
    """A loop without integral action gets finite settings or none, like any other loop."""
    loop = Loop(Fopdt(2, 60, 4), Pid(2, ti), Backlash(1.0))
    assert math.isinf(integral_s(loop.controller))
    p = recommend(loop, "valve")
    assert p.controller is None or math.isfinite(p.controller.ti_s)


def test_extremes_do_not_raise():
    """Very small and very large gains, no dead time, and scans longer than the dead time give a recommendation
    with a reason."""
    for process in (Fopdt(1e-3, 5, 0), Fopdt(500, 1000, 0.2), Integrator(1e-4, 60), Fopdt(1, 3, 40)):
        for kp in (0.01, 1.0, 50.0):
            p = recommend(Loop(process, Pid(kp, 20, scan_s=2.0), Stiction(1.5, 0.9)), "valve")
            assert p.reason
            assert (p.controller is not None) == (p.action == "retune")


def test_a_first_step_is_between_present_and_robust_settings():
    """If the dead time is uncertain, the recommended gain is between the present and the robust gain."""
    process = Fopdt(1.5, 100, 8)
    nominal = simc(process, scan_s=1.0)
    loop = Loop(process, replace(nominal, kp=3 * nominal.kp, ti_s=0.4 * nominal.ti_s))
    fast = load(np.random.default_rng(3), 6000, 1.0, 10.0, 0.02)
    robust, half = (recommend(loop, "tuning", load=fast, halfway=h).controller for h in (False, True))
    assert robust.kp < half.kp < loop.controller.kp
    assert loop.controller.ti_s <= half.ti_s


def ringing(process, ti=40.0):
    """A PI controller for which a lag with dead time is at its stability limit, and the period [s], from L(jw)
    = -1."""
    at = [Loop(process, Pid(kp, ti)) for kp in np.geomspace(0.01, 100.0, 2000)]
    kp = max(loop.controller.kp for loop in at if math.isfinite(maximum_sensitivity(loop)))
    omega = np.geomspace(1e-3, 1.0, 200_000)
    s = 1j * omega
    response = kp * (1 + 1 / (ti * s)) * process.gain * np.exp(-process.dead_time_s * s)
    response /= 1 + process.time_constant_s * s
    return Pid(kp, ti), 2 * math.pi / omega[np.argmin(np.abs(1 + response))]


def test_the_observed_ringing_gives_the_sensitivity_of_new_settings():
    """At the stability limit, half the gain gives a sensitivity of 2 at the period of the ringing, for every
    process."""
    old, period = ringing(Fopdt(1.5, 120.0, 9.0))
    half = replace(old, kp=old.kp / 2)
    assert sensitivity_at(old, half, period) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize("ti", [20.0, 40.0, 120.0])
@pytest.mark.parametrize("dead_time", [9.0, 40.0, 120.0])
def test_settings_from_the_ringing_alone_are_robust(dead_time, ti):
    """Settings that are robust for an integrator with the same ringing are also robust for a lag with any dead
    time."""
    process = Fopdt(1.5, 120.0, dead_time)
    old, period = ringing(process, ti)
    steps = [x for share in (0.5, 0.67) for x in from_ringing(old, period, share)]
    integrator = process_of(old, period)
    calm = [x for x in steps if maximum_sensitivity(Loop(integrator, x)) <= tuning.first_step.CALM_MS]
    assert calm
    assert max(maximum_sensitivity(Loop(process, x)) for x in calm) < 5.0


def test_settings_that_ring_on_at_the_observed_period_are_not_proposed():
    """If the model has far less gain than the observed ringing shows, the settings come from the ringing and
    not from the model."""
    true = Fopdt(1.5, 120.0, 9.0)
    old, period = ringing(true)
    weak = Loop(Fopdt(0.1, 400.0, 20.0), old)
    from_model = tuning.recommend.recommend(weak, "tuning").new
    assert maximum_sensitivity(Loop(true, from_model)) > 5.0
    swing = np.sin(2 * np.pi * np.arange(0.0, 40 * period) / period)
    seen = tuning.recommend.recommend(weak, "tuning", seen=observed_ringing(period, spectrum(swing, 1.0)))
    assert maximum_sensitivity(Loop(true, seen.new)) < 1.25 / (1 - 2 / 3)
    assert "rings at" in seen.reason
    assert seen.ms is None


@pytest.mark.parametrize("corner_s", [10.0, 300.0, 3000.0, 30_000.0])
@pytest.mark.parametrize("gain", [8.0, 10.0])
def test_the_spectrum_of_the_recorded_error_predicts_the_new_error(corner_s, gain):
    """Under fast and slow loads, the error predicted from the spectrum is between 95 and 125 % of the simulated
    error."""
    loop = Loop(Fopdt(1.5, 120.0, 9.0), Pid(gain, 120.0))
    walk = load(np.random.default_rng(5), 40_000, 1.0, corner_s, 0.0)
    before = run(loop, walk).error[4000:]
    new = from_ringing(loop.controller, resonance_s(loop), 0.67)[-1]
    after = run(replace(loop, controller=new), walk).error[4000:]
    predicted = error_ratio(loop.controller, new, observed_ringing(resonance_s(loop), spectrum(before, 1.0)))
    true = np.std(after) / np.std(before)
    assert 0.95 * true < predicted < 1.25 * true


def test_a_first_step_is_a_mirror_under_the_other_sign():
    """A loop with the opposite sign of process and controller gets the mirrored first step."""
    old, period = ringing(Fopdt(1.5, 120.0, 9.0))
    seen = observed_ringing(period, spectrum(np.sin(2 * np.pi * np.arange(0.0, 40 * period) / period), 1.0))
    found = []
    for way in (1.0, -1.0):
        weak = Loop(Fopdt(0.1 * way, 400.0, 20.0), replace(old, kp=way * old.kp))
        found.append(tuning.recommend.recommend(weak, "tuning", seen=seen).new)
    assert found[0] is not None
    assert (found[0].kp, found[0].ti_s) == (-found[1].kp, found[1].ti_s)


def test_settings_are_no_worse_on_an_indistinguishable_loop():
    """Settings for a lag raise the error of an integrator with a slow load, unless this loop is included in the
    search."""
    rng = np.random.default_rng(7)
    lag = Loop(Fopdt(0.4, 165, 31), Pid(8.9, 70), Backlash(4.7))
    level = replace(lag, process=Fopdt(7.5, 2800, 17), valve=Backlash(5.4))
    fast, slow = (load(rng, 12000, size, corner, 0.02) for corner, size in ((60.0, 0.3), (3000.0, 1.5)))
    alone = recommend(lag, "valve", (), load=fast).new
    tried = recommend(lag, "valve", (), load=fast, indistinguishable=[(level, slow)]).new
    before, *after = (figures(level, pid, slow)[1] for pid in (lag.controller, alone, tried))
    assert after[0] > 1.15 * before
    assert after[1] < before
