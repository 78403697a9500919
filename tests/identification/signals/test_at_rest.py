"""Where the set point has not moved for two periods."""

from __future__ import annotations

import numpy as np
import pytest

from identification.signals.setpoint_response import at_rest, moves


@pytest.mark.parametrize("period", [3.0, 10.0, 100.4, 1000.0])
def test_rest_is_far_from_all_moves(period: float) -> None:
    """A sample is at rest if none within two periods before and after it moves, by a slow count of each window."""
    sp = np.full(3000, 50.0)
    sp[500:], sp[2900:], sp[2910:] = 51.0, 49.0, 50.0
    reach = 2 * max(round(period), 4)
    slow = [not moves(sp)[max(k - reach, 0) : k + reach + 1].any() for k in range(sp.size)]
    assert at_rest(sp, period).tolist() == slow
