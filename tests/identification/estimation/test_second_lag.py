"""A second lag of the process is not reported as backlash, and backlash is not reported as a second lag."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.assess import assess
from analyzer.loop.decisions import Cause, Fault
from analyzer.loop.record.judged_stretch import controller_of
from analyzer.loop.record.quality import prepare
from benchmarks.world.__main__ import export, spec_of
from benchmarks.world.draw import drawn
from benchmarks.world.pairs import varied
from identification.estimation.backlash_stiction import fit_backlash, fit_linear
from identification.estimation.evidence import evidence, with_second_lag
from identification.estimation.problem import in_blocks

N, LAG_S, SECOND_S, DEAD = 20_000, 120.0, 6.0, 4


def behind(op: np.ndarray, second_s: float) -> np.ndarray:
    """PV [%], shape (N,), of two lags and a dead time as a response to OP, with noise."""
    out = np.concatenate((np.zeros(DEAD), op[:-DEAD]))
    for lag_s in (LAG_S, second_s):
        kept = math.exp(-1.0 / lag_s) if lag_s else 0.0
        out = lfilter([1.0 - kept], [1.0, -kept], out)
    return 1.5 * out + 0.005 * np.random.default_rng(2).standard_normal(N)


def gains(second_s: float, width: float = 0.0) -> tuple[float, float]:
    """Evidence [nat] for a second lag and for backlash, from a PV under a random OP whose stem has some
    backlash."""
    op = np.cumsum(0.2 * np.random.default_rng(1).standard_normal(N))
    op -= np.linspace(op[0], op[-1], N)
    stem, moved = op.copy(), op[0]
    for k in range(N):
        moved = min(max(moved, op[k] - 0.5 * width), op[k] + 0.5 * width)
        stem[k] = moved
    block = 10
    y = behind(stem, second_s).reshape(-1, block).mean(axis=1)
    problem = in_blocks(y, op, np.ones(y.size, bool), float(block), block)
    linear = fit_linear(problem, 300.0)
    return evidence(with_second_lag(linear), linear), evidence(fit_backlash(linear, 300.0), linear)


def test_a_second_lag_explains_more_than_backlash_where_there_is_one() -> None:
    """A second lag of 0.6 of a block is found and explains more than backlash. With a single lag neither has
    evidence."""
    lag, backlash = gains(SECOND_S)
    assert lag > 50.0
    assert lag > backlash
    assert max(gains(0.0)) < 6.0


def test_backlash_explains_more_than_a_second_lag_where_there_is_some() -> None:
    """With backlash, a second lag explains less than a third of what backlash explains."""
    lag, backlash = gains(0.0, width=2.0)
    assert backlash > 100.0
    assert lag < backlash / 3.0


@pytest.mark.parametrize("seed", [661, 662])
def test_no_fault_free_valve_is_blamed_under_a_master(seed: int) -> None:
    """None of four fault-free loops under a master is reported with backlash. The master's set point moves OP
    at each scan, and backlash removes these moves as a second lag does."""
    config = Config()
    for d in drawn(seed, 4, ("healthy",)):
        spec = spec_of(d)
        with tempfile.TemporaryDirectory() as folder:
            files = export(Path(folder), {d.name: varied(d, "a master's SP")})
            one = prepare(spec, open_export(files).read(spec.tags), config.quality)
        found = assess(one, controller_of(spec, one), config)
        assert (found.verdict.cause, found.verdict.fault) == (Cause.NONE, Fault.NONE)
