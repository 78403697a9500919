"""The profile of widths has its peak at the true backlash, and has no peak where there is no backlash."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from analyzer.loop.identification.measure import Measured, measure
from analyzer.loop.oscillation.detection import counting, detect
from identification.estimation.backlash_stiction import WIDTHS, width_profile
from proofs.plant import CONFIG, Sketch, prepared, simulate

LEVEL = Sketch("backlash", (40.0, 1500.0, 8.0), 0.8, 100.0, backlash=0.62)
QUIET = Sketch("none", (1.2, 60.0, 8.0), 0.8, 60.0)
MOVED = Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, sine=2.0, sine_s=840.0)


def measured(sketch: Sketch, seed: int, hours: float = 6.0) -> Measured:
    """The measurements of a night from a simulated loop."""
    record = prepared(simulate(sketch, hours, seed)).record
    found = detect(record, CONFIG.oscillation)
    return measure(record, counting(found), sketch.controller, CONFIG.cause, found.spectrum)


@pytest.mark.parametrize("seed", [1, 2])
def test_it_peaks_at_the_true_backlash(seed: int) -> None:
    """A level with a backlash of 0.62 % has its peak there, as high as the evidence of the search within 25 %.
    The profile falls above."""
    m = measured(LEVEL, seed)
    found = width_profile(m.linear, m.backlash)
    assert WIDTHS[int(found.argmax())] == pytest.approx(0.62, rel=0.05)
    assert found.max() == pytest.approx(m.backlash.log_likelihood - m.linear.log_likelihood, rel=0.25)
    assert found[WIDTHS > 1.1].max() < 0.0


@pytest.mark.parametrize("width", [0.66, 0.70, 0.74])
def test_backlash_between_two_widths_counts_for_both(width: float) -> None:
    """Backlash between two widths has its full evidence at both, so that two nights of one valve agree on one
    width."""
    m = measured(replace(LEVEL, backlash=width), 3)
    found = width_profile(m.linear, m.backlash)
    assert m.backlash.valve.stickband == pytest.approx(width, rel=0.05)
    assert found[(width / 1.26 < WIDTHS) & (width * 1.26 > WIDTHS)].min() >= found.max() - 1.0


def test_it_has_no_evidence_of_backlash_for_an_ideal_valve() -> None:
    """Under noise, drift and a sinusoidal load, no width of sixteen records has more evidence than one needless
    constant. The limit is the likelihood ratio at 5 %, corrected for all widths and records (Wilks 1938,
    Bonferroni 1936)."""
    found = [measured(sketch, seed) for sketch in (QUIET, MOVED) for seed in range(1, 9)]
    most = [width_profile(m.linear, m.backlash).max() for m in found]
    assert max(most) < 0.5 * chi2.isf(0.05 / (len(found) * WIDTHS.size), 1)


def test_widths_that_are_too_small_are_not_distinguished_from_none() -> None:
    """Backlash far narrower than OP's moves has no evidence for or against it. Widths of more than half of OP's
    range are excluded, and widths above this range do not differ."""
    m = measured(MOVED, 1)
    found = width_profile(m.linear, m.backlash)
    assert found[0] == 0.0
    assert found[0.5 * np.ptp(m.problem.blocks.op) < WIDTHS].max() < -100.0
    beyond = found[np.ptp(m.problem.blocks.op) * 1.25 < WIDTHS]
    assert np.ptp(beyond) == 0.0
