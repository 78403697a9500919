"""From the flow to the measured value: pipe, vessel and transmitter, integrated by Runge-Kutta steps."""

import math
from typing import Any

import numpy as np
from numba import njit

STATES = 9  # vessel, slow part, two extra lags, opposing part, spill basin, mount (2), transmitter


@njit(cache=True)
def outflow(x: float, p: Any) -> float:
    """Outflow of the vessel at deviation `x` [%], in % of PV at rest."""
    if p.root > 0.0:
        head = p.y0 / p.root
        return 2.0 * head * (math.sqrt(max(1.0 + x / head, 0.0)) - 1.0)
    if p.slope != 0.0:
        return 50.0 / p.slope * math.log(max(1.0 + p.slope * x / 50.0, 0.1))
    return p.leak * x


@njit(cache=True)
def level_of(x: np.ndarray, p: Any) -> float:
    """True PV [%] of these states."""
    inner = 1.0 + p.oppose
    return p.y0 + (1.0 - p.slow) * (inner * x[0] - p.oppose * x[4]) + p.slow * x[1]


@njit(cache=True)
def rates(x: np.ndarray, dx: np.ndarray, feed: float, pre: float, p: Any) -> None:
    """Write d/dt of the states for a feed [% PV] and a disturbance `pre` [% PV] at the transmitter."""
    dx[2] = (feed - x[2]) / p.T2 if p.T2 > 0.0 else 0.0
    a = x[2] if p.T2 > 0.0 else feed
    dx[3] = (a - x[3]) / p.T3 if p.T3 > 0.0 else 0.0
    a = x[3] if p.T3 > 0.0 else a
    spill = p.weir * max(x[0] - p.cap, 0.0)
    net = a - outflow(x[0], p) - spill + p.spill * x[5]
    dx[0] = net / (p.T * math.exp(-0.5 * p.asym if net > 0.0 else 0.5 * p.asym))
    dx[1] = (a - x[1]) / p.slow_s
    dx[4] = (a - x[4]) / p.oppose_s
    dx[5] = (spill - x[5]) / p.spill_s
    y = level_of(x, p)
    dx[6] = x[7]
    dx[7] = p.mount_w**2 * (y - p.y0 - x[6]) - 2.0 * p.mount_z * p.mount_w * x[7]
    shaken = (1.0 - p.mount) * y + p.mount * (p.y0 + x[6]) + pre
    dx[8] = (shaken - p.y0 - x[8]) / p.lag if p.lag > 0.0 else 0.0


@njit(cache=True)
def advance(x: np.ndarray, work: np.ndarray, feed: float, pre: float, dt: float, p: Any) -> None:
    """Advance the states, shape (9,), by `dt` [s] by the classic fourth-order rule; work: shape (5, 9)."""
    rates(x, work[0], feed, pre, p)
    for i in range(x.size):
        work[4, i] = x[i] + 0.5 * dt * work[0, i]
    rates(work[4], work[1], feed, pre, p)
    for i in range(x.size):
        work[4, i] = x[i] + 0.5 * dt * work[1, i]
    rates(work[4], work[2], feed, pre, p)
    for i in range(x.size):
        work[4, i] = x[i] + dt * work[2, i]
    rates(work[4], work[3], feed, pre, p)
    for i in range(x.size):
        x[i] += dt / 6.0 * (work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i])


@njit(cache=True)
def reading(x: np.ndarray, pre: float, post: float, p: Any) -> float:
    """Output of the transmitter [%]: mount, filter, noise, span, converter steps, in that order."""
    y = level_of(x, p)
    value = (1.0 - p.mount) * y + p.mount * (p.y0 + x[6]) + pre
    if p.lag > 0.0:
        value = p.y0 + x[8]
    value = min(max(value + post, p.clip_lo), p.clip_hi)
    if p.grid > 0.0:
        value = p.grid * np.round(value / p.grid)
    return value


@njit(cache=True)
def leaves_pipe(
    flow: np.ndarray, passed: np.ndarray, now: int, back: int, volume: float
) -> tuple[float, int]:
    """Flow [%] at the end of a pipe in plug flow, and the index to go on from.

    Parameters
    ----------
    flow, passed : ndarray, shape (steps,)
        Flow that entered and the volume passed since the start [s at nominal flow], by step.
    now, back : int
        Present step and the step last found at the outlet.
    volume : float
        Pipe volume [s at nominal flow].
    """
    mark = passed[now] - volume
    if mark <= passed[0]:
        return flow[0], back
    while passed[back + 1] < mark:
        back += 1
    share = (mark - passed[back]) / (passed[back + 1] - passed[back])
    return flow[back] + share * (flow[back + 1] - flow[back]), back
