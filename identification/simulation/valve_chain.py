"""From OP to flow, sample by sample: slew, positioner, backlash or stick-slip, stops, second valve, trim.

A step takes the OP of one sample and returns the mean flow over it. The valve's memory is an array of numbers, so
that an open loop under a recorded OP and a loop closed by its controller use the same steps.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.models import Motion
from identification.record import Floats
from identification.simulation.lag import held, lagged
from identification.simulation.parameters import Slot
from identification.simulation.valve import (
    SLIDES,
    TOLERANCES,
    StemLaw,
    first_slip,
    moved_stem,
    thresholds,
    walk,
)

COASTS = {Motion.RESTS: -1.0, Motion.HALTS: -0.5, Motion.SLIDES: 0.0}
"""The parameter COAST for each motion of the stem."""
BEHAVIOUR = {coast: TOLERANCES[motion] for motion, coast in COASTS.items()}
"""Tolerance of each; a larger parameter is the tolerance itself: the reversal of OP that a sliding stem ignores."""
COAST_OF = {tolerance: coast for coast, tolerance in BEHAVIOUR.items()}
SERVO_STEPS = 5
"""Steps of a positioner within one sample; ours: its period is never below four samples."""
RATE, SERVO, DAMPING, DEADBAND = (int(s) for s in (Slot.RATE, Slot.SERVO, Slot.DAMPING, Slot.DEADBAND))
STOP_HI, STOP_LO, BEND, SPLIT = (int(s) for s in (Slot.STOP_HI, Slot.STOP_LO, Slot.BEND, Slot.SPLIT))
RATIO, SPLIT_DEAD, SPLIT_LAG = (int(s) for s in (Slot.RATIO, Slot.SPLIT_DEAD, Slot.SPLIT_LAG))
STEM_T = int(Slot.STEM_T)
STRAIGHT = 1e-9
"""A curvature below this is treated as none."""
SLEWED, SERVED, SPEED, STEM, MOVING, TURNED, SECOND = range(7)
"""Indices of the valve's memory: slewing stem, positioner and its speed, stem with its motion and OP's extreme, lag
of the second valve."""


@njit(cache=True)
def slew_step(at: float, op: float, most: float) -> tuple[float, float]:
    """Mean position over a sample, and position after it, of a stem that moves by at most `most` [%] per sample."""
    gap = op - at
    if abs(gap) <= most:
        return op - 0.5 * gap * abs(gap) / most, op
    move = math.copysign(most, gap)
    return at + 0.5 * move, at + move


@njit(cache=True)
def servo_step(
    at: float, speed: float, op: float, lag_s: float, damping: float, band: float, dt_s: float
) -> tuple[float, float, float]:
    """Mean position over a sample, position and speed after it, of a position loop with a dead band [%]."""
    h = dt_s / SERVO_STEPS
    w = min(1.0 / lag_s, 0.7 / h)
    total = 0.0
    for _ in range(SERVO_STEPS):
        gap = op - at
        gap -= min(max(gap, -0.5 * band), 0.5 * band)
        speed += h * (w * w * gap - 2.0 * damping * w * speed)
        at += h * speed
        total += at
    return total / SERVO_STEPS, at, speed


@njit(cache=True)
def second_valve(x: float, c: Floats) -> float:
    """Flow at rest added by a second valve [% OP]: it takes over above the split point after a dead zone."""
    above = max(x - c[SPLIT], 0.0)
    return c[RATIO] * max(above - c[SPLIT_DEAD], 0.0) - above


@njit(cache=True)
def curved(x: float, bend: float, middle: float) -> float:
    """Flow of a trim whose local gain is exp(bend (x - middle)/100)."""
    return middle + math.expm1(min(max(bend * (x - middle) / 100.0, -30.0), 30.0)) * (100.0 / bend)


@njit(cache=True)
def flow_step(op: float, m: Floats, c: Floats, friction: StemLaw, dt_s: float, middle: float) -> float:
    """Mean flow over a sample [% OP]; updates the valve's memory `m`."""
    x = op
    if not math.isinf(c[RATE]):
        x, m[SLEWED] = slew_step(m[SLEWED], x, c[RATE] * dt_s)
    if c[SERVO] > 0.0:
        x, m[SERVED], m[SPEED] = servo_step(m[SERVED], m[SPEED], x, c[SERVO], c[DAMPING], c[DEADBAND], dt_s)
    if friction.breakaway > 0.0:
        stem = (m[STEM], m[MOVING], m[TURNED])
        x, (m[STEM], m[MOVING], m[TURNED]) = moved_stem(stem, x, friction, c[STEM_T], dt_s)
    x = min(max(x, c[STOP_LO]), c[STOP_HI])
    if not math.isinf(c[SPLIT]):
        extra = second_valve(x, c)
        if c[SPLIT_LAG] > 0.0:
            at = extra if math.isnan(m[SECOND]) else m[SECOND]
            remaining, mean = held(c[SPLIT_LAG], dt_s)
            extra, m[SECOND] = extra + (at - extra) * mean, extra + (at - extra) * remaining
        x += extra
    return x if abs(c[BEND]) < STRAIGHT else curved(x, c[BEND], middle)


@njit(cache=True)
def before_stem(op: Floats, c: Floats, dt_s: float) -> Floats:
    """Slew and positioner over a whole recording, shape (n,), by the same steps."""
    x = op.copy()
    if not math.isinf(c[RATE]):
        at, most = op[0], c[RATE] * dt_s
        for k in range(x.size):
            x[k], at = slew_step(at, x[k], most)
    if c[SERVO] > 0.0:
        at, speed = op[0], 0.0
        for k in range(x.size):
            x[k], at, speed = servo_step(at, speed, x[k], c[SERVO], c[DAMPING], c[DEADBAND], dt_s)
    return x


@njit(cache=True)
def behind_stem(x: Floats, c: Floats, dt_s: float, middle: float) -> Floats:
    """The chain from the stem on: stops, second valve, trim."""
    if not (math.isinf(c[STOP_HI]) and math.isinf(c[STOP_LO])):
        x = np.minimum(np.maximum(x, c[STOP_LO]), c[STOP_HI])
    if not math.isinf(c[SPLIT]):
        extra = np.empty_like(x)
        for k in range(x.size):
            extra[k] = second_valve(x[k], c)
        x = x + (lagged(extra, c[SPLIT_LAG], dt_s) if c[SPLIT_LAG] > 0.0 else extra)
    if abs(c[BEND]) >= STRAIGHT:
        out = np.empty_like(x)
        for k in range(x.size):
            out[k] = curved(x[k], c[BEND], middle)
        return out
    return x


def friction_of(c: Floats) -> StemLaw:
    """Friction of a model's valve."""
    away, sliding = thresholds(float(c[Slot.STICKBAND]), float(c[Slot.JUMP]))
    coast = float(c[Slot.COAST])
    return StemLaw(away, max(sliding, 0.0), BEHAVIOUR.get(coast, max(coast, SLIDES)))


def with_friction(c: Floats, law: StemLaw) -> Floats:
    """A model's parameters, shape (SIZE + own,), with another friction of the valve."""
    out = c.copy()
    out[Slot.STICKBAND], out[Slot.JUMP] = law.stickband, law.slip_jump
    out[Slot.COAST] = COAST_OF.get(law.tolerance, law.tolerance)
    return out


def memory(op: float, stem: float | None = None) -> Floats:
    """Memory of a valve at rest at an OP [% OP], shape (7,), optionally with another stem position."""
    return np.array([op, op, 0.0, op if stem is None else stem, 0.0, op, math.nan])


def flow(op: Floats, c: Floats, dt_s: float, middle: float) -> Floats:
    """Flow through the valve [% OP].

    op : shape (n,), recorded OP [% OP]; c : shape (SIZE,), constants of the model; dt_s : sample interval [s]; middle
    : OP at which a curved valve has unit gain [% OP]. Returns shape (n,), flow during each sample. A stem with
    friction starts at OP if OP ever slips it from there, otherwise at its position after the first slip; PLACE shifts
    the start, in breakaway distances.
    """
    x = before_stem(np.ascontiguousarray(op, dtype=np.float64), c, dt_s)
    law = friction_of(c)
    if law.breakaway > 0:
        moves = float(np.abs(x - x[0]).max()) > law.breakaway
        start = float(x[0]) if moves else first_slip(x, law)
        start += float(c[Slot.PLACE]) * law.breakaway
        x = walk(x, law, start, float(c[Slot.STEM_T]), dt_s)
    return np.asarray(behind_stem(x, c, dt_s, middle))
