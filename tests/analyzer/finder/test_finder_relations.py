"""Relations between the loops of a draft, on signals that are made from their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.finder.relations import at_rest, equal_at_times, halves, masters_of, ratios_to, scan_of


@pytest.fixture(scope="module")
def walks():
    """Six drifting tags, shape (6000, 6)."""
    return 50.0 + np.cumsum(np.random.default_rng(5).normal(0.0, 0.3, (6000, 6)), axis=0)


def test_a_ratio_to_a_pv_is_found_and_a_drift_gives_no_ratio(walks):
    """A set point of 0.4 times a PV, to three decimals, has a ratio to it. A set point that drifts by itself or is
    constant has no ratio, and none has a ratio to its own PV.
    """
    set_points = np.column_stack(
        [np.round(0.4 * walks[:, 2], 3), walks[:, 0], np.full(6000, 7.0), walks[:, 4]]
    )
    assert ratios_to(set_points, walks[:, 1:], [3, 0, 1, 3]) == [1, None, None, None]


def test_a_set_point_that_is_an_output_in_another_scale_has_a_master(walks):
    """The set point of a slave is the output of its master in its own unit, also if it is rounded. If two outputs are
    equal, neither is the master.
    """
    set_points = np.column_stack([np.round(20.0 + 1.5 * walks[:, 3], 2), np.full(6000, 7.0)])
    assert masters_of(set_points, walks, [0, 1]) == [3, None]
    assert masters_of(walks[:, [0]], walks[:, 1:], [1]) == [None]
    equal_outputs = np.column_stack([walks[:, 3], walks[:, 3] + 0.01 * walks[:, 1], walks[:, 2]])
    assert masters_of(walks[:, [3]], equal_outputs, [2]) == [None]


@pytest.mark.parametrize("scan", [1, 2, 5, 30])
def test_the_scan_is_the_spacing_of_the_moves(walks, scan):
    """An output that is held for complete scans shows the scan time; an output that moves at each sample does not."""
    held = np.repeat(walks[::scan, 0], scan)[:6000].round(1)
    assert scan_of(held) == (scan if scan > 1 else None)


def test_an_output_that_is_constant_for_a_third_is_at_rest_for_a_third(walks):
    """The time in manual is the share of long constant spans: none for an output that always moves, all for a
    constant.
    """
    op = walks[:, 1].copy()
    assert at_rest(op) == 0.0
    op[1000:3000] = op[1000]
    assert at_rest(op) == pytest.approx(1 / 3, abs=0.01)
    assert at_rest(np.full(6000, 5.0)) == 1.0


def test_two_controllers_of_one_valve_are_equal_at_times(walks):
    """The lower of two outputs is the output of both if each one tracks it. Outputs that are only 0 at the same time,
    and independent outputs, are no candidates.
    """
    a, b = walks[:, 0], walks[:, 1]
    tracking = np.where(a < b, a, b)
    outputs = np.column_stack(
        [a, tracking, walks[:, 3], np.maximum(walks[:, 4] - 50, 0), np.maximum(walks[:, 5] - 50, 0)]
    )
    assert equal_at_times(outputs) == [(0, 1)]


def test_halves_of_a_split_range_follow_their_controller(walks):
    """A half of a split range moves with OP above 50 % and is constant below.

    A tag that is constant at its own limits is no half.
    """
    op = np.clip(walks[:, 0], 0, 100)
    middle = float(np.median(op))
    half, other = np.maximum(op - middle, 0.0) * 2.0, np.maximum(walks[:, 4] - np.median(walks[:, 4]), 0.0)
    assert halves(np.column_stack([op, walks[:, 2]]), np.column_stack([half, other])) == {0: [0]}
