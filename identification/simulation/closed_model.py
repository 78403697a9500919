"""The whole loop model, with any of the catalogue's physics, closed by a PI controller: one step a sample."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.errors import NotAssessedError
from identification.record import Floats
from identification.simulation.acts import acting
from identification.simulation.open_loop import (
    ModelInputs,
    counted_from_level,
    gain_over_record,
    load_over_record,
    outflow_head,
)
from identification.simulation.parameters import Slot
from identification.simulation.pi import Law, next_op
from identification.simulation.process import at_start, vessel_span
from identification.simulation.valve_chain import Friction, flow_step, friction_of, memory

CLIP_HI, CLIP_LO = int(Slot.CLIP_HI), int(Slot.CLIP_LO)


@njit(cache=True, error_model="numpy")
def _closed(
    sp: Floats,
    load: Floats,
    gain: Floats,
    c: Floats,
    law: Law,
    friction: Friction,
    m: Floats,
    frame: tuple[float, float, float, float],
    start: tuple[float, float],
) -> tuple[Floats, Floats]:
    dt_s, middle, level, head = frame
    op, e1 = start
    n = sp.size
    pv, out, flow, free = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    flow[0] = flow_step(op, m.copy(), c, friction, dt_s, middle)
    vessel = at_start(flow[0], c, middle)
    for k in range(n):
        x = (1.0 - c[Slot.SHARE]) * vessel[0] + c[Slot.SHARE] * vessel[1]
        pv[k] = min(max(level + x, c[CLIP_LO]), c[CLIP_HI])
        e = sp[k] - pv[k]
        op = next_op(op, law, e, e1, 0.0)
        e1 = e
        out[k] = op
        flow[k] = flow_step(op, m, c, friction, dt_s, middle)
        vessel = vessel_span((k, k + 1), vessel, (flow, load, gain), c, dt_s, middle, head, free)
    return pv, out


def closed_model(
    inputs: ModelInputs, c: Floats, sp: Floats, kp: float, ti_samples: float
) -> tuple[Floats, Floats]:
    """PV and OP, shape (n,) each [% of span], of a model under its PI controller.

    inputs : its `op` gives the OP at rest by its first value, and the length; c : shape (SIZE,), parameters of the
    model; START is where PV stands at first; sp : shape (n,), set point [% PV]; kp : gain [% OP/% PV]; ti_samples :
    integral time [samples]. Raises NotAssessedError: where transport with the flow's speed, or an effect without
    lines in the kernel, is in the model.
    """
    if c[Slot.PIPE] != 0 or acting(c):
        raise NotAssessedError(
            "needs a model that can be stepped sample by sample, has one with transport at the flow's speed, or with "
            "an effect that acts on whole trends: run it open loop"
        )
    op0 = float(inputs.op[0])
    e0 = float(sp[0]) - (inputs.level + float(c[Slot.START]))
    ti = ti_samples if math.isfinite(ti_samples) else math.inf
    law = (kp, kp / ti, 0.0, 0.0, 100.0)
    own = counted_from_level(inputs, c)
    frame = (inputs.dt_s, inputs.middle, inputs.level, outflow_head(inputs, c))
    gain, load = gain_over_record(inputs, c), load_over_record(inputs, c)
    return _closed(sp, load, gain, own, law, friction_of(c), memory(op0), frame, (op0, e0))
