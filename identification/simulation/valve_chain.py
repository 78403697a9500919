"""From OP to what the valve lets through, sample by sample: slew, positioner, friction, stops, split, curve."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.record import Floats
from identification.simulation.parameters import Slot
from identification.simulation.valve import HALTS, RESTS, SLIDES, first_slip, thresholds, walk

BEHAVIOUR = {-1.0: RESTS, -0.5: HALTS, 0.0: SLIDES}
"""What a stem in motion does, by the constant COAST."""
SERVO_STEPS = 5
"""Steps of a positioner within one sample; ours: its period is never under four samples."""


@njit(cache=True)
def slewed(op: Floats, rate: float, dt_s: float) -> Floats:
    """Mean position over each sample, shape (n,), of a stem that moves at `rate` [%/s] at most."""
    out = np.empty_like(op)
    at = op[0]
    most = rate * dt_s
    for k in range(op.size):
        gap = op[k] - at
        if abs(gap) <= most:
            out[k] = op[k] - 0.5 * gap * abs(gap) / most
            at = op[k]
        else:
            step = math.copysign(most, gap)
            out[k] = at + 0.5 * step
            at += step
    return out


@njit(cache=True)
def positioned(op: Floats, lag_s: float, damping: float, band: float, dt_s: float, steps: int) -> Floats:
    """Mean position over each sample, shape (n,), behind a position loop of second order with a dead band [%]."""
    out = np.empty_like(op)
    at, speed = op[0], 0.0
    h = dt_s / steps
    w = min(1.0 / lag_s, 0.7 / h)
    for k in range(op.size):
        total = 0.0
        for _ in range(steps):
            gap = op[k] - at
            gap -= min(max(gap, -0.5 * band), 0.5 * band)
            speed += h * (w * w * gap - 2.0 * damping * w * speed)
            at += h * speed
            total += at
        out[k] = total / steps
    return out


@njit(cache=True)
def lagged(x: Floats, lag_s: float, dt_s: float) -> Floats:
    """Mean over each sample, shape (n,), of a first-order lag of a held signal."""
    out = np.empty_like(x)
    at = x[0]
    pole = math.exp(-dt_s / lag_s)
    share = (1.0 - pole) * lag_s / dt_s
    for k in range(x.size):
        out[k] = x[k] + (at - x[k]) * share
        at = x[k] + (at - x[k]) * pole
    return out


def second_valve(stem: Floats, c: Floats, dt_s: float) -> Floats:
    """Flow, shape (n,), where a second valve takes over above the split point after a dead zone."""
    above = np.maximum(stem - c[Slot.SPLIT], 0.0)
    extra = c[Slot.RATIO] * np.maximum(above - c[Slot.SPLIT_DEAD], 0.0) - above
    if c[Slot.SPLIT_LAG] > 0:
        extra = lagged(extra, c[Slot.SPLIT_LAG], dt_s)
    return stem + extra


def curved(stem: Floats, bend: float, middle: float) -> Floats:
    """Flow, shape (n,), of a trim whose local gain is exp(bend (z - middle)/100)."""
    if abs(bend) < 1e-9:
        return stem
    return middle + np.expm1(np.clip(bend * (stem - middle) / 100.0, -30.0, 30.0)) * (100.0 / bend)


def friction(op: Floats, c: Floats) -> Floats:
    """Stem, shape (n,), behind play or stick-slip; it starts where OP does, if it ever leaves there."""
    away, sliding = thresholds(c[Slot.STICKBAND], c[Slot.JUMP])
    coast = BEHAVIOUR.get(float(c[Slot.COAST]), SLIDES)
    moves = float(np.abs(op - op[0]).max()) > away
    start = float(op[0]) if moves else first_slip(op, away, sliding)
    return walk(op, away, max(sliding, 0.0), coast, start)


def flow(op: Floats, c: Floats, dt_s: float, middle: float) -> Floats:
    """Flow through the valve [% OP].

    Parameters
    ----------
    op : ndarray of shape (n,)
        Recorded OP [% OP].
    c : ndarray of shape (SIZE,)
        Constants of the model.
    dt_s : float
        Sample interval [s].
    middle : float
        OP at which a curved valve has unit gain [% OP].

    Returns
    -------
    ndarray of shape (n,)
        Flow during each sample.
    """
    x = op
    if math.isfinite(c[Slot.RATE]):
        x = slewed(x, c[Slot.RATE], dt_s)
    if c[Slot.SERVO] > 0:
        x = positioned(x, c[Slot.SERVO], c[Slot.DAMPING], c[Slot.DEADBAND], dt_s, SERVO_STEPS)
    if c[Slot.STICKBAND] > 0:
        x = friction(x, c)
    if math.isfinite(c[Slot.STOP_HI]) or math.isfinite(c[Slot.STOP_LO]):
        x = np.clip(x, c[Slot.STOP_LO], c[Slot.STOP_HI])
    if math.isfinite(c[Slot.SPLIT]):
        x = second_valve(x, c, dt_s)
    return curved(x, c[Slot.BEND], middle)
