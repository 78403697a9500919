"""Loops with a gain alone: new settings also have no integral action, and no search fails."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.loop.advice.advise import Advice, advise
from analyzer.loop.advice.propose import tuning_model
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.identification.agreement import agreement
from analyzer.loop.identification.identified import load_of
from benchmarks.world.draw import Drawn, run
from benchmarks.world.settings import outcome
from benchmarks.world.simulate import BACKLASH, KANO, Controller, Process, Valve
from identification.models import Fopdt, Loop, Pid
from proofs.plant import prepared, spec
from tuning.forecast import run as simulated

LAG, LEVEL, OFF = Process(1.2, 150.0, 0.0, 15.0), Process(0.002, 0.0, 0.0, 15.0), 1e12


def drawn(process: Process, kp: float, valve: Valve) -> Drawn:
    """A loop of the independent simulator with a gain alone."""
    return Drawn("P", "tight", process, Controller(kp, OFF), valve, 21, 0.0, 0.0, 1.0, 0.0)


def advised(d: Drawn, hours: float = 8.0) -> tuple[Assessment, Advice, Pid]:
    """Its assessment, its advice and its controller."""
    pid = Pid(d.controller.kp, math.inf, scan_s=1.0)
    made = prepared(run(d, hours=hours))
    found = assess(made, pid, Config())
    stated = spec(kp=pid.kp, ti=0.0)
    return found, advise(found, stated, pid, 100.0, Config(), record=made.record), pid


@pytest.mark.parametrize(("process", "kp"), [(LAG, 13.5), (LEVEL, 48.0)], ids=["lag", "level"])
def test_a_loop_that_rings_gets_a_gain_alone(process: Process, kp: float) -> None:
    """On the true plant the new gain reduces the stem's travel by 30 %, and the error rises by less than 15 %."""
    d = drawn(process, kp, Valve())
    _, advice, _ = advised(d, 24.0)
    assert advice.action == "retune"
    assert advice.ti_new == 0.0
    error, travel, _, ms = outcome(d, replace(d.controller, kp=advice.kp_new))
    assert travel < 0.7
    assert error < 1.15
    assert ms < 2.2


@pytest.mark.parametrize(
    ("valve", "fault"), [(Valve(BACKLASH, 4.0), "backlash"), (Valve(KANO, 4.0, 2.0), "stiction")]
)
def test_a_worn_valve_is_searched_with_its_gain_alone(valve: Valve, fault: str) -> None:
    """The simulation with the present settings agrees with the record, so the valve is at fault and not the stated
    settings.

    A pair with integral action is not proposed.
    """
    found, advice, pid = advised(drawn(LEVEL, 25.0, valve), 24.0)
    assert (found.verdict.fault, advice.action) == (fault, "repair valve")
    assert "check kp and ti" not in advice.reason
    loop, fit, _ = tuning_model(found.verdict, pid, Config().advice)
    assert agreement(loop, fit, load_of(fit, pid)).worst(Config().advice) is None
    assert advice.ti_new in (None, 0.0)


def test_the_bias_compensates_a_constant_load() -> None:
    """Without integral action, a constant load of 5 % with noise leaves no offset in simulation.

    A step of the load leaves 1 / (1 + K Kp) of it.
    """
    loop = Loop(Fopdt(0.5, 100.0, 10.0), Pid(4.0, math.inf, scan_s=1.0))
    noise = 0.01 * np.random.default_rng(3).standard_normal(8000)
    assert abs(simulated(loop, 5.0 + noise).pv.mean()) < 0.01
    step = simulated(loop, 5.0 + np.repeat([-1.0, 1.0], 4000)).pv
    assert step[[3999, -1]] == pytest.approx([-1.0 / 3.0, 1.0 / 3.0], rel=1e-3)
