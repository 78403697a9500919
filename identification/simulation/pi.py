"""The PI(D) law, once: the velocity form with backward-Euler integration and derivative on PV.

OP(k) = OP(k-1) + kp (e(k) - e(k-1)) + ki e(k) - kd (PV(k) - 2 PV(k-1) + PV(k-2)), held within its limits, which is
its anti-windup; ki = kp dt/Ti, kd = kp Td/dt. e = SP - PV, so kp > 0 means that OP falls when PV rises.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.models import Pid
from identification.record import Floats

Law = tuple[float, float, float, float, float]
"""kp, ki, kd and the limits of OP [% OP], per scan."""


def per_scan(c: Pid, scan_s: float) -> Law:
    """The law's constants at a scan interval [s]."""
    ki = c.kp * scan_s / c.ti_s if c.ti_s > 0 and math.isfinite(c.ti_s) else 0.0
    return c.kp, ki, c.kp * c.td_s / scan_s, c.op_lo, c.op_hi


@njit(cache=True)
def next_op(op: float, law: Law, e: float, e1: float, bend: float) -> float:
    """OP after one scan, of the OP before; bend : second difference of PV."""
    kp, ki, kd, low, high = law
    op += kp * (e - e1) + ki * e - kd * bend
    return min(max(op, low), high)


def due_moves(e: Floats, kp: float, ti: float) -> Floats:
    """Moves of OP that a PI law asks for at each sample, shape (n,); ti [samples]."""
    return np.asarray(kp * (np.diff(e, prepend=e[0]) + e / ti))


@njit(cache=True)
def gapped(e: Floats, kp: float, ki: float, width: float, catches_up: bool) -> Floats:
    """Path of OP, shape (n,), of a PI that stands still while |e| < width, from 0 and without limits.

    catches_up : whether the proportional part, on leaving the gap, answers for what e did within.
    """
    out = np.empty_like(e)
    law = (kp, ki, 0.0, -np.inf, np.inf)
    u, last = 0.0, e[0]
    for k in range(e.size):
        if abs(e[k]) >= width:
            u = next_op(u, law, e[k], last, 0.0)
            last = e[k]
        elif not catches_up:
            last = e[k]
        out[k] = u
    return out


def free_path(e: Floats, kp: float, ti: float) -> Floats:
    """The level form of the same law, shape (n,): kp (e + sum of e / ti), up to a constant; ti [samples]."""
    return np.asarray(kp * (e + np.cumsum(e) / ti))
