"""The model in closed loop has the same response as in open loop, and its OP is that of the controller."""

from __future__ import annotations

import numpy as np
import pytest

from identification.errors import NotAssessedError
from identification.models import Backlash, Fopdt, Integrator, Loop, Motion, Pid, Process, Stiction, Valve
from identification.simulation.closed_loop import closed_loop, closed_model
from identification.simulation.open_loop import ModelInputs, as_parameters, simulate
from identification.simulation.parameters import Slot

N, KP, TI = 900, 0.8, 25.0
STICKING = Stiction(1.5, 0.9, Motion.HALTS)


def inputs(op: np.ndarray | None = None) -> ModelInputs:
    """A loop at rest at 50 %, with one sample per second."""
    return ModelInputs(np.full(N, 50.0) if op is None else op, 1.0, 50.0, 50.0, (30.0, 70.0), (400,))


def setpoint() -> np.ndarray:
    """A sequence of set-point steps."""
    return 50.0 + np.repeat(np.array([0.0, 4.0, -3.0, 6.0, 1.0, -5.0]), N // 6)


@pytest.mark.parametrize(
    "extra",
    [
        {},
        {"T2": 6.0, "T3": 2.0},
        {"SHARE": 0.3, "MODE_T": 90.0},
        {"SHARE": -0.4, "MODE_T": 5.0},
        {"SLOPE": 0.4},
        {"GAIN_SLOPE": -0.5, "SPEED": -1.0},
        {"ROOT": 0.8},
        {"CAP": 53.0},
        {"T2": 12.0, "UPPER_CAP": 52.0, "PASSED": 0.5, "BEGUN": -2.0},
        {"ASYMMETRY": 0.8},
        {"RATE": 0.3},
        {"SERVO": 3.0, "DEADBAND": 0.4},
        {"SPLIT": 52.0, "RATIO": 1.8, "SPLIT_DEAD": 0.5, "SPLIT_LAG": 4.0},
        {"BEND": 2.0, "STOP_HI": 55.0},
        {"STEP": 3.0, "DRIFT": 0.3},
        {"CLIP_HI": 53.0},
    ],
    ids=lambda e: "+".join(e) or "baseline",
)
def test_closed_is_open_under_its_own_output(extra: dict[str, float]) -> None:
    """PV of the closed loop equals PV of the open-loop model under the OP of the closed loop."""
    c = as_parameters(Fopdt(1.4, 18.0, 3.4), STICKING if "SERVO" not in extra else None)
    for name, value in extra.items():
        c[Slot[name]] = value
    pv, op = closed_model(inputs(), c, setpoint(), KP, TI)
    again = 50.0 + simulate(inputs(op), c)
    assert np.ptp(pv) > 1.0
    np.testing.assert_allclose(pv, again, atol=1e-7)


def test_output_is_that_of_the_controller() -> None:
    """Each OP move is kp times the move of the error plus its share over Ti."""
    pv, op = closed_model(inputs(), as_parameters(Fopdt(1.4, 18.0, 3.4)), setpoint(), KP, TI)
    e = setpoint() - pv
    moves = KP * (np.diff(e) + e[1:] / TI)
    np.testing.assert_allclose(np.diff(op), moves, atol=1e-9)


@pytest.mark.parametrize("process", [Fopdt(1.4, 18.0, 3.4), Integrator(0.05, 2.7)])
@pytest.mark.parametrize("valve", [None, Backlash(1.5), *(Stiction(1.5, 0.9, m) for m in Motion)])
def test_both_closed_loops_agree(process: Process, valve: Valve) -> None:
    """The simulator of the settings search and that of saved models give the same closed loop."""
    loop = Loop(process, Pid(KP, TI), valve)
    searched = closed_loop(loop, setpoint(), np.zeros(N))
    pv, op = closed_model(inputs(), as_parameters(process, valve), setpoint(), KP, TI)
    np.testing.assert_allclose(pv, searched.pv, atol=1e-6)
    np.testing.assert_allclose(op, searched.op, atol=1e-6)


def test_transport_by_flow_is_refused() -> None:
    """A dead time that depends on the flow cannot be simulated in closed loop, and the error states this."""
    c = as_parameters(Fopdt(1.4, 18.0, 3.4))
    c[Slot.PIPE] = 0.5
    with pytest.raises(NotAssessedError, match="run it open loop"):
        closed_model(inputs(), c, setpoint(), KP, TI)
