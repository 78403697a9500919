"""A cause is reported if its model is clearly more likely than the others; otherwise the missing data are
reported.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analyzer.loop.assess import assess
from analyzer.loop.cause.signs import signs_of
from analyzer.loop.cause.verdict import imbalance, judge, resolve_ambiguity
from analyzer.loop.decisions import Cause, MissingData, SignKind
from analyzer.loop.oscillation.detection import counting
from proofs.plant import CONFIG, Sketch, prepared, simulate

SINE = Sketch("load", (1.4, 90.0, 10.0), 0.8, 60.0, sine=1.0, sine_s=840.0, load_std=0.05)


@pytest.fixture(scope="module")
def loaded():
    """A robust loop under a sinusoidal load, prepared and assessed."""
    made = prepared(simulate(SINE, 8.0))
    return made, assess(made, SINE.controller, CONFIG)


def verdict_with(loaded, kurtosis=1.5, ms=1.3, **changed):
    """The verdict on the well damped loop with other gains of its models [nat], as in a night."""
    made, found = loaded
    m, cycle = replace(found.verdict.measured, kurtosis=kurtosis), counting(found.oscillations)
    verdict = judge(replace(m, ringing=replace(m.ringing, ms=ms, **changed)), cycle, CONFIG.cause)
    return resolve_ambiguity(verdict, made, cycle, CONFIG.cause)


@pytest.mark.parametrize(("share", "cause"), [(0.5, "undecided"), (0.9, "undecided"), (1.1, "load")])
def test_a_load_is_reported_if_it_is_likely(loaded, share, cause):
    """A load that leads by less than the penalty of its constants is not reported, and a test in manual is required.

    The confidences are probabilities: their sum is at most 100 %, and an undecided one is below 50 %.
    """
    penalty = 1.5 * np.log(loaded[1].verdict.measured.ringing.smooth.count)
    found = verdict_with(loaded, line_nat=share * penalty)
    assert found.cause == cause
    assert (found.needs is not None and found.needs.lack is MissingData.MANUAL_TEST) == (cause == "undecided")
    assert sum(found.confidence.values()) <= 100.0 + 1e-9
    assert (found.confidence[Cause.LOAD] < 50.0) == (cause == "undecided")


def test_a_line_that_does_not_keep_its_phase_is_no_external_load(loaded):
    """A line of the same likelihood that keeps its phase for only two periods names no load.

    Noise through a resonance keeps its phase as long.
    """
    lined = loaded[1].verdict.measured.ringing.lined
    assert verdict_with(loaded, line_nat=200.0).cause == "load"
    forgets = replace(lined, line=replace(lined.line, kept=2.0))
    assert verdict_with(loaded, line_nat=200.0, lined=forgets).cause == "undecided"


def test_a_cycle_that_changes_its_size_has_no_load_of_constant_size(loaded):
    """With the kurtosis of noise, 3, instead of 1.5 of a sine, a periodic load is not named."""
    assert verdict_with(loaded, line_nat=200.0).cause == "load"
    assert verdict_with(loaded, kurtosis=3.0, line_nat=200.0).cause == "undecided"


def test_a_loop_near_its_limit_of_stability_is_no_explanation_of_a_sine(loaded):
    """A model that rings with a sensitivity of 60 predicts the next sample of a sine as well as a line does.

    Noise through it would not keep a constant size (Rice 1945), so the load is named.
    """
    m = loaded[1].verdict.measured
    same = {"ms": 60.0, "line_nat": 0.5, "period_s": m.ringing.cycle_s}
    assert verdict_with(loaded, **same).cause == "load"
    assert verdict_with(loaded, line_nat=0.5).cause == "undecided"


def test_a_line_that_explains_less_than_a_faulty_valve_is_no_load(loaded):
    """A periodic load that gains 100 nat is not named if a faulty valve gains 300 nat under a free noise model.

    It is named if the backlash is too narrow for a cycle of the range of OP.
    """
    found = loaded[1]
    cycle = counting(found.oscillations)
    ringing = replace(found.verdict.measured.ringing, ms=1.3, line_nat=100.0, valve_nat=5.0)
    m = replace(found.verdict.measured, ringing=ringing, kurtosis=1.5)
    cases = (5.0, 0.5), (300.0, 0.5), (300.0, 0.05)
    verdicts = [judge(replace(m, evidence=nat, size=size), cycle, CONFIG.cause).cause for nat, size in cases]
    assert verdicts == ["load", "undecided", "load"]


def test_no_valve_fault_is_reported_without_its_own_evidence(loaded):
    """A faulty valve that is likely under a smooth load is not named if the free noise model has no evidence for
    it.
    """
    verdict = verdict_with(loaded, valve_nat=500.0)
    assert verdict.cause != "valve"
    assert verdict.confidence[Cause.VALVE] < 50.0


def test_a_model_rings_at_the_period_of_a_cycle_within_the_row_interval(loaded):
    """In rows of a second, a model that rings 20 % slower has another period.

    With ten rows per cycle it has the same period, because its dead time is known only to a row.
    """
    ringing, limits = loaded[1].verdict.measured.ringing, CONFIG.cause
    slower = replace(ringing, ms=5.0, period_s=1.2 * ringing.cycle_s)
    assert not replace(slower, row_s=1.0).rings(limits)
    assert replace(slower, row_s=0.1 * ringing.cycle_s).rings(limits)


def test_a_valve_causes_no_cycle_at_a_period_at_which_its_loop_attenuates_loads():
    """At its limit cycle the harmonic balance of a level with backlash is -1 (Gelb, Vander Velde 1968).

    At a period twenty times as long its loop gain is large, no backlash satisfies the balance, and none is the cause.
    """
    worn = Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5)
    found = assess(prepared(simulate(worn, 6.0)), worn.controller, CONFIG).verdict
    assert found.cause == "valve"
    assert imbalance(found.measured) < 0.1
    assert imbalance(replace(found.measured, scale_s=20.0 * found.measured.scale_s)) > CONFIG.cause.imbalance


@pytest.mark.parametrize(("size", "strong"), [(0.05, False), (0.6, True)])
def test_evidence_of_a_fault_too_small_for_op_counts_little(loaded, size, strong):
    """Evidence of 60 nat for a fault of 5 % of the range of OP is weak.

    A constant size is then no sign of the valve. For a fault of 60 % of the range, the evidence is strong and the
    constant size is a sign.
    """
    _, found = loaded
    m, cycle = found.verdict.measured, counting(found.oscillations)
    signs = {s.kind: s for s in signs_of(replace(m, evidence=60.0, size=size), cycle, CONFIG.cause)}
    assert (signs[SignKind.EVIDENCE].strength > 0.9) == strong
    assert (signs[SignKind.REGULARITY].points_to is Cause.VALVE) == strong
