"""The baseline process found from routine closed-loop data."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimation.problem import in_blocks
from identification.estimation.search import plain_processes
from identification.mismatch.baseline import prepared
from identification.models import Fopdt, Loop, Pid
from identification.record import LoopRecord
from identification.simulation.closed_loop import closed_loop
from identification.simulation.open_loop import ModelInputs
from identification.simulation.parameters import Slot

pytestmark = pytest.mark.slow

N = 5000


def recorded(seed: int) -> LoopRecord:
    """A closed loop (gain 1.2, time constant 20 s, dead time 3.4 s) under set-point steps, load and noise."""
    rng = np.random.default_rng(seed)
    sp = 50 + np.repeat(rng.uniform(-7, 7, N // 150 + 1), 150)[:N]
    slow = np.zeros(N)
    push = rng.normal(0, 0.055, N)
    for k in range(1, N):
        slow[k] = slow[k - 1] * (1 - 1 / 60) + push[k]
    return closed_loop(Loop(Fopdt(1.2, 20.0, 3.4), Pid(1.8, 20.0)), sp, slow + rng.normal(0, 0.08, N))


def test_one_start_is_near_the_true_process() -> None:
    """At least one start has the gain, and the lag plus dead time, within a third of the true values."""
    s = recorded(11)
    found = plain_processes(in_blocks(s.pv, s.op, ~s.bad, s.dt_s))
    assert any(
        abs(p.gain / 1.2 - 1) < 0.33 and abs((p.time_constant_s + p.dead_time_s) / 23.4 - 1) < 0.33
        for p in found
    )


def test_baseline_model_is_found_in_closed_loop() -> None:
    """Gain and time constant are recovered within 5 % and dead time within 0.1 samples, with load and noise."""
    s = recorded(12)
    inputs = ModelInputs(
        s.op, 1.0, float(s.op.mean()), float(s.pv.mean()), (float(s.pv.min()), float(s.pv.max()))
    )
    _, fit = prepared(inputs, s.pv - s.pv.mean(), np.ones(s.pv.size, dtype=bool))
    c = fit.model.c
    assert c[Slot.K] == pytest.approx(1.2, rel=0.05)
    assert c[Slot.T] == pytest.approx(20.0, rel=0.05)
    assert c[Slot.L] == pytest.approx(3.4, abs=0.1)
