"""Forecasts: assessments against closed forms, intervals, and present and new settings under the same load."""

from dataclasses import replace

import numpy as np
import pytest

from identification.models import Backlash, Fopdt, Loop, Pid, Stiction
from identification.record import LoopRecord
from identification.simulation.closed_loop import closed_loop
from proofs.valve_loops import backlash_case, corners, stick_case
from tuning.forecast import NAMES, assess, autocorrelation_peak, predict, run, settled
from tuning.rules import backlash_rule


def record(error, stem):
    n = error.size
    return LoopRecord("x", 0.0, 1.0, np.zeros(n), -error, 2 * stem, np.zeros(n, bool), position=stem)


def test_assessments_of_a_sine():
    """A sine of amplitude 1 has a mean absolute value of 2/pi, 2 sigma of 1.414, oscillation 1 and a travel of
    4 amplitudes per period."""
    t = np.arange(36_000)
    sine = np.sin(2 * np.pi * t / 100)
    a = assess(record(sine, sine))
    assert a.average_absolute_error == pytest.approx(2 / np.pi, rel=1e-3)
    assert a.variability == pytest.approx(np.sqrt(2), rel=1e-3)
    assert a.oscillation == pytest.approx(1.0, rel=0.01)
    assert a.stem_travel == pytest.approx(4 * 36, rel=1e-3)
    assert a.op_travel == pytest.approx(8 * 36, rel=1e-3)


def test_noise_does_not_oscillate():
    """White noise and constants have almost no oscillation."""
    noise = np.random.default_rng(0).normal(size=20_000)
    assert autocorrelation_peak(noise) < 0.05
    assert autocorrelation_peak(np.full(500, 3.0)) == 0.0


def test_forecast_of_the_same_tuning_is_no_change():
    """A forecast of the present tuning has no change, and the interval of the change is zero."""
    case = backlash_case(0)
    f = predict(case.loop, case.loop.controller, case.load)
    for name in NAMES:
        assert f.change[name].value == 0.0
        assert (f.change[name].low, f.change[name].high) == (0.0, 0.0)


def test_forecast_of_the_rule_reduces_travel():
    """With the rule for backlash the whole interval of the travel change is below -20 %, also with uncertainty
    samples. The oscillation decreases."""
    case = backlash_case(1)
    new = backlash_rule(case.loop.process, case.loop.controller)
    f = predict(case.loop, new, case.load, corners(case.loop))
    assert f.change["stem_travel"].high < -0.2
    assert f.change["oscillation"].value < 0
    for name in NAMES:
        for e in (f.before[name], f.after[name], f.change[name]):
            assert e.low <= e.value <= e.high


def test_intervals_cover_the_long_run():
    """The 90 % interval of the error on a short load covers the error on a long load in at least 15 of 20
    draws."""
    loop = Loop(Fopdt(1.0, 20, 2), Pid(2.0, 20))
    rng = np.random.default_rng(5)

    def load(n):
        return np.convolve(rng.normal(size=n + 200), np.exp(-np.arange(200) / 20), "valid")[:n]

    truth = (
        predict(loop, replace(loop.controller, kp=1.0), load(200_000)).before["average_absolute_error"].value
    )
    hits = 0
    for _ in range(20):
        e = predict(loop, replace(loop.controller, kp=1.0), load(6000)).before["average_absolute_error"]
        hits += e.low <= truth <= e.high
    assert hits >= 15


def test_intervals_cover_the_next_record():
    """The 90 % interval from one record covers the change in the next record in at least 34 of 40 pairs. The
    load is slow: each record has only about twenty load moves."""
    loop, rng, hits = Loop(Fopdt(1.0, 20, 2), Pid(2.0, 20)), np.random.default_rng(6), 0
    new = replace(loop.controller, kp=1.0)
    for _ in range(40):
        moves = np.repeat(rng.normal(size=60) * rng.lognormal(0.0, 0.8, 60), 200)
        loads = np.split(moves + 0.02 * rng.normal(size=12_000), 2)
        first, second = (predict(loop, new, x).change["average_absolute_error"] for x in loads)
        hits += first.low <= second.value <= first.high
    assert hits >= 34


def test_short_load_is_refused():
    """A load with too few scans is an error that states how many scans are needed."""
    case = backlash_case(0)
    with pytest.raises(ValueError, match="needs 120 scans of load, has 50"):
        predict(case.loop, case.loop.controller, case.load[:50])


def test_quiet_load_does_not_hide_an_oscillation():
    """Under a load that is too small to move the stem from rest, an oscillating loop is still forecast to
    oscillate."""
    loop = Loop(Fopdt(80, 200, 1), Pid(1.0, 10.0), Backlash(1.0))
    quiet = 0.002 * np.random.default_rng(0).normal(size=4000)
    f = predict(loop, Pid(1.0, 220.0), quiet)
    assert f.before["stem_travel"].value == pytest.approx(65.9, rel=0.05)
    assert f.after["stem_travel"].value < 5
    assert f.before["oscillation"].value > 0.3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rounding_errors_change_no_forecast(seed):
    """A sticking stem amplifies rounding errors, but a change in the last digit of load, process or valve does
    not change the forecast."""
    case = stick_case(seed)
    new = replace(case.loop.controller, kp=0.6 * case.loop.controller.kp)
    process, valve, near = case.loop.process, case.loop.valve, 1 + 1e-11
    once = predict(case.loop, new, case.load)
    others = (
        replace(case.loop, process=replace(process, time_constant_s=process.time_constant_s * near)),
        replace(case.loop, valve=replace(valve, stickband=valve.stickband * near)),
        replace(case.loop, valve=replace(valve, slip_jump=valve.slip_jump * near)),
    )
    for other in others:
        again = predict(other, new, case.load + 1e-13)
        assert (again.before, again.after) == (once.before, once.after)


def changed_during_oscillation(loop, new, load):
    """Stem travel [%] under new settings after the loop has oscillated under the present settings, with the
    same load.

    In plain Python: a PI controller in position form, a stem that rests after each slip, and a FOPDT process.
    """
    p, valve = loop.process, loop.valve
    away, rest = 0.5 * (valve.stickband + valve.slip_jump), 0.5 * (valve.stickband - valve.slip_jump)
    pipe, pole = [0.0] * round(p.dead_time_s), np.exp(-1.0 / p.time_constant_s)
    x, stem, total, travel, before = 0.0, 0.0, 0.0, 0.0, 0.0
    for k, moved in enumerate(np.concatenate((load, load))):
        c = loop.controller if k < load.size else new
        if k == load.size:
            total += (loop.controller.kp - new.kp) * before
        before = -(x + moved + (3.0 if k < 300 else 0.0))
        total += c.kp / c.ti_s * before
        op = total + c.kp * before
        if abs(op - stem) > away:
            place = op - np.copysign(rest, op - stem)
            travel += abs(place - stem) if k >= load.size + load.size // 4 else 0.0
            stem = place
        pipe.append(stem)
        x = pole * x + (1.0 - pole) * p.gain * pipe.pop(0)
    return travel


def test_a_sticking_stem_that_oscillates_continues():
    """A sticking loop rests if it starts at rest, and oscillates if it oscillated before. The forecast for the
    oscillating loop has the travel within 40 %. The period depends on where the stem's jumps are relative to
    the load."""
    loop = Loop(Fopdt(1.23, 65.0, 11.0), Pid(2.3, 70.6), Stiction(1.29, 0.56))
    new = replace(loop, controller=Pid(1.97, 138.0))
    simulated, forecast = [], []
    for seed in range(3):
        noise = 0.015 * np.random.default_rng(seed).standard_normal(12_000)
        simulated.append(changed_during_oscillation(loop, new.controller, noise))
        forecast.append(float(np.abs(np.diff(settled(run(new, noise)).stem)).sum()))
        rested = closed_loop(new, np.zeros(noise.size), noise, op_start=50.0).stem
        assert float(np.ptp(rested)) == 0.0
    assert min(simulated) > 20.0
    assert np.mean(forecast) == pytest.approx(np.mean(simulated), rel=0.4)
