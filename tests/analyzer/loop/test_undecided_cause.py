"""A cause is told where its model is clearly more likely than the others; else the missing data are."""

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


def told(loaded, kurtosis=1.5, ms=1.3, **changed):
    """The verdict on the loop, well damped, with other gains of its models [nat], as a night gives it."""
    made, found = loaded
    m, cycle = replace(found.verdict.measured, kurtosis=kurtosis), counting(found.oscillations)
    verdict = judge(replace(m, ringing=replace(m.ringing, ms=ms, **changed)), cycle, CONFIG.cause)
    return resolve_ambiguity(verdict, made, cycle, CONFIG)


@pytest.mark.parametrize(("share", "cause"), [(0.5, "undecided"), (0.9, "undecided"), (1.1, "load")])
def test_a_load_is_told_where_it_is_likely(loaded, share, cause):
    """A load that leads by less than the penalty of its constants is not told, and a test in manual is asked for; the
    confidences are those of chances: they sum to 100 % at most, and an undecided one is under 50 %."""
    penalty = 1.5 * np.log(loaded[1].verdict.measured.ringing.smooth.count)
    found = told(loaded, line_nat=share * penalty)
    assert found.cause == cause
    assert (found.needs is not None and found.needs.lack is MissingData.MANUAL_TEST) == (cause == "undecided")
    assert sum(found.confidence.values()) <= 100.0 + 1e-9
    assert (found.confidence[Cause.LOAD] < 50.0) == (cause == "undecided")


def test_a_line_that_forgets_its_phase_is_no_load_from_outside(loaded):
    """The same likelihood of a line that keeps its phase for two periods names no load: noise through a resonance
    keeps it as long."""
    lined = loaded[1].verdict.measured.ringing.lined
    assert told(loaded, line_nat=200.0).cause == "load"
    forgets = replace(lined, line=replace(lined.line, kept=2.0))
    assert told(loaded, line_nat=200.0, lined=forgets).cause == "undecided"


def test_a_cycle_that_changes_its_size_has_no_load_of_constant_size(loaded):
    """With the kurtosis of noise, 3, where a sine has 1.5, a periodic load is not named."""
    assert told(loaded, line_nat=200.0).cause == "load"
    assert told(loaded, kurtosis=3.0, line_nat=200.0).cause == "undecided"


def test_a_loop_near_its_limit_of_stability_is_no_explanation_of_a_sine(loaded):
    """A model that rings with a sensitivity of 60 predicts the next sample of a sine as well as a line does; noise
    through it would not keep its size (Rice 1945), so the load is named."""
    m = loaded[1].verdict.measured
    same = {"ms": 60.0, "line_nat": 0.5, "period_s": m.ringing.cycle_s}
    assert told(loaded, **same).cause == "load"
    assert told(loaded, line_nat=0.5).cause == "undecided"


def test_a_line_that_explains_less_than_a_faulty_valve_is_no_load(loaded):
    """A periodic load that gains 100 nat is not named where a faulty valve gains 300 under a free noise model, unless
    its backlash is too narrow for a cycle of OP's range."""
    found = loaded[1]
    cycle = counting(found.oscillations)
    ringing = replace(found.verdict.measured.ringing, ms=1.3, line_nat=100.0, valve_nat=5.0)
    m = replace(found.verdict.measured, ringing=ringing, kurtosis=1.5)
    cases = (5.0, 0.5), (300.0, 0.5), (300.0, 0.05)
    verdicts = [judge(replace(m, evidence=nat, size=size), cycle, CONFIG.cause).cause for nat, size in cases]
    assert verdicts == ["load", "undecided", "load"]


def test_no_valve_is_told_without_evidence_of_its_own(loaded):
    """However likely a faulty valve is under a smooth load, none is named where the free noise model has no evidence
    for it."""
    verdict = told(loaded, valve_nat=500.0)
    assert verdict.cause != "valve"
    assert verdict.confidence[Cause.VALVE] < 50.0


def test_a_model_rings_at_the_period_of_a_cycle_as_far_as_the_rows_tell(loaded):
    """A model that rings 20 % slower is of another period in rows of a second, and of the same one where ten rows
    make a cycle: its dead time is known no better than to a row."""
    ringing, limits = loaded[1].verdict.measured.ringing, CONFIG.cause
    slower = replace(ringing, ms=5.0, period_s=1.2 * ringing.cycle_s)
    assert not replace(slower, row_s=1.0).rings(limits)
    assert replace(slower, row_s=0.1 * ringing.cycle_s).rings(limits)


def test_a_valve_causes_no_cycle_at_a_period_at_which_its_loop_attenuates_loads():
    """At its limit cycle the harmonic balance of a level with backlash is -1 (Gelb, Vander Velde 1968). At a period
    twenty times as long its loop gain is large, no backlash balances, and none is the cause."""
    worn = Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5)
    found = assess(prepared(simulate(worn, 6.0)), worn.controller, CONFIG).verdict
    assert found.cause == "valve"
    assert imbalance(found.measured) < 0.1
    assert imbalance(replace(found.measured, scale_s=20.0 * found.measured.scale_s)) > CONFIG.cause.imbalance


@pytest.mark.parametrize(("size", "strong"), [(0.05, False), (0.6, True)])
def test_evidence_of_a_fault_too_small_for_op_counts_little(loaded, size, strong):
    """Evidence of 60 nat for a fault of a twentieth of OP's range is listed last, and a constant size is then no sign
    of the valve; of more than half the range both are."""
    _, found = loaded
    m, cycle = found.verdict.measured, counting(found.oscillations)
    told = {s.kind: s for s in signs_of(replace(m, evidence=60.0, size=size), cycle, CONFIG.cause)}
    assert (told[SignKind.EVIDENCE].strength > 0.9) == strong
    assert (told[SignKind.REGULARITY].points_to is Cause.VALVE) == strong
