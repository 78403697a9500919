"""Valve models against their definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.models import Backlash, Stiction
from identification.simulation.valve import (
    HALTS,
    SLIDES,
    StemLaw,
    backlash_stem,
    first_slip,
    stem_position,
    thresholds,
    walk,
)


def slow_backlash(op: list[float], width: float, stem: float) -> list[float]:
    """Backlash by its mechanism: a slot of the given width that OP pushes."""
    out = []
    for u in op:
        left, right = stem - width / 2, stem + width / 2
        if u > right:
            stem += u - right
        elif u < left:
            stem -= left - u
        out.append(stem)
    return out


@given(st.lists(st.floats(-50, 50), min_size=1, max_size=60), st.floats(0.01, 20))
def test_backlash_agrees_with_a_slow_implementation(op, width):
    """The kernel and a pushed slot give the same stem within rounding."""
    assert backlash_stem(np.array(op), width, 0.0) == pytest.approx(slow_backlash(op, width, 0.0), abs=1e-9)


@given(st.lists(st.floats(-50, 50), min_size=1, max_size=60), st.floats(0.01, 20), st.floats(0, 1))
def test_stem_never_leaves_breakaway(op, stickband, share):
    """The distance between stem and OP is never larger than the breakaway distance (S + J)/2."""
    jump = stickband * share
    stem = stem_position(np.array(op), Stiction(stickband, jump))
    assert np.all(np.abs(np.array(op) - stem) <= (stickband + jump) / 2 + 1e-9)


def test_equal_stickband_and_jump_is_a_relay():
    """S = J = 2d under a sine of amplitude 2d is a relay of height d that switches at d (the study's Eq. 2)."""
    d = 1.0
    op = 2 * d * np.sin(np.linspace(0, 8 * np.pi, 4001))
    stem = stem_position(op, Stiction(2 * d, 2 * d), -d)[1000:]
    assert set(np.round(np.sign(stem))) == {-1.0, 1.0}
    assert np.abs(np.abs(stem) - d).max() < 0.01


def test_backlash_is_rate_independent():
    """The stem's path does not change if every OP sample is repeated."""
    op = np.cumsum(np.random.default_rng(1).normal(size=300))
    assert np.array_equal(
        stem_position(np.repeat(op, 3), Backlash(2.0))[::3], stem_position(op, Backlash(2.0))
    )


@given(st.lists(st.floats(-50, 50), min_size=2, max_size=60), st.floats(0.5, 20), st.floats(-1, 1))
def test_backlash_has_one_path_after_op_has_covered_it(op, width, where):
    """From any start within the backlash, the stem joins the path from first_slip after OP has covered the
    width."""
    x = np.array(op)
    covered = np.flatnonzero(np.maximum.accumulate(x) - np.minimum.accumulate(x) > width)
    known = backlash_stem(x, width, first_slip(x, StemLaw(width / 2, width / 2)))
    free = backlash_stem(x, width, x[0] + where * width / 2)
    after = covered[0] if covered.size else x.size
    assert known[after:] == pytest.approx(free[after:], abs=1e-9)


def test_stick_slip_that_needs_more_than_half_of_the_range_moves():
    """A valve with a breakaway above OP's amplitude still moves, because its first position is not the middle
    of OP."""
    op = np.sin(np.linspace(0, 20 * np.pi, 2001))
    law = StemLaw(*thresholds(1.2, 1.0))
    stem = walk(op, law, first_slip(op, law))
    assert np.ptp(stem[200:]) > 1.0
    assert np.ptp(walk(op, law, 0.0)) == 0.0


def dry_stem(op: np.ndarray, static: float, kinetic: float) -> np.ndarray:
    """A light stem on a spring with dry friction in small steps: at rest below `static`, otherwise towards
    `kinetic`."""
    z, moving, out = 0.0, False, []
    for u in op:
        for _ in range(200):
            pull = u - z
            if not moving and abs(pull) <= static:
                continue
            step = 0.1 * (abs(pull) - kinetic)
            moving = step > 1e-6
            z += np.sign(pull) * max(step, 0.0)
        out.append(z)
    return np.array(out)


def test_dry_friction_halts_with_op():
    """After a stop of OP, dry friction holds the stem until its next slip, as HALTS does and SLIDES does not."""
    op = np.concatenate([np.linspace(0, 3, 31), np.full(5, 3.0), np.linspace(3, 4, 11)[1:], np.full(3, 4.0)])
    breakaway, sliding = thresholds(2.0, 1.0)
    true = dry_stem(op, breakaway, sliding)
    halts, slides = (walk(op, StemLaw(breakaway, sliding, t), 0.0) for t in (HALTS, SLIDES))
    after = op.size - 3 - 6
    assert true[after] == pytest.approx(true[35], abs=1e-3)
    assert halts[after] == pytest.approx(halts[35])
    assert slides[after] > slides[35] + 0.3
