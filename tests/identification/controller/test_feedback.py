"""Whether OP responds to PV: closed loops, scripted moves, and records without information."""

from __future__ import annotations

import numpy as np
import pytest

from identification.controller.pi_regression import feedback_share


def closed(seed: int, n: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """OP and PV, each shape (n,), of a lag under a PI controller and a load, simulated in plain Python."""
    rng = np.random.default_rng(seed)
    op, pv, held, x, load = np.empty(n), np.empty(n), 50.0, 0.0, 0.0
    for k in range(n):
        load = 0.95 * load + 0.3 * rng.standard_normal()
        pv[k] = x + load
        held -= 0.05 * pv[k]
        op[k] = held - 0.8 * pv[k]
        x += (0.9 * (op[k] - 50.0) - x) / 20.0
    return op, pv


def scripted(seed: int, n: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """The same process with OP at random levels."""
    rng = np.random.default_rng(seed)
    op, pv, x = np.repeat(50.0 + 5.0 * rng.standard_normal(n // 40), 40), np.empty(n), 0.0
    for k in range(n):
        pv[k] = x + 0.1 * rng.standard_normal()
        x += (0.9 * (op[k] - 50.0) - x) / 20.0
    return op, pv


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_controllers_output_follows_pv(seed: int) -> None:
    """PV explains more than 90 % of the moves of a PI controller."""
    assert feedback_share(*closed(seed)) > 0.9


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_script_does_not_follow_pv(seed: int) -> None:
    """PV explains less than 3 % of scripted moves, although PV responds to them."""
    assert feedback_share(*scripted(seed)) < 0.03


def test_a_constant_output_and_a_short_record_have_no_feedback() -> None:
    """A constant OP and a record of a hundred samples have a feedback of zero."""
    op, pv = closed(4)
    assert feedback_share(np.full(op.size, 50.0), pv) == 0.0
    assert feedback_share(op[:100], pv[:100]) == 0.0
