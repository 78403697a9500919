"""Proof of one candidate by one-step-ahead prediction on held-out data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.model import Fitted, Model
from identification.estimation.problem import problem
from identification.mismatch.candidate_proof import held_out_gain
from identification.models import Fopdt
from identification.simulation.open_loop import ModelInputs, as_parameters, simulate

N = 3000


@pytest.mark.parametrize("slope", [0.0, 0.01, -0.05])
def test_a_later_load_does_not_change_the_held_out_gain(slope: float) -> None:
    """A ramp in the held-out part changes the held-out gain of the right process by at most 1 %. The gain is
    relative to a process with half the process gain. An integrator makes such a ramp from a load step, and the
    noise model of differences makes the ramp a constant."""
    rng = np.random.default_rng(5)
    op = 50.0 + np.cumsum(rng.choice([-1.0, 0.0, 0.0, 0.0, 1.0], N))
    inputs = ModelInputs(op, 1.0, float(op.mean()), 50.0, (0.0, 100.0))
    right, wrong = (as_parameters(Fopdt(k, 15.0, 3.0)) for k in (1.0, 0.5))
    y = simulate(inputs, right) + np.cumsum(0.05 * rng.standard_normal(N))
    cut = int(0.65 * N)
    ramp = np.where(np.arange(N) >= cut, slope * (np.arange(N) - cut), 0.0)
    p = problem(inputs, y, np.ones(N, dtype=bool), edges=np.arange(2))

    def fits(c: np.ndarray) -> Fitted:
        return Fitted(p, Model((), c), 0.05**2, N, np.array([1.0]))

    still = held_out_gain(p, (fits(wrong), fits(right)))
    later = held_out_gain(replace(p, y=y + ramp), (fits(wrong), fits(right)))
    assert still > 10.0
    assert later == pytest.approx(still, rel=0.01)
