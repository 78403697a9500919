"""Does OP answer PV: closed loops, scripts, and records that say nothing."""

from __future__ import annotations

import numpy as np
import pytest

from identification.controller.pi_regression import fed_back


def closed(seed: int, n: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """OP and PV, shape (n,) each, of a lag under a PI controller and a load, stepped in plain Python."""
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
    """The same process moved by random levels."""
    rng = np.random.default_rng(seed)
    op, pv, x = np.repeat(50.0 + 5.0 * rng.standard_normal(n // 40), 40), np.empty(n), 0.0
    for k in range(n):
        pv[k] = x + 0.1 * rng.standard_normal()
        x += (0.9 * (op[k] - 50.0) - x) / 20.0
    return op, pv


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_controllers_output_answers_pv(seed: int) -> None:
    """A PI controller's moves are PV's for the most part."""
    assert fed_back(*closed(seed)) > 0.9


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_script_does_not_answer_pv(seed: int) -> None:
    """Of moves that a script makes PV tells next to nothing, though it answers them."""
    assert fed_back(*scripted(seed)) < 0.03


def test_an_output_that_rests_and_a_short_record_answer_nothing() -> None:
    """Nothing is told of an OP that never moves, and of a record of a hundred samples."""
    op, pv = closed(4)
    assert fed_back(np.full(op.size, 50.0), pv) == 0.0
    assert fed_back(op[:100], pv[:100]) == 0.0
