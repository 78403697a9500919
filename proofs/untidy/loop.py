"""One control loop with its valve, scan by scan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from proofs.untidy.valve import step_backlash, step_lugre


@dataclass(frozen=True)
class Plant:
    """A process and its controller; times in scans, percent of spans.

    gain [% PV/% OP] (per time constant for an integrator), two time constants, dead time; kp, ti; pv_lag, the
    transmitter's filter.
    """

    gain: float
    first: float
    second: float
    dead: float
    integrating: bool
    kp: float
    ti: float
    pv_lag: float


@dataclass(frozen=True)
class Stem:
    """A valve: Coulomb and static friction [% OP], their scatter from slip to slip [log], and the place of higher
    friction.

    place: of the stem where friction is higher, and its width [% stem]; viscous time [scans]; actuator's lag [scans];
        positioner's integral gain where it oscillates [1/scan]; backlash [% OP].
    """

    coulomb: float = 0.0
    static: float = 0.0
    scatter: float = 0.0
    place: float = -1e6
    width: float = 1.0
    viscous: float = 0.2
    lag: float = 0.5
    hunting: float = 0.0
    backlash: float = 0.0


@njit(cache=True)
def _run(
    process: np.ndarray,
    control: np.ndarray,
    friction: np.ndarray,
    valve: np.ndarray,
    sp: np.ndarray,
    load: np.ndarray,
    noise: np.ndarray,
    draws: np.ndarray,
) -> np.ndarray:
    """PV, OP and stem, shape (3, n)."""
    n = sp.size
    out = np.empty((3, n))
    gain, pole1, pole2, delay, integrates = process[0], process[1], process[2], int(process[3]), process[4]
    kp, ki, smooth = control[0], control[1], control[2]
    held = np.zeros(delay + 1)
    op, stem, x1, x2, seen, before = 50.0, 50.0, 0.0, 0.0, sp[0], 0.0
    state = np.array([50.0, 50.0, 0.0, 1.0, 0.0])
    for k in range(n):
        held[k % (delay + 1)] = stem - 50.0 + load[k]
        u = held[(k + 1) % (delay + 1)]
        x1 = pole1 * x1 + (1 - pole1) * u if integrates == 0.0 else x1 + (1 - pole1) * u
        x2 = pole2 * x2 + (1 - pole2) * x1
        seen += smooth * (sp[0] + gain * x2 + noise[k] - seen)
        e = sp[k] - seen
        op = min(max(op + kp * (e - before) + ki * e, 0.0), 100.0)
        before = e
        out[0, k], out[1, k], out[2, k] = seen, op, stem
        if friction[0] > 0.0:
            stem = step_lugre(state, op, friction, valve[0], valve[1], valve[2], draws[k])
        else:
            state[0] += (op - state[0]) / max(valve[1], 1.0)
            stem = step_backlash(stem, state[0], valve[3])
    return out


def run(
    plant: Plant, stem: Stem, sp: np.ndarray, load: np.ndarray, noise: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """PV, OP and stem [% of spans], shape (3, n), of a loop under set point, load at the input and noise [%]."""
    poles = [0.0 if t <= 0 else float(np.exp(-1 / t)) for t in (plant.first, plant.second)]
    process = np.array([plant.gain, poles[0], poles[1], round(plant.dead), float(plant.integrating)])
    control = np.array([plant.kp, plant.kp / plant.ti, 1 / max(plant.pv_lag, 1.0)])
    stribeck = 0.01 * max(stem.static, 1e-3)
    friction = np.array([stem.coulomb, stem.static, stribeck, stem.viscous, stem.place, stem.width])
    valve = np.array([stem.scatter, stem.lag, stem.hunting, stem.backlash])
    return _run(process, control, friction, valve, sp, load, noise, rng.standard_normal(sp.size))


def critical_gain(plant: Plant) -> float:
    """Controller gain at the stability limit, with the integral time unchanged: kp over |L| at -180 degrees."""
    w = np.geomspace(1e-5, 3.0, 6000)
    s = 1j * w
    first = 1 / (plant.first * s) if plant.integrating else 1 / (1 + plant.first * s)
    smooth = max(plant.pv_lag, 1.0) - 1.0
    loop = plant.gain * first / (1 + plant.second * s) / (1 + smooth * s)
    held = 0.5 if plant.second <= 0 else 0.0
    loop = loop * np.exp(-(round(plant.dead) + held) * s) * (1 + 1 / (plant.ti * s))
    phase = np.unwrap(np.angle(loop))
    phase -= 2 * np.pi * np.round((phase[0] + np.pi / 2 * (2 if plant.integrating else 1)) / (2 * np.pi))
    late = np.flatnonzero((phase[1:] < -np.pi) & (phase[:-1] >= -np.pi))
    return float(1 / np.abs(loop[late[-1]])) if late.size else 0.0
