"""Conversion of a model to plain data, and simulation of a saved model on another recording."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from identification.controller.check import StatedSettings
from identification.controller.pi_regression import shifted
from identification.errors import InputError
from identification.record import Floats
from identification.simulation.closed_loop import closed_model
from identification.simulation.open_loop import ModelInputs, begun_at_rest, simulate
from identification.simulation.parameters import KNOTS, STEPS, Slot, neutral, places

VERSION = 1
BIAS_PASSES = 4
"""Passes in which the bias and the start converge; ours: each leaves a share of time constant over record length."""
TIMED = (
    Slot.SINE,
    Slot.COSINE,
    Slot.NEIGHBOUR,
    Slot.START,
    Slot.PLACE,
    Slot.HEAD_BIAS,
    *(Slot.STEP + i for i in range(STEPS)),
    *(Slot.HEAD + i for i in range(KNOTS)),
)
"""Constants that belong to the fitted recording, not to the loop."""


def to_data(
    loop: str, inputs: ModelInputs, c: Floats, names: tuple[str, ...], late_s: float, pv_scale: Any
) -> dict[str, Any]:
    """The model as a JSON-compatible mapping; constants at their neutral value are omitted."""
    rest = neutral()
    own = {name: float(c[i]) for name, i in places().items() if c[i] != rest[i] and i not in TIMED}
    return {
        "version": VERSION,
        "loop": loop,
        "effects": list(names),
        "constants": own,
        "middle_op_pct": inputs.middle,
        "level_pv_pct": inputs.level,
        "late_s": late_s,
        "scale": pv_scale,
    }


def constants(data: dict[str, Any]) -> Floats:
    """Constants of a saved model, shape (SIZE,).

    Raises
    ------
    InputError
        The mapping is not a model of this kind.
    """
    try:
        c, place = neutral(), places()
        for name, value in data["constants"].items():
            c[place[name]] = float(value)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"a model without {error}", "a file that `triage explain --save-model` wrote", "save it again"
        ) from error
    if not (c[Slot.T] > 0 and c[Slot.L] >= 0 and np.isfinite([c[Slot.T], c[Slot.L], c[Slot.K]]).all()):
        raise InputError(
            f"time constant {c[Slot.T]:g} s, dead time {c[Slot.L]:g} s, gain {c[Slot.K]:g}",
            "positive times and a finite gain in seconds and percent",
            "check the model's units",
        )
    return c


def inputs_for(data: dict[str, Any], op: Floats, pv: Floats, dt_s: float) -> ModelInputs:
    """Inputs of a saved model from another recording."""
    level = float(data.get("level_pv_pct", np.mean(pv)))
    middle = float(data.get("middle_op_pct", np.mean(op)))
    return ModelInputs(op, dt_s, middle, level, (float(pv.min()), float(pv.max())))


def carried(data: dict[str, Any], op: Floats, pv: Floats, dt_s: float) -> Floats:
    """PV [% PV], shape (n,), of a saved model for another recording's OP, with a free constant bias."""
    c, inputs = constants(data), inputs_for(data, op, pv, dt_s)
    inside = (pv < c[Slot.CLIP_HI] - 1e-6) & (pv > c[Slot.CLIP_LO] + 1e-6)
    bias, out = 0.0, pv
    for _ in range(BIAS_PASSES):
        free = c.copy()
        free[Slot.START] = float(pv[0]) - inputs.level - bias
        for clip in (Slot.CLIP_HI, Slot.CLIP_LO):
            free[clip] = math.copysign(math.inf, neutral()[clip])
        free = begun_at_rest(inputs, free) if c[Slot.BEGUN] != 0.0 else free
        out = inputs.level + simulate(inputs, free)
        bias = float(np.mean(pv[inside] - out[inside])) if inside.any() else 0.0
    out = np.clip(out + bias, c[Slot.CLIP_LO], c[Slot.CLIP_HI])
    return shifted(out, -float(data.get("late_s", 0.0)) / dt_s)


def carried_closed(
    data: dict[str, Any], sp: Floats, op: Floats, pv: Floats, dt_s: float, stated: StatedSettings
) -> tuple[Floats, Floats]:
    """PV and OP, each shape (n,), of a saved model under its PI controller, without load and noise.

    Raises
    ------
    NotAssessedError
        The model cannot be simulated sample by sample (closed_model).
    """
    c, inputs = constants(data), inputs_for(data, op, pv, dt_s)
    c[Slot.START] = float(pv[0]) - inputs.level
    return closed_model(inputs, c, sp, stated.kp, stated.ti)
