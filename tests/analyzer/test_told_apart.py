"""A likely cause is told where something of its own shows it, and not for want of the others."""

from __future__ import annotations

from dataclasses import replace

import pytest

from analyzer.loop.assess import assess
from analyzer.loop.cause import told_apart
from analyzer.loop.decisions import Cause, Lack, SignKind
from analyzer.loop.finding import Sign
from analyzer.loop.oscillation import counting
from identification.models import Fopdt, Loop
from proofs.plant import CONFIG, Sketch, prepared, simulate
from tuning.frequency_response import maximum_sensitivity

SINE = Sketch("load", (1.4, 90.0, 10.0), 0.8, 60.0, sine=1.0, sine_s=840.0, load_std=0.05)


@pytest.fixture(scope="module")
def loaded():
    """A robust loop under a sinusoidal load, prepared and assessed."""
    made = prepared(simulate(SINE, 8.0))
    return made, assess(made, SINE.controller, CONFIG)


@pytest.mark.parametrize(
    ("names", "cause"),
    [
        (("saturated",), "undecided"),
        (("evidence", "size", "harmonic", "dead_time_share"), "undecided"),
        (("saturated", "line_linear"), "load"),
        (("kurtosis",), "load"),
    ],
)
def test_a_load_is_told_by_a_sign_of_its_own(loaded, names, cause):
    """That no valve shows and that OP stays off its limits tells no load; a peak in what the model leaves, or a
    rhythm kept, does. What is not told asks for a test in manual."""
    made, found = loaded
    assert found.verdict.cause == "load"
    verdict = replace(found.verdict, signs=tuple(Sign(Cause.LOAD, 0.3, SignKind(name)) for name in names))
    told = told_apart(verdict, made, counting(found.oscillations), CONFIG)
    assert told.cause == cause
    assert (told.needs is not None and told.needs.lack is Lack.MANUAL_TEST) == (cause == "undecided")


def test_no_tuning_is_told_against_its_own_sensitivity(loaded):
    """Of a loop whose identified process is robust at its settings no tuning is told, and the words say so once; the
    same loop at eight times the gain is."""
    made, found = loaded
    gain, lag, late = SINE.process
    true = replace(found.verdict.measured.linear, gain=gain, time_constant_s=lag, dead_time_s=late)
    measured = replace(found.verdict.measured, linear=true)
    accused = replace(found.verdict, cause=Cause.TUNING, measured=measured)
    told = told_apart(accused, made, counting(found.oscillations), CONFIG)
    assert (told.cause, told.needs.lack) == ("undecided", Lack.MANUAL_TEST)
    assert "robust (Ms 1." in str(told.needs)
    m = replace(accused.measured, controller=replace(accused.measured.controller, kp=8 * SINE.kp))
    assert (
        maximum_sensitivity(Loop(Fopdt(*SINE.process), SINE.controller))
        < 2.0
        < maximum_sensitivity(Loop(Fopdt(*SINE.process), m.controller))
    )
    tight = told_apart(replace(accused, measured=m), made, counting(found.oscillations), CONFIG)
    assert tight.cause == "tuning"
