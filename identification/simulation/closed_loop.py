"""The simulator: a loop open from a recorded OP, or closed from SP and load.

Between two scans OP, and so the stem of a rate-independent valve, stands still; stepping at the scan with
the exact zero-order-hold discretization is therefore exact, fractional dead time included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identification.models import Backlash, Fopdt, Integrator, Loop, Process, Valve
from identification.record import Floats, LoopRecord
from identification.simulation.valve import RESTS, stem_position, stem_step, thresholds

CONTINUOUS_STEPS = 50
"""Steps per dead time (or time constant) that stand for a continuous controller, scan_s = 0; ours: at 50 the
period of the study's example is within 1 % of the limit."""


@dataclass(frozen=True, slots=True)
class Discrete:
    """y[k+1] = pole y[k] + now v[k-delay] + before v[k-delay-1], the exact zero-order hold of a process."""

    pole: float
    now: float
    before: float
    delay: int


def discretize(process: Process, dt_s: float) -> Discrete:
    """Exact zero-order-hold discretization with fractional dead time.

    Parameters
    ----------
    process : Fopdt or Integrator
    dt_s : float
        Step [s], > 0.

    Returns
    -------
    Discrete
        With gains in % PV per % OP.
    """
    steps = process.dead_time_s / dt_s
    delay = math.floor(steps + 1e-12)
    fraction = max(steps - delay, 0.0)
    if isinstance(process, Integrator):
        k = process.slope * dt_s
        return Discrete(1.0, k * (1 - fraction), k * fraction, delay)
    pole = math.exp(-dt_s / process.time_constant_s)
    rest = math.exp(-dt_s * (1 - fraction) / process.time_constant_s)
    return Discrete(pole, process.gain * (1 - rest), process.gain * (rest - pole), delay)


@njit(cache=True)
def respond(stem: Floats, pole: float, now: float, before: float, delay: int) -> Floats:
    """Response [% PV], shape (n,), of a discretized process at rest to a stem given as deviation [% OP]."""
    out = np.empty_like(stem)
    y = 0.0
    for k in range(stem.size):
        out[k] = y
        late = stem[k - delay] if k >= delay else stem[0]
        later = stem[k - delay - 1] if k >= delay + 1 else stem[0]
        y = pole * y + now * late + before * later
    return out


def open_loop(process: Process, valve: Valve, op: Floats, dt_s: float, start: float | None = None) -> Floats:
    """PV's deviation that a recorded OP gives through valve and process.

    Parameters
    ----------
    process, valve
        The model.
    op : ndarray of shape (n,)
        Controller output [% OP].
    dt_s : float
        Sample interval [s].
    start : float or None
        Stem position before the first sample [% OP].

    Returns
    -------
    ndarray of shape (n,)
        Deviation of PV [% PV] from its first value; the process rests with the stem at its first position.
    """
    stem = stem_position(op, valve, start)
    d = discretize(process, dt_s)
    return respond(stem - stem[0], d.pole, d.now, d.before, d.delay)


@njit(cache=True)
def _closed(
    sp: Floats,
    load: Floats,
    process: tuple[float, float, float, int],
    valve: tuple[float, float, float],
    law: tuple[float, float, float, float, float],
    op0: float,
) -> tuple[Floats, Floats, Floats]:
    pole, now, before, delay = process
    breakaway, sliding, tolerance = valve
    kp, ki, kd, lo, hi = law
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
        u += kp * (e - e1) + ki * e - kd * (pv[k] - 2 * y1 + y2)
        u = min(max(u, lo), hi)
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


def _valve_constants(valve: Valve) -> tuple[float, float, float]:
    if valve is None:
        return 0.0, 0.0, RESTS
    if isinstance(valve, Backlash):
        return *thresholds(valve.width, 0.0), RESTS
    return *thresholds(valve.stickband, valve.slip_jump), 0.0 if valve.slides else RESTS


def closed_loop(
    loop: Loop, sp: Floats, load: Floats, op_start: float = 50.0, tag: str = "simulated", start_s: float = 0.0
) -> LoopRecord:
    """A closed loop under SP and load, stepped at the controller's scan.

    The controller is the velocity form with backward-Euler integration, derivative on PV, clamped at its
    output limits (which is its anti-windup). The loop starts at rest with PV = sp[0].

    Parameters
    ----------
    loop : Loop
    sp, load : ndarray of shape (n,)
        Set point, and load plus noise as they add to PV, at each scan [% PV].
    op_start : float
        OP of the loop at rest [% OP].

    Returns
    -------
    LoopRecord
        With dt_s the controller's scan and the stem in `position`.
    """
    h = scan_step(loop)
    d = discretize(loop.process, h)
    c = loop.controller
    ki = c.kp * h / c.ti_s if c.ti_s > 0 and math.isfinite(c.ti_s) else 0.0
    pv, op, stem = _closed(
        np.ascontiguousarray(sp, dtype=np.float64),
        np.ascontiguousarray(load, dtype=np.float64),
        (d.pole, d.now, d.before, d.delay),
        _valve_constants(loop.valve),
        (c.kp, ki, c.kp * c.td_s / h, c.op_lo, c.op_hi),
        float(op_start),
    )
    bad = np.zeros(pv.size, dtype=bool)
    return LoopRecord(tag, start_s, h, np.asarray(sp, dtype=np.float64), pv, op, bad, position=stem)
