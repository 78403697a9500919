"""How a loop of the simulated mill moves: valve stem, process, controller, one second after the other.

Everything here is in seconds and percent of span. It shares no code with the estimators, so that what
they find can be held against it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Three = tuple[float, float, float]

SUBSTEPS = 5  # steps of stem and process in a second; the controller computes once a second
ACTUATOR_S = 0.6  # lag of the pneumatic actuator
SLIP_S = 0.3  # how fast a stem that slips reaches its new place


@njit(cache=True)
def drag(stem: float, actuator: float, width: float) -> float:
    """Stem with a backlash of full width `width`: it is constant until OP has taken up the backlash [% OP]."""
    return min(max(stem, actuator - 0.5 * width), actuator + 0.5 * width)


@njit(cache=True)
def slip(
    stem: float, way: float, force: float, static: float, kinetic: float, share: float
) -> tuple[float, float]:
    """One step of a stem with dry friction and negligible mass (Karnopp 1985, spring and friction alone).

    Parameters
    ----------
    stem, force : float
        Stem position and where the actuator would put it without friction [% OP].
    way : float
        Direction it slips in: 1, -1, or 0 while it sticks.
    static, kinetic : float
        Friction at rest and in motion, as the force error it holds [% OP].
    share : float
        Part of the remaining way that a slip covers in one step.

    Returns
    -------
    tuple of (float, float)
        New stem position and direction.
    """
    push = force - stem
    if way == 0.0 and abs(push) > static:
        way = 1.0 if push > 0.0 else -1.0
    if way != 0.0:
        rest = push - way * kinetic
        if rest * way <= 0.02:
            return stem, 0.0
        return stem + share * rest, way
    return stem, way


@njit(cache=True)
def shares(lag: float, delay: float, dt: float) -> tuple[int, float, float]:
    """Exact step of a lag behind a dead time that need not be whole steps; lag, delay, dt in seconds.

    Returns
    -------
    tuple of (int, float, float)
        Whole steps of dead time, and how much the inputs one step older and just that old count in a step.
    """
    steps = int(delay / dt)
    part = delay / dt - steps
    newer = 1.0 - math.exp(-(1.0 - part) * dt / lag)
    older = (1.0 - math.exp(-part * dt / lag)) * math.exp(-(1.0 - part) * dt / lag)
    return steps, older, newer


@njit(cache=True)
def moved(rest: float, way: float, force: float, valve: Three, share: float) -> tuple[float, float]:
    """One step of a stem that sticks, or of one with backlash: its position and direction."""
    if valve[1] > 0.0:
        return slip(rest, way, force, valve[1], valve[2], share)
    return drag(rest, force, valve[0]), way


@njit(cache=True)
def run(
    sp: Floats, load: Floats, noise: Floats, kp: Floats, ti: Floats, push: Floats, manual: Mask, op0: float,
    valve: Three, process: Three,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """One loop, closed by a PI in velocity form (backward Euler, 1 s scan).

    Parameters
    ----------
    sp, load, noise : ndarray of shape (n,)
        Set point [% PV], load at the process input [% OP], measurement noise [% PV], one a second.
    kp, ti : ndarray of shape (n,)
        Gain [% OP / % PV] and integral time [s] in force.
    push, manual : ndarray of shape (n,)
        What the operator adds to OP while in manual [% OP]; True where in manual.
    op0 : float
        OP that holds the first set point without load [% OP].
    valve : tuple of (float, float, float)
        Backlash, static and kinetic friction [% OP].
    process : tuple of (float, float, float)
        Gain [% PV / % OP], time constant [s], dead time [s].

    Returns
    -------
    PV [% of span], OP and stem position [% of OP span] : ndarray of shape (n,)
    """
    dt, n, gain = 1.0 / SUBSTEPS, sp.size, process[0]
    steps, older_share, newer_share = shares(process[1], process[2], dt)
    late = np.full(steps + 2, op0)
    follow, share = 1.0 - math.exp(-dt / ACTUATOR_S), 1.0 - math.exp(-dt / SLIP_S)
    pv, op, stem = np.empty(n), np.empty(n), np.empty(n)
    x, u, force, rest, way, before, at = 0.0, op0, op0, op0, 0.0, 0.0, 0
    for k in range(n):
        pv[k] = min(max(sp[0] + x + noise[k], 0.0), 100.0)
        e = sp[k] - pv[k]
        u += push[k] if manual[k] else kp[k] * (e - before + e / ti[k])
        before, u = e, min(max(u, 0.0), 100.0)
        for _ in range(SUBSTEPS):
            force += follow * (u - force)
            rest, way = moved(rest, way, force, valve, share)
            late[at] = rest
            at = (at + 1) % late.size
            inflow = older_share * late[at] + newer_share * late[(at + 1) % late.size]
            x += (older_share + newer_share) * (gain * (load[k] - op0) - x) + gain * inflow
        op[k], stem[k] = u, rest
    return pv, op, stem


@njit(cache=True)
def run_cascade(
    sp: Floats, load: Floats, noise: Floats, settings: Floats, op0: tuple[float, float], valve: Three,
    inner: Three, outer: Three,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """A master whose output is the set point of a slave, whose PV feeds the master's process; both PI, 1 s scan.

    Parameters
    ----------
    sp : ndarray of shape (n,)
        The master's set point [% PV].
    load, noise : ndarray of shape (2, n)
        Of master and slave: load at the process input [% of its input], measurement noise [% PV].
    settings : ndarray of shape (2, 2)
        Gain and integral time [s] of master and slave.
    op0 : tuple of (float, float)
        Outputs of master and slave that hold the first set point [%].
    valve : tuple of (float, float, float)
        The slave's: backlash, static and kinetic friction [% OP].
    inner, outer : tuple of (float, float, float)
        The slave's and the master's process: gain, time constant [s], dead time [s].

    Returns
    -------
    PV and OP, shape (2, n) each, and stem position, shape (n,), in percent.
    """
    dt, n = 1.0 / SUBSTEPS, sp.size
    steps2, old2, new2 = shares(inner[1], inner[2], dt)
    steps1, old1, new1 = shares(outer[1], outer[2], dt)
    late2, late1 = np.full(steps2 + 2, op0[1]), np.full(steps1 + 2, op0[0])
    follow, share = 1.0 - math.exp(-dt / ACTUATOR_S), 1.0 - math.exp(-dt / SLIP_S)
    pv, op, stem = np.empty((2, n)), np.empty((2, n)), np.empty(n)
    x1, x2, e1, e2, way, at2, at1 = 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0
    u1, (u2, force, rest) = op0[0], (op0[1], op0[1], op0[1])
    for k in range(n):
        pv[0, k] = min(max(sp[0] + x1 + noise[0, k], 0.0), 100.0)
        pv[1, k] = min(max(op0[0] + x2 + noise[1, k], 0.0), 100.0)
        e = sp[k] - pv[0, k]
        u1, e1 = min(max(u1 + settings[0, 0] * (e - e1 + e / settings[0, 1]), 0.0), 100.0), e
        e = u1 - pv[1, k]
        u2, e2 = min(max(u2 + settings[1, 0] * (e - e2 + e / settings[1, 1]), 0.0), 100.0), e
        for _ in range(SUBSTEPS):
            force += follow * (u2 - force)
            rest, way = moved(rest, way, force, valve, share)
            late2[at2] = rest
            at2 = (at2 + 1) % late2.size
            inflow = old2 * late2[at2] + new2 * late2[(at2 + 1) % late2.size]
            x2 += (old2 + new2) * (inner[0] * (load[1, k] - op0[1]) - x2) + inner[0] * inflow
            late1[at1] = op0[0] + x2
            at1 = (at1 + 1) % late1.size
            inflow = old1 * late1[at1] + new1 * late1[(at1 + 1) % late1.size]
            x1 += (old1 + new1) * (outer[0] * (load[0, k] - op0[0]) - x1) + outer[0] * inflow
        op[0, k], op[1, k], stem[k] = u1, u2, rest
    return pv, op, stem


def wander(rng: np.random.Generator, n: int, std: float, corner_s: float) -> Floats:
    """Ornstein-Uhlenbeck noise, standard deviation `std`, correlation time `corner_s` [s]; shape (n,)."""
    keep = math.exp(-1.0 / corner_s)
    white = rng.standard_normal(n + 1)
    start = white[0] * std
    return lfilter([std * math.sqrt(1.0 - keep**2)], [1.0, -keep], white[1:], zi=[keep * start])[0]


def swing(rng: np.random.Generator, n: int, amplitude: float, period_s: float) -> Floats:
    """A sine whose phase drifts slowly, as a neighbouring plant's cycle does; shape (n,)."""
    phase = 2.0 * np.pi * np.arange(n) / period_s + np.cumsum(rng.standard_normal(n)) * 0.002
    return amplitude * np.sin(phase)
