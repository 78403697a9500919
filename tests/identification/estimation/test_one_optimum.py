"""The kernel that fits a night's loops and the fit of any candidate find the same constants from one start."""

from __future__ import annotations

import math

import numpy as np
import pytest

from identification.estimation.gauss_newton import covariance, residual
from identification.estimation.gauss_newton import descend as descend_lag
from identification.estimation.model import Model, start_at
from identification.estimation.noise import generic_noise
from identification.estimation.prediction_error import descended as descend_any
from identification.estimation.prediction_error import deviations
from identification.estimation.problem import in_blocks
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.model_file import constants, to_data
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs, as_parameters, simulate
from identification.simulation.parameters import Slot, neutral
from identification.simulation.valve import HALTS, IDEAL, StemLaw, first_slip, sticking
from identification.simulation.valve_chain import friction_of, with_friction

GAIN, LAG, DEAD, BAND, N = 1.3, 20.0, 4.0, 2.0, 4000
FIRST = 420
"""Number of samples left out. After them OP has reversed, and the first position of the stem has no effect."""
FORGOTTEN = 40 * int(LAG)
"""Number of samples after which the first value of a lag has no effect in sixteen digits."""


def oscillating(seed: int) -> tuple[Floats, Floats]:
    """PV and OP, each (n,), of a lag with backlash under PI control and set-point steps, in plain Python.

    The noise is of first order. Both noise models contain it: single lags, and means of groups of lags.
    """
    rng = np.random.default_rng(seed)
    stem, x, total, noise = 50.0, 0.0, 50.0, 0.0
    pipe, pv_out, op_out = [50.0] * int(DEAD), np.empty(N + FIRST), np.empty(N + FIRST)
    for k in range(N + FIRST):
        noise = 0.6 * noise + 0.05 * rng.standard_normal()
        pv = 50.0 + x + noise
        e = 50.0 + 4.0 * ((k // 400) % 2) - pv
        total += 0.6 * e / 25.0
        op = total + 0.6 * e
        pv_out[k], op_out[k] = pv, op
        stem = min(max(stem, op - BAND / 2), op + BAND / 2)
        pipe.append(stem)
        x += (1.0 - math.exp(-1.0 / LAG)) * (GAIN * (pipe.pop(0) - 50.0) - x)
    return pv_out[FIRST:], op_out[FIRST:]


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_both_fits_find_the_same_constants(seed: int) -> None:
    """From one start that is 10 % off, the constants agree within their deviations, and the deviations agree
    within 30 %."""
    pv, op = oscillating(seed)
    good = np.ones(N, dtype=bool)
    problem = in_blocks(pv, op, good, 1.0)
    begun = start_at(
        problem, 1.1 * GAIN, (0.9 * LAG, DEAD), StemLaw(BAND / 2, BAND / 2, 0.0), generic_noise()
    )
    one = descend_lag(begun, free_width=True)
    spread = np.sqrt(np.diag(covariance(one, free_width=True)))

    any_fit = descend_any(problem, Model((EFFECTS["backlash"].variants[0],), begun.model.c), 40)
    found = any_fit.model.c
    deviation = {
        param.slot: d for param, d in zip(any_fit.model.params, deviations(problem, any_fit), strict=True)
    }

    pairs = (
        (math.log(one.time_constant_s), math.log(found[Slot.T]), spread[0], deviation[Slot.T]),
        (one.dead_time_s, found[Slot.L], spread[1], deviation[Slot.L]),
        (
            math.log(one.valve.stickband),
            math.log(found[Slot.STICKBAND]),
            spread[2] / one.valve.stickband,
            deviation[Slot.STICKBAND],
        ),
        (one.gain, found[Slot.K], spread[3], deviation[Slot.K]),
    )
    for mine, yours, my_spread, your_spread in pairs:
        assert abs(mine - yours) < min(my_spread, your_spread)
        assert my_spread == pytest.approx(your_spread, rel=0.3)


@pytest.mark.parametrize("law", [IDEAL, sticking(BAND, 0.0), sticking(BAND, 0.6), sticking(BAND, 0.6, HALTS)])
@pytest.mark.parametrize("dead_s", [0.0, 4.0, 4.3])
def test_the_kernel_has_the_residual_of_the_simulator(law: StemLaw, dead_s: float) -> None:
    """The residual of a lag with a valve is PV minus the response of the simulator, except for a constant,
    after the first value of PV has no effect."""
    pv, op = oscillating(6)
    problem = in_blocks(pv, op, np.ones(N, dtype=bool), 1.0)
    fit = start_at(problem, GAIN, (LAG, dead_s), law, generic_noise())
    inputs = ModelInputs(op, 1.0, float(op.mean()), 0.0, (0.0, 100.0))
    c = as_parameters(fit.process, law.valve)
    if law.breakaway > 0.0:
        c[Slot.PLACE] = (first_slip(op, law) - op[0]) / law.breakaway
    difference = residual(fit) - (pv - simulate(inputs, c))
    assert float(np.ptp(difference[FORGOTTEN:])) < 1e-9


def test_first_positions_are_not_saved_with_the_model() -> None:
    """A saved model leaves out the first positions of the stem and of PV, because both belong to the fitted
    recording."""
    op = np.linspace(40.0, 60.0, 50)
    c = neutral()
    c[Slot.K], c[Slot.STICKBAND], c[Slot.PLACE], c[Slot.START] = 1.2, 2.0, -1.0, 3.0
    data = to_data("L", ModelInputs(op, 1.0, 50.0, 50.0, (40.0, 60.0)), c, ("backlash",), 0.0, None)
    back = constants(data)
    assert (back[Slot.PLACE], back[Slot.START]) == (0.0, 0.0)
    assert (back[Slot.K], back[Slot.STICKBAND]) == (1.2, 2.0)


def test_a_constant_has_a_smaller_deviation_where_another_is_held() -> None:
    """With a fixed time constant, its deviation is zero and the deviation of the correlated gain is smaller."""
    pv, op = oscillating(7)
    p = in_blocks(pv, op, np.ones(N, dtype=bool), 1.0)
    fit = descend_any(
        p, Model((), as_parameters(start_at(p, GAIN, (LAG, DEAD), IDEAL, generic_noise()).process)), 20
    )
    slots = [int(q.slot) for q in fit.model.params]
    free, held = (dict(zip(slots, deviations(p, fit, fixed), strict=True)) for fixed in ((), (int(Slot.T),)))
    assert held[Slot.T] == 0.0
    assert 0.0 < held[Slot.K] < 0.95 * free[Slot.K]


@pytest.mark.parametrize(
    "law",
    [IDEAL, sticking(2.0, 0.0), sticking(2.0, 1.0, HALTS), sticking(3.0, 0.4, 0.0), sticking(3.0, 0.4, 0.3)],
)
def test_a_model_keeps_a_valve(law: StemLaw) -> None:
    """A valve that is written into a model's constants is read back unchanged, including the reversal that a
    sliding stem ignores."""
    assert friction_of(with_friction(neutral(), law)) == pytest.approx(law)
