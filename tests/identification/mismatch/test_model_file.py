"""A saved model runs on other recordings, and files that hold no model are refused."""

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
    """A loop with backlash and a moving OP."""
    op = 50 + np.repeat(np.random.default_rng(1).uniform(-5, 5, 20), 30)
    c = neutral()
    c[Slot.K], c[Slot.T], c[Slot.L], c[Slot.STICKBAND] = 1.5, 40.0, 7.0, 2.0
    return ModelInputs(op, 2.0, 50.0, 48.0, (40.0, 60.0)), c


def test_model_survives_json() -> None:
    """A model that is written to JSON and read again gives the same PV, except for a free bias."""
    inputs, c = model()
    data = json.loads(json.dumps(to_data("A", inputs, c, ("backlash",), 0.0, {})))
    pv = inputs.level + simulate(inputs, c)
    assert np.allclose(constants(data), c)
    assert np.allclose(carried(data, inputs.op, pv + 3.0, 2.0) - pv, 3.0, atol=0.2)


def test_closed_loop_settles_at_setpoint() -> None:
    """Under its PI controller the saved model settles at SP."""
    inputs, c = model()
    c[Slot.STICKBAND] = 0.0
    data = to_data("A", inputs, c, (), 0.0, {})
    sp = np.where(np.arange(600) < 100, 48.0, 52.0)
    pv, op = carried_closed(data, sp, np.full(600, 50.0), np.full(600, 48.0), 2.0, StatedSettings(1.0, 20.0))
    assert pv[-1] == pytest.approx(52.0, abs=0.05)
    assert op[-1] == pytest.approx(50.0 + 4.0 / 1.5, abs=0.1)


@pytest.mark.parametrize("data", [{}, {"constants": {"T": "x"}}, {"constants": {"T": -3.0}}])
def test_a_file_without_a_model_is_refused(data: dict) -> None:
    """A file without a model, or with impossible constants, is refused with an error."""
    with pytest.raises(InputError):
        constants(data)
