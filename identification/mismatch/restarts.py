"""The stem placed anew at the start of each window, so that a model with friction is asked for what it can know.

True friction differs from slip to slip. Run open over hours, a model of one constant friction loses the stem's place
at the first slip that comes late, and then shows its own lost place instead of the loop. Over a cycle, from where the
stem stood, it shows what the valve does to PV. The place is the state at the window's start, estimated from the
window itself; constants are not touched.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.estimation.candidate import Problem
from identification.record import Floats
from identification.signals.filters import stretch_ends
from identification.simulation.effect import Signal, acted
from identification.simulation.open_loop import from_flow, simulate
from identification.simulation.parameters import Slot
from identification.simulation.valve import stem_step
from identification.simulation.valve_chain import before_stem, behind_stem, friction_of

PLACES = 9
"""Places of the stem that are tried within its friction band; ours: an eighth of the band apart."""
CARRIED_ON = 0.9
"""Squares left by another place, in those left by the stem carried on, from which it is placed anew; ours."""


@njit(cache=True)
def _left(
    op: Floats,
    y: Floats,
    first: int,
    last: int,
    dead: int,
    pole: float,
    gain: float,
    friction: tuple[float, float, float],
    stem: float,
    x: float,
    out: Floats,
) -> tuple[float, float, float]:
    """Squares about a line that a stem begun at a place leaves of PV; where stem and lag end; `out` is its path."""
    moving, turned = 0.0, op[first]
    n = t1 = t2 = r0 = r1 = r2 = 0.0
    for k in range(first, last):
        stem, moving, turned = stem_step(stem, moving, turned, op[k], friction[0], friction[1], friction[2])
        out[k] = stem
        x = pole * x + (1.0 - pole) * stem
        if k + dead < y.size:
            r, t = y[k + dead] - gain * x, float(k - first)
            n, t1, t2 = n + 1.0, t1 + t, t2 + t * t
            r0, r1, r2 = r0 + r, r1 + r * t, r2 + r * r
    if n < 3.0:
        return 0.0, stem, x
    spread = t2 - t1 * t1 / n
    slope = (r1 - t1 * r0 / n) / spread if spread > 0.0 else 0.0
    return r2 - r0 * r0 / n - slope * (r1 - t1 * r0 / n), stem, x


@njit(cache=True)
def placed(
    op: Floats,
    y: Floats,
    ends: np.ndarray,
    dead: int,
    pole: float,
    gain: float,
    friction: tuple[float, float, float],
) -> Floats:
    """Stem [% OP], shape (n,), placed in each window where it leaves least of PV, or carried on from the last one."""
    out, trial = np.empty_like(op), np.empty_like(op)
    stem, x = op[0], op[0]
    for i in range(ends.size - 1):
        first, last = ends[i], ends[i + 1]
        least, stem_on, x_on = _left(op, y, first, last, dead, pole, gain, friction, stem, x, out)
        least *= CARRIED_ON
        for j in range(PLACES):
            place = op[first] + friction[0] * (2.0 * j / (PLACES - 1) - 1.0)
            left, stem_j, x_j = _left(op, y, first, last, dead, pole, gain, friction, place, x, trial)
            if left < least:
                least, stem_on, x_on = left, stem_j, x_j
                out[first:last] = trial[first:last]
        stem, x = stem_on, x_on
    return out


def simulated_anew(p: Problem, c: Floats, window: int) -> Floats:
    """PV's deviation [% PV], shape (n,), the stem placed anew every so many samples; as simulate() without friction.

    Parameters
    ----------
    p : Problem
    c : ndarray of shape (SIZE + own,)
        Constants of the model.
    window : int
        Samples of a window.
    """
    inputs, friction = p.inputs, friction_of(c)
    if friction[0] <= 0.0:
        return simulate(inputs, c)
    op = before_stem(np.ascontiguousarray(acted(Signal.OP, inputs.op, c, inputs.dt_s)), c, inputs.dt_s)
    dead = round(float(c[Slot.L]) / inputs.dt_s)
    pole = math.exp(-inputs.dt_s / max(float(c[Slot.T]), 1e-9))
    stem = placed(op, p.y, stretch_ends(op.size, window), dead, pole, float(c[Slot.K]), friction)
    flow = behind_stem(stem, c, inputs.dt_s, inputs.middle)
    return from_flow(inputs, c, acted(Signal.FLOW, flow, c, inputs.dt_s))
