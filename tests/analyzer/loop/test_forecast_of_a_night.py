"""The load of a complete night, on which the effect of new settings is forecast."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analyzer.config import Config
from analyzer.loop.advice.propose import tuning_model
from analyzer.loop.advice.sluggish import faster_settings
from analyzer.loop.assess import assess
from analyzer.loop.identification.identified import joined, load_of_night, scan_noise
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.promises import forecast_of
from benchmarks.world.recorder import recorded
from benchmarks.world.settings import outcome
from benchmarks.world.simulate import BACKLASH, Controller, Process, Valve
from identification.estimation.model import Fitted
from identification.estimation.problem import in_blocks
from identification.models import Pid
from identification.record import LoopRecord
from proofs.plant import prepared
from proofs.plant import record as record_of

LAG, VALVE, PID = Process(1.2, 150.0, 0.0, 15.0), Valve(BACKLASH, 3.0), Pid(3.5, 40.0, scan_s=1.0)
WORN = Drawn("B", "backlash", LAG, Controller(PID.kp, PID.ti_s), VALVE, 24, 0.0, 0.0, 1.0, 0.0)
PERIOD_S = 300.0


def by_minute(x: np.ndarray) -> np.ndarray:
    """Means over minutes, minus their mean."""
    x = x[: x.size // 60 * 60].reshape(-1, 60).mean(axis=1)
    return x - x.mean()


@pytest.fixture(scope="module")
def night() -> tuple[LoopRecord, np.ndarray, Fitted]:
    """Ten hours of a worn valve, its true load at PV [% PV], and the fit of the program."""
    made = run(WORN, hours=10)
    late = np.concatenate((np.full(15, made.stem[0]), made.stem))[: made.stem.size]
    pole = np.exp(-1.0 / LAG.lag_s)
    response = lfilter([LAG.gain * (1.0 - pole)], [1.0, -pole], late - made.stem[0])
    found = assess(prepared(made), PID, Config())
    return (
        record_of(made.pv, made.sp, made.op),
        made.pv - response,
        tuning_model(found.verdict, PID, Config().advice)[1],
    )


def test_the_load_of_a_night_is_that_of_the_plant(night: tuple[LoopRecord, np.ndarray, Fitted]) -> None:
    """At least 90 % of the variance of the true load over minutes is reconstructed, over the complete record."""
    record, truth, fit = night
    load = load_of_night(fit, PID, record, PERIOD_S)
    assert load.size == pytest.approx(len(record), rel=0.01)
    true = by_minute(truth[: load.size])
    assert np.var(by_minute(load) - true) < 0.1 * np.var(true)


def test_hours_that_must_not_be_used_have_no_effect(night: tuple[LoopRecord, np.ndarray, Fitted]) -> None:
    """With two hours of a failed transmitter, the load is that of the other hours, without a step between them."""
    record, _, fit = night
    hours = slice(7200, 14_400)
    pv, bad = record.pv.copy(), record.bad.copy()
    pv[hours], bad[hours] = 0.0, True
    whole, less = (load_of_night(fit, PID, r, PERIOD_S) for r in (record, replace(record, pv=pv, bad=bad)))
    assert whole.size - less.size == pytest.approx(7200, abs=30)
    assert np.abs(np.diff(less)).max() < 1.3 * np.abs(np.diff(whole)).max()
    assert np.std(less) < 1.3 * np.std(whole)


def test_parts_are_joined_without_a_step() -> None:
    """The part after a hole begins at the end value of the part before it."""
    usable = np.array([True, True, False, False, True, True])
    np.testing.assert_allclose(joined(np.array([1.0, 2.0, 9.0, 9.0, 7.0, 8.0]), usable), [1.0, 2.0, 2.0, 3.0])


@pytest.mark.parametrize("period", [40.0, 900.0])
def test_noise_is_estimated_while_op_is_free(period: float) -> None:
    """White noise of PV is estimated from OP within 10 %, although OP is at a limit for more than 60 % of the
    time.
    """
    rng, n, size = np.random.default_rng(1), 20_000, 0.1
    noise = size * rng.standard_normal(n)
    op = np.clip(50.0 + 120.0 * np.sin(2 * np.pi * np.arange(n) / period) - 3.0 * noise, 0.0, 100.0)
    assert np.mean((op <= 0.0) | (op >= 100.0)) > 0.6
    problem = in_blocks(50.0 + noise, op, np.ones(n, dtype=bool), 1.0)
    assert scan_noise(problem, Pid(3.0, 100.0, scan_s=1.0)) == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize("way", ["plain", "every 10 s"])
def test_a_forecast_for_a_sluggish_loop_is_right(way: str) -> None:
    """The forecast intervals contain the error and the travel of the true plant with the new settings.

    The forecast uses the process on which the settings are based; with the fit of the slow response alone the loop
    would be unstable.
    """
    d = drawn(592, 3, ("sluggish",))[2]
    record = recorded(run(d), way, d.seed)
    dt_s = float(np.diff(record["stamp_s"][:2])[0])
    pid = Pid(d.controller.kp, d.controller.ti_s, scan_s=1.0)
    found = faster_settings(record_of(record["pv"], record["sp"], record["op"], dt_s), pid, "", Config())
    assert found is not None
    forecast = forecast_of(d, record, {"kp_new": found.new.kp, "ti_new": found.new.ti_s})
    assert forecast is not None
    came = outcome(d, replace(d.controller, kp=found.new.kp, ti_s=found.new.ti_s))
    for estimate, ratio in zip(forecast, came, strict=False):
        assert estimate.low <= ratio - 1.0 <= estimate.high
