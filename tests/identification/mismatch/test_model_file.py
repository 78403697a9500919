"""A saved model runs over other recordings, and refuses what is none."""

from __future__ import annotations

import json

import numpy as np
import pytest

from identification.controller.check import StatedSettings
from identification.errors import InputError
from identification.mismatch.model_file import carried, carried_closed, constants, to_data
from identification.simulation.open_loop import ModelInputs, simulate
from identification.simulation.parameters import Slot, neutral


def model() -> tuple[ModelInputs, np.ndarray]:
    """A plain loop with play, and OP that moves."""
    op = 50 + np.repeat(np.random.default_rng(1).uniform(-5, 5, 20), 30)
    c = neutral()
    c[Slot.K], c[Slot.T], c[Slot.L], c[Slot.STICKBAND] = 1.5, 40.0, 7.0, 2.0
    return ModelInputs(op, 2.0, 50.0, 48.0, (40.0, 60.0)), c


def test_model_survives_json() -> None:
    """Written to JSON and read again a model gives the same PV, but for the bias that is freed."""
    inputs, c = model()
    data = json.loads(json.dumps(to_data("A", inputs, c, ("backlash",), 0.0, {})))
    pv = inputs.level + simulate(inputs, c)
    assert np.allclose(constants(data), c)
    assert np.allclose(carried(data, inputs.op, pv + 3.0, 2.0) - pv, 3.0, atol=0.2)


def test_closed_loop_settles_at_setpoint() -> None:
    """Under its PI the carried model ends at SP."""
    inputs, c = model()
    c[Slot.STICKBAND] = 0.0
    data = to_data("A", inputs, c, (), 0.0, {})
    sp = np.where(np.arange(600) < 100, 48.0, 52.0)
    pv, op = carried_closed(data, sp, np.full(600, 50.0), np.full(600, 48.0), 2.0, StatedSettings(1.0, 20.0))
    assert pv[-1] == pytest.approx(52.0, abs=0.05)
    assert op[-1] == pytest.approx(50.0 + 4.0 / 1.5, abs=0.1)


@pytest.mark.parametrize("data", [{}, {"constants": {"T": "x"}}, {"constants": {"T": -3.0}}])
def test_what_is_no_model_is_refused(data: dict) -> None:
    """A file that holds no model, or one of impossible units, is refused with a line that says so."""
    with pytest.raises(InputError):
        constants(data)
