"""A first-order process with dead time on a clock: the exact zero-order hold, including fractional dead time.

Between two scans OP is constant, and so is the stem of a rate-independent valve; stepping at the scan is then exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.models import Integrator, Process
from identification.record import Floats

WHOLE = 1e-12
"""A dead time this close below a whole number of samples is rounded to it."""


class Lag(NamedTuple):
    """y[k+1] = pole y[k] + now v[k-delay] + before v[k-delay-1], the exact zero-order hold of a process."""

    pole: float
    now: float
    before: float
    delay: int


@njit(cache=True)
def _whole_and_part(dead_time_s: float, dt_s: float) -> tuple[int, float]:
    """A dead time in whole samples, and the remaining fraction [-]."""
    steps = dead_time_s / dt_s
    delay = math.floor(steps + WHOLE)
    return delay, max(steps - delay, 0.0)


@njit(cache=True)
def unit_lag(time_constant_s: float, dead_time_s: float, dt_s: float) -> Lag:
    """A lag of unit gain."""
    delay, part = _whole_and_part(dead_time_s, dt_s)
    pole = math.exp(-dt_s / time_constant_s)
    rest = math.exp(-dt_s * (1 - part) / time_constant_s)
    return Lag(pole, 1 - rest, rest - pole, delay)


@njit(cache=True)
def unit_ramp(dead_time_s: float, dt_s: float) -> Lag:
    """An integrator of unit slope."""
    delay, part = _whole_and_part(dead_time_s, dt_s)
    return Lag(1.0, dt_s * (1 - part), dt_s * part, delay)


def discretize(process: Process, dt_s: float) -> Lag:
    """Any process of models.py, its gain in % PV per % OP, at a step [s] > 0."""
    if isinstance(process, Integrator):
        gain, unit = process.slope, unit_ramp(process.dead_time_s, dt_s)
    else:
        gain, unit = process.gain, unit_lag(process.time_constant_s, process.dead_time_s, dt_s)
    return unit._replace(now=gain * unit.now, before=gain * unit.before)


@njit(cache=True, inline="always")
def stepped(y: float, lag: Lag, late: float, later: float) -> float:
    """The response one sample later, for the input `delay` samples ago and the one before."""
    return lag.pole * y + lag.now * late + lag.before * later


@njit(cache=True)
def respond(stem: Floats, lag: Lag, factor: int = 1) -> Floats:
    """Response to a stem, shape (n // factor,), as means of blocks of its samples, of a process initially at rest.

    The stem before its first value is equal to the first.
    """
    n = stem.size // factor
    out = np.empty(n)
    y, k = 0.0, 0
    for block in range(n):
        total = 0.0
        for _ in range(factor):
            total += y
            y = stepped(y, lag, stem[max(k - lag.delay, 0)], stem[max(k - lag.delay - 1, 0)])
            k += 1
        out[block] = total / factor
    return out


@njit(cache=True)
def respond_together(stems: tuple[Floats, Floats, Floats], lags: tuple[Lag, Lag, Lag], factor: int) -> Floats:
    """Three such responses at once, shape (3, n // factor).

    Each step depends on the one before, so three in parallel take hardly longer than one.
    """
    (s0, s1, s2), (l0, l1, l2) = stems, lags
    n = s0.size // factor
    out = np.empty((3, n))
    y0, y1, y2, k = 0.0, 0.0, 0.0, 0
    for block in range(n):
        t0, t1, t2 = 0.0, 0.0, 0.0
        for _ in range(factor):
            t0, t1, t2 = t0 + y0, t1 + y1, t2 + y2
            y0 = stepped(y0, l0, s0[max(k - l0.delay, 0)], s0[max(k - l0.delay - 1, 0)])
            y1 = stepped(y1, l1, s1[max(k - l1.delay, 0)], s1[max(k - l1.delay - 1, 0)])
            y2 = stepped(y2, l2, s2[max(k - l2.delay, 0)], s2[max(k - l2.delay - 1, 0)])
            k += 1
        out[0, block], out[1, block], out[2, block] = t0 / factor, t1 / factor, t2 / factor
    return out


@njit(cache=True, error_model="numpy")
def held(lag_s: float, h: float) -> tuple[float, float]:
    """Remaining share of a first-order lag's distance from its target after h seconds, and its mean meanwhile."""
    if lag_s <= 0.0 or h <= 0.0:
        return 0.0, 0.0
    pole = math.exp(-h / lag_s)
    return pole, (1.0 - pole) * lag_s / h


@njit(cache=True)
def _followed(x: Floats, remaining: float, mean: float) -> Floats:
    out, at = np.empty_like(x), x[0]
    for k in range(x.size):
        out[k] = x[k] + (at - x[k]) * mean
        at = x[k] + (at - x[k]) * remaining
    return out


@njit(cache=True)
def lagged(x: Floats, lag_s: float, dt_s: float) -> Floats:
    """Mean over each sample, shape (n,), of a first-order lag of a held signal, initially at rest."""
    return _followed(x, *held(lag_s, dt_s))  # type: ignore[no-any-return]


def first_order(x: Floats, samples: float) -> Floats:
    """A signal, shape (n,), behind a first-order filter, time constant in samples (0: none), initially at rest."""
    remaining = math.exp(-1.0 / samples) if samples > 0 else 0.0
    return x if samples <= 0 else _followed(x, remaining, remaining)  # type: ignore[no-any-return]
