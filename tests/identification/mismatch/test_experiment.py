"""Experiments in open loop: physics that the baseline model lacks is reported, and the effect of a load is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.controller.check import StatedSettings
from identification.mismatch.answer import answer, open_gain_note
from identification.mismatch.catalogue.supply_variation import AT_REST
from identification.mismatch.diagnosis import explain
from identification.mismatch.recording import Recording, coarser_by, is_experiment
from identification.mismatch.words import TEXTS
from identification.models import Estimate
from proofs.experiments import Plant, answered, carried_misfit, drawn, slow_mode


def test_only_an_open_loop_record_is_an_experiment() -> None:
    """A record of scripted OP moves is an experiment. It is none with a set point, with controller settings, or
    with an OP that follows PV."""
    s, _ = drawn("plain", 3)
    assert is_experiment(s)
    assert not is_experiment(replace(s, sp=np.full(s.pv.size, 50.0)))
    assert not is_experiment(replace(s, stated=StatedSettings(1.0, 20.0)))
    assert not is_experiment(replace(s, op=100.0 - s.pv))


@pytest.mark.parametrize("seed", [41, 42])
def test_a_process_without_an_effect_under_a_slow_load_is_none(seed: int) -> None:
    """A load that varies more slowly than the process responds gives the verdict `none`."""
    found_answer, _ = answered("plain", seed)
    assert found_answer.verdict == "none"


def test_a_slow_mode_is_found_from_one_step_and_carries_over() -> None:
    """The slow creep after a single step is reported as a slow mode. The model halves the misfit of another
    recording."""
    rng, wall = np.random.default_rng(1), Plant(1.0, 15.0, 3.0, 0.2 / 0.375)
    one, other = drawn("plain", 51)
    step = np.where(np.arange(one.op.size) < 200, 50.0, 60.0)
    made = [slow_mode(op, rng, wall) + 0.05 * rng.standard_normal(op.size) for op in (step, other.op)]
    s, later = replace(one, op=step, pv=np.round(made[0], 2)), replace(other, pv=np.round(made[1], 2))
    found = explain(s)
    found_answer = answer(found, s)
    assert found_answer.verdict == "slow-mode"
    assert found_answer.effects[0].parameters["slow_share"].value == pytest.approx(0.2, abs=0.03)
    assert found_answer.effects[0].parameters["slow_time_constant_s"].value == pytest.approx(120.0, rel=0.2)
    before, after = carried_misfit(found, later)
    assert after < 0.5 * before


def test_two_vessels_in_series_carry_over() -> None:
    """For two vessels of which the upper one overflows, the reported effects halve the misfit of another
    recording."""
    s, later = drawn("two vessels", 6)
    found = explain(s)
    names = {e.name for e in answer(found, s).effects}
    assert names & {"overflow", "sqrt-outflow", "second-lag"}
    before, after = carried_misfit(found, later)
    assert after < 0.5 * before


def test_a_long_experiment_is_judged_at_a_coarser_step() -> None:
    """Twelve thousand samples are thinned to every third for a lag of a hundred samples, and not thinned for a
    lag of six."""
    rng = np.random.default_rng(3)
    s, _ = drawn("plain", 5)
    op = np.repeat(50.0 + 8.0 * rng.choice([-1.0, 1.0], 60), 200)

    def after(lag: float) -> int:
        x, pv = 0.0, np.empty(op.size)
        for k in range(op.size):
            pv[k] = x
            x += (op[k] - 50.0 - x) / lag
        pv += 0.05 * rng.standard_normal(op.size)
        return coarser_by(replace(s, op=op, pv=pv, usable=np.ones(op.size, bool)))

    assert after(100.0) == 3
    assert after(6.0) == 1


def test_a_supply_with_an_uncertain_flow_at_rest_is_reported_with_a_caution() -> None:
    """A varying supply is reported without a caution. With a flow at rest of unknown sign, it is reported with
    a caution."""
    s, _ = drawn("wandering supply", 2001)
    found = explain(s)
    found_answer = answer(found, s)
    assert found_answer.verdict == "supply-variation"
    assert not found_answer.caution
    any_sign = replace(
        found_answer.effects[0], parameters={AT_REST.name: Estimate(10.0, -35.0, 55.0, "% OP")}
    )
    assert open_gain_note(found, (any_sign,)) == TEXTS["wanders"]


@pytest.mark.parametrize("seed", [1, 3, 16])
def test_a_load_step_in_an_experiment_is_reported_and_simulated(seed: int) -> None:
    """A load step of 6 % of OP on a lag under manual moves is recovered within its interval. A simulation with
    it has a residual of little more than the noise (a difference equation, not the simulator)."""
    rng, count = np.random.default_rng(seed), 1200
    op = 50.0 + np.repeat(rng.uniform(-6.0, 6.0, count // 60), 60)
    y, wander, pv = 0.0, 0.0, np.empty(count)
    for k in range(count):
        wander = 0.99 * wander + 0.02 * rng.normal()
        pushed = op[max(k - 3, 0)] - 50.0 + (6.0 if k >= 400 else 0.0) + wander
        y += (1.2 * pushed - y) / 12.0
        pv[k] = 50.0 + y + 0.05 * rng.normal()
    s = Recording(None, pv, op, np.ones(count, dtype=bool), 1.0, np.arange(count, dtype=float))
    found = explain(s)
    answered = answer(found, s)
    size = answered.effects[0].parameters["size_1_pct"]
    assert answered.verdict == "load-step"
    assert size.low - 0.1 < 6.0 < size.high + 0.1
    assert size.high > size.low
    assert found.best.loss < 0.05 < 1.0 < found.plain.loss
