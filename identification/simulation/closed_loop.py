"""Closed loops under a PI(D): one driven by SP and load, used for tuning, and the full model of explain."""

from __future__ import annotations

import numpy as np
from numba import njit

from identification.errors import NotAssessedError
from identification.models import Fopdt, Loop
from identification.record import Floats, LoopRecord
from identification.simulation.lag import Lag, discretize, stepped
from identification.simulation.open_loop import (
    ModelInputs,
    counted_from_level,
    gain_over_record,
    load_over_record,
    outflow_head,
)
from identification.simulation.parameters import Slot, acting
from identification.simulation.pi import Law, next_op, per_scan
from identification.simulation.valve import StemLaw, law_of, stem_step
from identification.simulation.valve_chain import flow_step, friction_of, memory
from identification.simulation.vessel import at_start, vessel_span

CONTINUOUS_STEPS = 50
"""Steps per dead time (or time constant) that approximate a continuous controller, scan_s = 0; ours: at 50 the period
of the study's example is within 1 % of the limit."""


@njit(cache=True)
def _closed(
    sp: Floats,
    load: Floats,
    process: Lag,
    valve: StemLaw,
    law: Law,
    op0: float,
) -> tuple[Floats, Floats, Floats]:
    n = sp.size
    pv, op, stem = np.empty(n), np.empty(n), np.empty(n)
    y = 0.0
    moved, rest = (op0, 0.0, op0), op0
    seen = (op0, sp[0], sp[0] + load[0], 0.0)
    for k in range(n):
        pv[k] = sp[0] + y + load[k]
        seen = next_op(seen, law, sp[k], pv[k])
        u = seen[0]
        op[k] = u
        moved = stem_step(moved, u, valve)
        stem[k] = moved[0] if valve.breakaway > 0 else u
        late = stem[k - process.delay] - rest if k >= process.delay else 0.0
        later = stem[k - process.delay - 1] - rest if k > process.delay else 0.0
        y = stepped(y, process, late, later)
    return pv, op, stem


def scan_step(loop: Loop) -> float:
    """Step [s] of a closed-loop simulation: the scan, or a fine step for a continuous controller."""
    if loop.controller.scan_s > 0:
        return loop.controller.scan_s
    scale = loop.process.dead_time_s
    if scale <= 0:
        scale = loop.process.time_constant_s if isinstance(loop.process, Fopdt) else loop.controller.ti_s
    return scale / CONTINUOUS_STEPS


def closed_loop(
    loop: Loop, sp: Floats, load: Floats, op_start: float = 50.0, tag: str = "simulated", start_s: float = 0.0
) -> LoopRecord:
    """Simulate a closed loop under SP and load, stepped at the controller's scan.

    The controller is the law of pi.py. The loop starts at rest with PV = sp[0].

    sp, load : shape (n,), set point, and load plus noise as they add to PV, at each scan [% PV]; op_start : OP of the
    loop at rest [% OP]. The record has dt_s of the controller's scan and the stem in `position`.
    """
    h = scan_step(loop)
    pv, op, stem = _closed(
        np.ascontiguousarray(sp, dtype=np.float64),
        np.ascontiguousarray(load, dtype=np.float64),
        discretize(loop.process, h),
        law_of(loop.valve),
        per_scan(loop.controller, h),
        float(op_start),
    )
    bad = np.zeros(pv.size, dtype=bool)
    return LoopRecord(tag, start_s, h, np.asarray(sp, dtype=np.float64), pv, op, bad, position=stem)


CLIP_HI, CLIP_LO, SHARE = int(Slot.CLIP_HI), int(Slot.CLIP_LO), int(Slot.SHARE)


@njit(cache=True, error_model="numpy")
def _closed_model(
    sp: Floats,
    load: Floats,
    gain: Floats,
    c: Floats,
    law: Law,
    friction: StemLaw,
    m: Floats,
    frame: tuple[float, float, float, float],
    start: tuple[float, float],
) -> tuple[Floats, Floats]:
    dt_s, middle, level, head = frame
    op, pv0 = start
    seen = (op, sp[0], pv0, 0.0)
    n = sp.size
    pv, out, flow, free = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    flow[0] = flow_step(op, m.copy(), c, friction, dt_s, middle)
    vessel = at_start(flow[0], c, middle)
    for k in range(n):
        x = (1.0 - c[SHARE]) * vessel[0] + c[SHARE] * vessel[1]
        pv[k] = min(max(level + x, c[CLIP_LO]), c[CLIP_HI])
        seen = next_op(seen, law, sp[k], pv[k])
        op = seen[0]
        out[k] = op
        flow[k] = flow_step(op, m, c, friction, dt_s, middle)
        vessel = vessel_span((k, k + 1), vessel, (flow, load, gain), c, dt_s, middle, head, free)
    return pv, out


def closed_model(
    inputs: ModelInputs, c: Floats, sp: Floats, kp: float, ti_samples: float
) -> tuple[Floats, Floats]:
    """PV and OP, shape (n,) each [% of span], of a model under its PI controller.

    inputs : the first value of its `op` is the OP at rest, and its length is that of the simulation; c : shape
    (SIZE,), parameters of the model; START is the initial PV; sp : shape (n,), set point [% PV]; kp : gain [% OP/%
    PV]; ti_samples : integral time [samples]. Raises NotAssessedError if the model has transport with the flow's
    speed, or an effect without code in the kernel.
    """
    if c[Slot.PIPE] != 0 or acting(c):
        raise NotAssessedError(
            "needs a model that can be stepped sample by sample, has one with transport at the flow's speed, or with "
            "an effect that acts on whole trends: run it open loop"
        )
    op0 = float(inputs.op[0])
    pv0 = inputs.level + float(c[Slot.START])
    law = Law(kp, kp / ti_samples)
    own = counted_from_level(inputs, c)
    frame = (inputs.dt_s, inputs.middle, inputs.level, outflow_head(inputs, c))
    gain, load = gain_over_record(inputs, c), load_over_record(inputs, c)
    return _closed_model(sp, load, gain, own, law, friction_of(c), memory(op0), frame, (op0, pv0))
