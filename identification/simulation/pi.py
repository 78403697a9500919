"""The PID law in velocity form, with backward-Euler integration and a filtered derivative.

PV first passes a lag of pv_filter_s. With e = SP - PV, dSP the move of SP, and s(e) the effective error (e; reduced
inside the gap; e abs(e) / 100), OP moves at each scan by

    kp (s(e(k)) - s(e(k-1) + (1 - sp_weight) dSP)) + ki s(e(k)) + D(k) - D(k-1)
    D(k) = a D(k-1) - kp Td / (Tf + dt) (PV(k) - PV(k-1) - td_sp_weight dSP),  Tf = Td / N,  a = Tf / (Tf + dt)

but by at most op_rate dt. OP is clipped to its limits, which is the anti-windup; ki = kp dt/Ti. kp > 0 means that
OP falls when PV rises. The derivative with its filter is that of Astrom, Hagglund (2006), in backward differences.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.signal import lfilter

from identification.models import ErrorForm, Pid
from identification.record import Floats


class Law(NamedTuple):
    """The constants of a law per scan: gains, shares of their last value kept by the filters [-], error shape, limits
    of OP [% OP] and its largest move [% OP]."""

    kp: float
    ki: float
    kd: float = 0.0
    slope_keep: float = 0.0
    pv_keep: float = 0.0
    gap: float = 0.0
    gap_gain: float = 0.0
    squared: float = 0.0
    op_lo: float = 0.0
    op_hi: float = 100.0
    most: float = math.inf
    sp_weight: float = 1.0
    td_sp_weight: float = 0.0


MEMORY = 500
"""Scans that the filters of a law are followed for: ours, five time constants of a filter of 100 scans."""
Memory = tuple[float, float, float, float]
"""OP, SP, filtered PV, and derivative part of the previous scan [%]."""


def kept(lag_s: float, scan_s: float) -> float:
    """Share of its last value that a lag keeps from scan to scan, in backward differences [-]."""
    return lag_s / (lag_s + scan_s)


def per_scan(c: Pid, scan_s: float) -> Law:
    """The law's constants at a scan interval [s]."""
    return Law(
        c.kp,
        c.ki * scan_s,
        c.kp * c.td_s / (c.slope_filter_s + scan_s),
        kept(c.slope_filter_s, scan_s),
        kept(c.pv_filter_s, scan_s),
        c.gap,
        c.gap_gain,
        float(c.error_form is ErrorForm.SQUARED),
        c.op_lo,
        c.op_hi,
        c.op_rate * scan_s if c.op_rate > 0 else math.inf,
        c.sp_weight,
        c.td_sp_weight,
    )


def from_noise(c: Pid, scan_s: float, lags: int, every: int = 1) -> Floats:
    """Autocovariance of OP [% OP squared] at so many lags of `every` scans, shape (lags,), under white noise in PV of
    variance 1 [% PV squared]: of gain and derivative, which the integral changes little from scan to scan."""
    law = per_scan(c, scan_s)
    pulse = np.zeros(lags * every + MEMORY)
    pulse[0] = 1.0
    seen = lfilter([1.0 - law.pv_keep], [1.0, -law.pv_keep], pulse)
    out = law.kp * seen + law.kd * lfilter([1.0, -1.0], [1.0, -law.slope_keep], seen)
    return np.array([out[: out.size - k] @ out[k:] for k in range(0, lags * every, every)])


@njit(cache=True)
def acting_error(e: float, law: Law) -> float:
    """The part of an error [% PV] on which the law acts."""
    if law.gap > 0.0:
        inside = min(max(e, -law.gap), law.gap)
        e += (law.gap_gain - 1.0) * inside
    return e * abs(e) / 100.0 if law.squared > 0.0 else e


@njit(cache=True)
def next_op(before: Memory, law: Law, sp: float, pv: float) -> Memory:
    """Memory after one scan; its first value is OP."""
    op, sp1, y1, d1 = before
    y = law.pv_keep * y1 + (1.0 - law.pv_keep) * pv
    moved = sp - sp1
    e = acting_error(sp - y, law)
    d = law.slope_keep * d1 - law.kd * (y - y1 - law.td_sp_weight * moved)
    move = law.kp * (e - acting_error(sp - law.sp_weight * moved - y1, law)) + law.ki * e + d - d1
    op = min(max(op + min(max(move, -law.most), law.most), law.op_lo), law.op_hi)
    return op, sp, y, d


def due_moves(e: Floats, kp: float, ti: float) -> Floats:
    """Moves of OP required by a PI law at each sample, shape (n,); ti [samples]."""
    return np.asarray(kp * (np.diff(e, prepend=e[0]) + e / ti))


@njit(cache=True)
def gapped(e: Floats, kp: float, ki: float, width: float, catches_up: bool) -> Floats:
    """Path of OP, shape (n,), of a PI with constant OP while |e| < width, from 0 and without limits.

    catches_up : whether the proportional part, on leaving the gap, includes the change of e inside it.
    """
    out = np.empty_like(e)
    u, last = 0.0, e[0]
    for k in range(e.size):
        if abs(e[k]) >= width:
            u += kp * (e[k] - last) + ki * e[k]
            last = e[k]
        elif not catches_up:
            last = e[k]
        out[k] = u
    return out


def free_path(e: Floats, kp: float, ti: float) -> Floats:
    """The level form of the same law, shape (n,): kp (e + sum of e / ti), up to a constant; ti [samples]."""
    return np.asarray(kp * (e + np.cumsum(e) / ti))
