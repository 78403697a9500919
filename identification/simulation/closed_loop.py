"""A loop closed from SP and load, as settings are searched with: controller, valve, lag or integrator."""

from __future__ import annotations

import numpy as np
from numba import njit

from identification.models import Fopdt, Loop
from identification.record import Floats, LoopRecord
from identification.simulation.discretization import discretize
from identification.simulation.pi import Law, next_op, per_scan
from identification.simulation.valve import constants_of, stem_step

CONTINUOUS_STEPS = 50
"""Steps per dead time (or time constant) that stand for a continuous controller, scan_s = 0; ours: at 50 the
period of the study's example is within 1 % of the limit."""


@njit(cache=True)
def _closed(
    sp: Floats,
    load: Floats,
    process: tuple[float, float, float, int],
    valve: tuple[float, float, float],
    law: Law,
    op0: float,
) -> tuple[Floats, Floats, Floats]:
    pole, now, before, delay = process
    breakaway, sliding, tolerance = valve
    n = sp.size
    pv, op, stem = np.empty(n), np.empty(n), np.empty(n)
    y, u, x = 0.0, op0, op0
    moving, turned = 0.0, op0
    rest = op0
    e1 = sp[0] - (sp[0] + load[0])
    y1 = sp[0] + load[0]
    y2 = y1
    for k in range(n):
        pv[k] = sp[0] + y + load[k]
        e = sp[k] - pv[k]
        u = next_op(u, law, e, e1, pv[k] - 2 * y1 + y2)
        e1, y2, y1 = e, y1, pv[k]
        op[k] = u
        if breakaway > 0:
            x, moving, turned = stem_step(x, moving, turned, u, breakaway, sliding, tolerance)
        else:
            x = u
        stem[k] = x
        late = stem[k - delay] - rest if k >= delay else 0.0
        later = stem[k - delay - 1] - rest if k >= delay + 1 else 0.0
        y = pole * y + now * late + before * later
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
    """A closed loop under SP and load, stepped at the controller's scan.

    The controller is the law of pi.py. The loop starts at rest with PV = sp[0].

    sp, load : shape (n,), set point, and load plus noise as they add to PV, at each scan [% PV]; op_start : OP of the
    loop at rest [% OP]. The record has dt_s of the controller's scan and the stem in `position`.
    """
    h = scan_step(loop)
    d = discretize(loop.process, h)
    pv, op, stem = _closed(
        np.ascontiguousarray(sp, dtype=np.float64),
        np.ascontiguousarray(load, dtype=np.float64),
        (d.pole, d.now, d.before, d.delay),
        constants_of(loop.valve),
        per_scan(loop.controller, h),
        float(op_start),
    )
    bad = np.zeros(pv.size, dtype=bool)
    return LoopRecord(tag, start_s, h, np.asarray(sp, dtype=np.float64), pv, op, bad, position=stem)
