"""Response of a valve stem to the controller output: backlash, friction, slew, positioner, trim."""

import math

import numpy as np
from numba import njit


@njit(cache=True)
def push_through_gap(z: float, u: float, gap: float) -> float:
    """Stem position [%] after a stiff contact pushed it; it is at rest while the driver crosses the gap [%]."""
    lead = u - z
    if lead > 0.5 * gap:
        return z + 0.9 * (lead - 0.5 * gap)
    if lead < -0.5 * gap:
        return z + 0.9 * (lead + 0.5 * gap)
    return z


@njit(cache=True)
def stick_slip(
    z: float, v: float, u: float, static: float, sliding: float, tau: float, dt: float
) -> tuple[float, float]:
    """One step of a spring-loaded stem with mass and dry friction (Karnopp 1985).

    Parameters
    ----------
    z, v : float
        Stem position [%] and speed [%/s].
    u : float
        Position the actuator pulls to [%].
    static, sliding : float
        Friction at rest and in motion, in % of spring travel.
    tau : float
        Natural time of mass and spring [s]; critically damped.
    dt : float
        Step [s].

    Returns
    -------
    z, v : float
        Position and speed one step later.
    """
    pull = u - z
    if v == 0.0 and abs(pull) <= static:
        return z, 0.0
    way = math.copysign(1.0, v if v != 0.0 else pull)
    speed = (v + dt * (pull - sliding * way) / tau**2) / (1.0 + 2.0 * dt / tau)
    if speed * way < 0.005 * static / tau:
        return z, 0.0
    return z + dt * speed, speed


@njit(cache=True)
def slew(z: float, u: float, rate: float, dt: float) -> float:
    """Position [%] after one step towards `u` [%] at no more than `rate` [%/s]."""
    step = rate * dt
    return z + min(max(u - z, -step), step)


@njit(cache=True)
def positioner(
    z: float, v: float, u: float, omega: float, damping: float, dead: float, dt: float
) -> tuple[float, float]:
    """One step of an underdamped position loop [rad/s] that rests within `dead` [%] of its aim."""
    e = u - z
    e -= min(max(e, -dead), dead)
    v += dt * (omega * omega * e - 2.0 * damping * omega * v)
    return z + dt * v, v


@njit(cache=True)
def trim(z: float, middle: float, bend: float) -> float:
    """Flow [%] of a trim whose local gain is exp(bend (z - middle)/100); 1 at the middle."""
    if bend == 0.0:
        return z
    return middle + (math.exp(bend * (z - middle) / 100.0) - 1.0) * 100.0 / bend


@njit(cache=True)
def second_valve(z: float, at: float, dead: float, ratio: float) -> float:
    """Flow [%] that a second valve adds to (or subtracts from) the first above the split point `at` [%]."""
    above = max(z - at, 0.0)
    return ratio * max(above - dead, 0.0) - above


def gap_path(u: np.ndarray, gap: float, steps: int = 10) -> np.ndarray:
    """Stem positions, shape (n,), for demanded positions `u`, shape (n,), each held for `steps` steps."""
    z, out = float(u[0]), np.empty(len(u))
    for k, demand in enumerate(u):
        for _ in range(steps):
            z = push_through_gap(z, float(demand), gap)
        out[k] = z
    return out
