"""Valves with LuGre friction or backlash, integrated with small steps within a controller's scan."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

SUBSTEPS = 120
"""Steps of the valve within a scan."""
BRISTLES = 25.0
"""Stiffness of the bristles relative to the spring [-]: the stem creeps 1/25 of its stickband before it slips."""


@njit(cache=True)
def step_lugre(
    state: np.ndarray,
    op: float,
    friction: np.ndarray,
    scatter: float,
    lag: float,
    hunting: float,
    draw: float,
) -> float:
    """Stem after one scan [% OP] under LuGre friction with a spring, without mass.

    state : actuator force, stem, bristle deflection, factor of the friction now, direction of the last slip, shape
    (5,), changed; friction : Coulomb and static level, Stribeck velocity [%/scan], viscous share [scans], place
    and width where it is three times as large [% stem], shape (6,); scatter : of the friction from slip to slip
    [log]; lag : of the actuator [scans]; hunting : gain of an integrating positioner [1/scan], 0: none; draw : a
    standard normal.
    """
    dt = 1.0 / SUBSTEPS
    force, stem, bristle, factor, turned = state[0], state[1], state[2], state[3], state[4]
    coulomb, static, stribeck, viscous = friction[0], friction[1], friction[2], friction[3]
    for _ in range(SUBSTEPS):
        if hunting > 0.0:
            force += dt * hunting * (op - stem)
        else:
            force += dt / lag * (op - force)
        here = 1.0 + 2.0 * math.exp(-(((stem - friction[4]) / friction[5]) ** 2))
        drive = force - stem - BRISTLES * bristle
        v = drive / (viscous + 0.05)
        level = factor * here * (coulomb + (static - coulomb) * math.exp(-((v / stribeck) ** 2)))
        rate = v - BRISTLES * abs(v) / max(level, 1e-6) * bristle
        v = (drive - 0.05 * rate) / viscous
        limit = 50.0 * max(abs(drive), 1e-9)
        v = min(max(v, -limit), limit)
        bristle += dt * (v - BRISTLES * abs(v) / max(level, 1e-6) * bristle)
        bristle = min(max(bristle, -level / BRISTLES), level / BRISTLES)
        stem += dt * v
    moving = 1.0 if v > stribeck else -1.0 if v < -stribeck else 0.0
    if moving != 0.0 and moving != turned:
        turned = moving
        factor = math.exp(scatter * draw)
    state[0], state[1], state[2], state[3], state[4] = force, stem, bristle, factor, turned
    return stem


@njit(cache=True)
def step_backlash(stem: float, op: float, width: float) -> float:
    """Stem behind a backlash of that full width [% OP]."""
    return min(max(stem, op - 0.5 * width), op + 0.5 * width)
