"""Samples at which the set point has not moved for two periods."""

from __future__ import annotations

import numpy as np
import pytest

from identification.signals.setpoint_response import at_rest, moves


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("period", [3.0, 10.0, 100.4, 1000.0])
def test_rest_is_far_from_all_moves(period: float, after: bool) -> None:
    """A sample is at rest if SP does not move in the two periods before it (option: also after it), by a slow
    count."""
    sp = np.full(3000, 50.0)
    sp[500:], sp[2900:], sp[2910:] = 51.0, 49.0, 50.0
    length, moved = 2 * max(round(period), 4), moves(sp)
    slow = [not moved[max(k + 1 - length, 0) : k + 1 + length * after].any() for k in range(sp.size)]
    assert at_rest(sp, period, after).tolist() == slow
