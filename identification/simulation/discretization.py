"""A first-order process with dead time on a clock: the exact zero-order hold, fractional dead time included.

Between two scans OP, and so the stem of a rate-independent valve, stands still; stepping at the scan is then exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identification.models import Integrator, Process
from identification.record import Floats

WHOLE = 1e-12
"""A dead time this close below a whole number of samples is that many."""


@njit(cache=True)
def unit_lag(time_constant_s: float, dead_time_s: float, dt_s: float) -> tuple[float, float, float, int]:
    """Of a unit-gain lag: pole, now, before, delay with y[k+1] = pole y[k] + now v[k-delay] + before v[k-delay-1]."""
    steps = dead_time_s / dt_s
    delay = math.floor(steps + WHOLE)
    fraction = max(steps - delay, 0.0)
    pole = math.exp(-dt_s / time_constant_s)
    rest = math.exp(-dt_s * (1 - fraction) / time_constant_s)
    return pole, 1 - rest, rest - pole, delay


@njit(cache=True)
def unit_ramp(dead_time_s: float, dt_s: float) -> tuple[float, float, float, int]:
    """The same of an integrator of unit slope."""
    steps = dead_time_s / dt_s
    delay = math.floor(steps + WHOLE)
    fraction = max(steps - delay, 0.0)
    return 1.0, dt_s * (1 - fraction), dt_s * fraction, delay


@njit(cache=True)
def respond(stem: Floats, pole: float, now: float, before: float, delay: int) -> Floats:
    """Response, shape (n,), to a stem, of a discretized process at rest at first; the stem before its first value is
    as its first."""
    out = np.empty_like(stem)
    y = 0.0
    for k in range(stem.size):
        out[k] = y
        y = pole * y + now * stem[max(k - delay, 0)] + before * stem[max(k - delay - 1, 0)]
    return out


@njit(cache=True)
def respond_in_blocks(
    stem: Floats, pole: float, now: float, before: float, delay: int, factor: int
) -> Floats:
    """The same as means of blocks of the stem's own samples, shape (n // factor,)."""
    n = stem.size // factor
    out = np.empty(n)
    y, k = 0.0, 0
    for block in range(n):
        total = 0.0
        for _ in range(factor):
            total += y
            y = pole * y + now * stem[max(k - delay, 0)] + before * stem[max(k - delay - 1, 0)]
            k += 1
        out[block] = total / factor
    return out


@njit(cache=True)
def respond_together(
    stems: tuple[Floats, Floats, Floats], lags: Floats, delays: NDArray[np.int64], factor: int
) -> Floats:
    """Three of these at once, shape (3, n // factor); `lags` are rows of pole, now and before, shape (3, 3).

    Each step waits for the one before, so three side by side take hardly longer than one.
    """
    s0, s1, s2 = stems
    n = s0.size // factor
    out = np.empty((3, n))
    y0, y1, y2, k = 0.0, 0.0, 0.0, 0
    for block in range(n):
        t0, t1, t2 = 0.0, 0.0, 0.0
        for _ in range(factor):
            t0, t1, t2 = t0 + y0, t1 + y1, t2 + y2
            i0, i1, i2 = k - delays[0], k - delays[1], k - delays[2]
            y0 = lags[0, 0] * y0 + lags[0, 1] * s0[max(i0, 0)] + lags[0, 2] * s0[max(i0 - 1, 0)]
            y1 = lags[1, 0] * y1 + lags[1, 1] * s1[max(i1, 0)] + lags[1, 2] * s1[max(i1 - 1, 0)]
            y2 = lags[2, 0] * y2 + lags[2, 1] * s2[max(i2, 0)] + lags[2, 2] * s2[max(i2 - 1, 0)]
            k += 1
        out[0, block], out[1, block], out[2, block] = t0 / factor, t1 / factor, t2 / factor
    return out


@dataclass(frozen=True, slots=True)
class Discrete:
    """y[k+1] = pole y[k] + now v[k-delay] + before v[k-delay-1], the exact zero-order hold of a process."""

    pole: float
    now: float
    before: float
    delay: int


def discretize(process: Process, dt_s: float) -> Discrete:
    """Exact zero-order-hold discretization with fractional dead time.

    dt_s : step [s], > 0. Gains come in % PV per % OP.
    """
    if isinstance(process, Integrator):
        gain, found = process.slope, unit_ramp(process.dead_time_s, dt_s)
    else:
        gain, found = process.gain, unit_lag(process.time_constant_s, process.dead_time_s, dt_s)
    pole, now, before, delay = found
    return Discrete(pole, gain * now, gain * before, delay)
