"""Half periods between OP reversals, on a valve of known backlash."""

from __future__ import annotations

import numpy as np
import pytest

from identification.signals.reversals import StemMarks, halves

PERIOD = 100


def triangle(n: int) -> np.ndarray:
    """OP as a triangle between 0 and 10, with a period of 100 samples."""
    return 10.0 * (1.0 - np.abs((np.arange(n) % PERIOD) / 50.0 - 1.0))


def with_backlash(op: np.ndarray, width: float) -> np.ndarray:
    """Stem position with backlash, in plain Python."""
    stem, out = float(op[0]), np.empty(op.size)
    for k, u in enumerate(op):
        stem = min(max(stem, u - width / 2), u + width / 2)
        out[k] = stem
    return out


def half_periods(width: float, dead: int = 0, most: int = 10):
    """Half periods of a triangle with backlash, with the stem as PV after a dead time, and reversals at every
    corner."""
    op = triangle(1001)
    pv = np.roll(with_backlash(op, width), dead)
    reversals = np.arange(50, 1001, 50)
    known = StemMarks(width, float(dead), float(dead))
    return halves(op, pv, np.ones(op.size, bool), reversals, 1.0, float(PERIOD), known, most)


def test_the_last_half_periods_are_kept_in_the_order_of_time() -> None:
    """The last ten of eighteen half periods are kept in the order of time, and each starts at a corner."""
    kept = half_periods(4.0)
    assert [h.start_s for h in kept] == [500.0 + 50.0 * k for k in range(10)]


@pytest.mark.parametrize("width", [1.0, 4.0, 8.0])
def test_pv_rests_where_the_marks_report_a_resting_stem(width: float) -> None:
    """Where the marks report a resting stem, PV does not move; after them PV follows OP."""
    for h in half_periods(width):
        first, last = h.stuck
        assert np.ptp(h.pv[first:last]) == pytest.approx(0.0, abs=1e-9)
        assert abs(h.op[last - 1] - h.op[0]) < width
        assert np.abs(np.diff(h.pv[last + 1 :])).min() > 0.05


def test_pv_is_taken_the_dead_time_later() -> None:
    """With a dead time of seven samples, the delayed PV is the stem position."""
    for h, straight in zip(half_periods(4.0, dead=7)[:-1], half_periods(4.0)[:-1], strict=True):
        assert h.late == pytest.approx(straight.pv)


def test_an_ideal_valve_has_no_marks() -> None:
    """Without a stickband nothing is marked."""
    assert {h.stuck for h in half_periods(0.0)} == {(0, 0)}


def test_gaps_remove_only_their_half_period() -> None:
    """A half period with an unusable sample is left out, and its neighbours stay."""
    op = triangle(1001)
    good = np.ones(op.size, bool)
    good[820] = False
    kept = halves(op, op, good, np.arange(50, 1001, 50), 1.0, float(PERIOD), StemMarks(0.0, 0.0, 0.0), 4)
    assert [h.start_s for h in kept] == [750.0, 850.0, 900.0, 950.0]


def test_without_reversals_there_is_no_half_period() -> None:
    """No reversal, or only one, gives no half period."""
    op = np.linspace(0, 10, 100)
    for reversals in ([], [50]):
        assert (
            halves(
                op, op, np.ones(100, bool), np.array(reversals, int), 1.0, 10.0, StemMarks(1.0, 0.0, 0.0), 10
            )
            == ()
        )
