"""Valve operators against their definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.models import Backlash
from identification.valve import play, stem_position, stick_slip


def slow_play(op: list[float], width: float, stem: float) -> list[float]:
    """Play by its picture: a slot of the given width pushed along by OP."""
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
def test_play_agrees_with_slow_twin(op, width):
    """The kernel and a pushed slot give the same stem to rounding."""
    assert play(np.array(op), width, 0.0) == pytest.approx(slow_play(op, width, 0.0), abs=1e-9)


@given(st.lists(st.floats(-50, 50), min_size=1, max_size=60), st.floats(0.01, 20), st.floats(0, 1))
def test_stem_never_leaves_breakaway(op, stickband, share):
    """The stem is never further from OP than the breakaway distance (S + J)/2."""
    jump = stickband * share
    stem = stick_slip(np.array(op), stickband, jump)
    assert np.all(np.abs(np.array(op) - stem) <= (stickband + jump) / 2 + 1e-9)


def test_equal_stickband_and_jump_is_a_relay():
    """S = J = 2d under a sine of amplitude 2d is a relay of height d switching at d (the study's Eq. 2)."""
    d = 1.0
    op = 2 * d * np.sin(np.linspace(0, 8 * np.pi, 4001))
    stem = stick_slip(op, 2 * d, 2 * d, start=-d)[1000:]
    assert set(np.round(np.sign(stem))) == {-1.0, 1.0}
    assert np.abs(np.abs(stem) - d).max() < 0.01


def test_play_is_rate_independent():
    """Repeating every OP sample leaves the stem's path unchanged."""
    op = np.cumsum(np.random.default_rng(1).normal(size=300))
    assert np.array_equal(
        stem_position(np.repeat(op, 3), Backlash(2.0))[::3], stem_position(op, Backlash(2.0))
    )
