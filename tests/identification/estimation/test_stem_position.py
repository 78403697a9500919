"""Valve faults from a recorded stem, made by the sample mill's physics."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.loop.assess import assess
from analyzer.loop.record.quality import prepare
from identification.estimation.stem_position import valve_from_position
from proofs.plant import CONFIG, START_S, Sketch, Trends, series, simulate, spec

BACKLASH = Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5)
STICKING = Sketch("valve", (1.5, 40.0, 8.0), 0.8, 40.0, stickband=3.0, slip_jump=1.5)
FAULT_FREE = Sketch("none", (1.5, 40.0, 8.0), 0.8, 40.0)


def recorded(t: Trends, seed: int = 0) -> np.ndarray:
    """The stem as reported by a transmitter with noise and resolution of 0.05 %, shape (n,)."""
    return np.round((t.stem + np.random.default_rng(seed).normal(0, 0.05, t.stem.size)) / 0.05) * 0.05


def test_backlash_is_found_with_its_width() -> None:
    """From OP and a noisy stem, the backlash is recovered within 2 %, and no jump is reported."""
    t = simulate(BACKLASH)
    found = valve_from_position(t.op, recorded(t))
    assert found is not None
    assert found.backlash.stickband == pytest.approx(2.5, rel=0.02)
    assert found.stick_slip is None


def test_stickband_and_jump_are_found() -> None:
    """Stickband and slip jump of dry friction are recovered within 5 %."""
    t = simulate(STICKING)
    found = valve_from_position(t.op, recorded(t))
    assert found is not None
    assert found.stick_slip is not None
    assert found.stick_slip.stickband == pytest.approx(3.0, rel=0.05)
    assert found.stick_slip.slip_jump == pytest.approx(1.5, rel=0.05)


def test_a_stem_that_follows_is_no_fault() -> None:
    """A stem that follows OP with the transmitter's noise has no fault."""
    t = simulate(FAULT_FREE)
    assert valve_from_position(t.op, recorded(t)) is None


def test_a_stem_that_lags_has_no_backlash() -> None:
    """A stem with a positioner's lag of twenty samples is not reported as backlash."""
    op = 50 + np.repeat(np.random.default_rng(3).normal(0, 3, 60), 60)
    stem = np.empty_like(op)
    at = op[0]
    for k, u in enumerate(op):
        at += (u - at) / 20.0
        stem[k] = at
    assert valve_from_position(op, stem) is None


@pytest.mark.parametrize(("sketch", "fault"), [(BACKLASH, "backlash"), (STICKING, "stiction")])
def test_the_night_uses_the_stem(sketch: Sketch, fault: str) -> None:
    """With a recorded stem the fault is reported, and gain divided by time constant is within 5 % of the truth."""
    t = simulate(sketch)
    stamp = START_S + np.arange(t.pv.size, dtype=float)
    trends = {"L.SP": t.sp, "L.PV": t.pv, "L.OP": t.op, "L.POS": recorded(t)}
    made = prepare(spec(position="L.POS"), {k: series(stamp, v) for k, v in trends.items()}, CONFIG.quality)
    verdict = assess(made, sketch.controller, CONFIG).verdict
    assert (verdict.cause, verdict.fault) == ("valve", fault)
    assert verdict.measured is not None
    gain, lag, _ = sketch.process
    assert verdict.measured.backlash.slope == pytest.approx(gain / lag, rel=0.05)
