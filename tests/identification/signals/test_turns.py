"""Half-cycles from turns of OP, on a valve whose play is known."""

from __future__ import annotations

import numpy as np
import pytest

from identification.signals.turns import StemMarks, halves

PERIOD = 100


def triangle(n: int) -> np.ndarray:
    """OP as a triangle between 0 and 10, a period of 100 samples."""
    return 10.0 * (1.0 - np.abs((np.arange(n) % PERIOD) / 50.0 - 1.0))


def play(op: np.ndarray, width: float) -> np.ndarray:
    """A stem behind a play, stepped by hand."""
    stem, out = float(op[0]), np.empty(op.size)
    for k, u in enumerate(op):
        stem = min(max(stem, u - width / 2), u + width / 2)
        out[k] = stem
    return out


def found(width: float, dead: int = 0, most: int = 10):
    """Half-cycles of a triangle through a play, the stem as PV after a dead time; the turns of every corner."""
    op = triangle(1001)
    pv = np.roll(play(op, width), dead)
    turns = np.arange(50, 1001, 50)
    known = StemMarks(width, float(dead), float(dead))
    return halves(op, pv, np.ones(op.size, bool), turns, 1.0, float(PERIOD), known, most)


def test_the_last_ones_are_kept_oldest_first() -> None:
    """Ten of eighteen, each from a corner, in the order of time."""
    kept = found(4.0)
    assert [h.start_s for h in kept] == [500.0 + 50.0 * k for k in range(10)]


@pytest.mark.parametrize("width", [1.0, 4.0, 8.0])
def test_pv_stands_where_the_stem_is_said_to(width: float) -> None:
    """Where the marks say that the stem stands PV does not move; after them it follows OP."""
    for h in found(width):
        first, last = h.stuck
        assert np.ptp(h.pv[first:last]) == pytest.approx(0.0, abs=1e-9)
        assert abs(h.op[last - 1] - h.op[0]) < width
        assert np.abs(np.diff(h.pv[last + 1 :])).min() > 0.05


def test_pv_is_taken_the_dead_time_later() -> None:
    """With a dead time of seven samples the later PV is the stem of the moment."""
    for h, straight in zip(found(4.0, dead=7)[:-1], found(4.0)[:-1], strict=True):
        assert h.late == pytest.approx(straight.pv)


def test_a_sound_valve_has_no_marks() -> None:
    """Without a stickband nothing is marked."""
    assert {h.stuck for h in found(0.0)} == {(0, 0)}


def test_gaps_cost_their_half_alone() -> None:
    """A half-cycle with a sample that must not be used is left out, its neighbours stay."""
    op = triangle(1001)
    good = np.ones(op.size, bool)
    good[820] = False
    kept = halves(op, op, good, np.arange(50, 1001, 50), 1.0, float(PERIOD), StemMarks(0.0, 0.0, 0.0), 4)
    assert [h.start_s for h in kept] == [750.0, 850.0, 900.0, 950.0]


def test_without_turns_there_is_nothing() -> None:
    """No turn or one turn gives no half-cycle."""
    op = np.linspace(0, 10, 100)
    for turns in ([], [50]):
        assert (
            halves(op, op, np.ones(100, bool), np.array(turns, int), 1.0, 10.0, StemMarks(1.0, 0.0, 0.0), 10)
            == ()
        )
