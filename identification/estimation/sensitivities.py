"""Innovations of a lag behind a stem, and how they change with each of its constants.

Constants stand in one vector theta: log T, dead time [s], width [% OP], gain, coefficients of 1, t, decay and the
load's step, and the noise model of single lags. Stems have `factor` samples a block of `dt` [s], and the response is
averaged over the blocks, as PV was.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.estimation.noise import every_lag, whitened
from identification.record import Floats, Mask
from identification.simulation.discretization import respond_in_blocks, respond_together, unit_lag

BASE = 8
"""Constants before the noise model."""
STEP_T = 1.01
"""Factor of the time constant over which its derivative is taken."""
STEP_DEAD = 0.05
"""Share of a block over which the dead time's derivative is taken."""


@njit(cache=True)
def _dead(theta: Floats, dt: float, factor: int) -> float:
    """The dead time from the stem's own samples on [s]: a block's mean stands later than its first sample."""
    return theta[1] + 0.5 * (factor - 1) * dt / factor  # type: ignore[no-any-return]


@njit(cache=True)
def _decays(theta: Floats, n: int, dt: float) -> tuple[float, float]:
    """What a decay starts from and its factor a block; none where the time constant outlasts half the window."""
    t_s = math.exp(theta[0])
    return 0.0 if t_s > 0.5 * n * dt else 1.0, math.exp(-dt / t_s)


@njit(cache=True)
def innovations(
    y: Floats, stem: Floats, extra: Floats, theta: Floats, dt: float, factor: int
) -> tuple[Floats, Floats, Floats]:
    """Unit response, residual of the model and its innovations, shape (n,) each."""
    n = y.size
    pole, now, before, delay = unit_lag(math.exp(theta[0]), _dead(theta, dt, factor), dt / factor)
    x = respond_in_blocks(stem, pole, now, before, delay, factor)
    r = np.empty(n)
    free, faded = _decays(theta, n, dt)
    for k in range(n):
        t = 2.0 * k / n - 1.0
        r[k] = y[k] - theta[3] * x[k] - theta[4] - theta[5] * t - theta[6] * free - theta[7] * extra[k]
        free *= faded
    return x, r, whitened(r, theta[BASE:], every_lag(theta.size - BASE))


@njit(cache=True)
def _responses(
    x: Floats, stem: Floats, wider: Floats, width_step: float, theta: Floats, dt: float, factor: int
) -> Floats:
    """Derivatives of the unit response by log T, dead time and width, shape (3, n)."""
    t_s, dead, step = math.exp(theta[0]), _dead(theta, dt, factor), STEP_DEAD * dt
    lags, delays = np.empty((3, 3)), np.empty(3, np.int64)
    trials = ((t_s * STEP_T, dead), (t_s, dead + step), (t_s, dead))
    for i in range(3):
        lags[i, 0], lags[i, 1], lags[i, 2], delays[i] = unit_lag(trials[i][0], trials[i][1], dt / factor)
    out = respond_together((stem, stem, wider), lags, delays, factor)
    out[0] = (out[0] - x) / math.log(STEP_T)
    out[1] = (out[1] - x) / step
    out[2] = (out[2] - x) / width_step if width_step > 0 else np.zeros(x.size)
    return out


@njit(cache=True)
def sensitivities(
    x: Floats,
    r: Floats,
    stems: tuple[Floats, Floats],
    width_step: float,
    extra: Floats,
    theta: Floats,
    dt: float,
    factor: int,
) -> Floats:
    """Derivatives of the innovations, shape (m, n), by theta.

    `x` and `r` are those of `innovations`; `stems` the stem and one whose valve is wider by `width_step`, 0 where the
    width is held.
    """
    n, order = x.size, theta.size - BASE
    gain = theta[3]
    rows = np.zeros((BASE + order, n))
    rows[:3] = -gain * _responses(x, stems[0], stems[1], width_step, theta, dt, factor)
    rows[3], rows[4], rows[7] = -x, -1.0, -extra
    free, faded = _decays(theta, n, dt)
    for k in range(n):
        rows[5, k] = -(2.0 * k / n - 1.0)
        rows[6, k] = -free
        free *= faded
    edges = every_lag(order)
    for j in range(BASE):
        rows[j] = whitened(rows[j], theta[BASE:], edges)
    for i in range(order):
        rows[BASE + i, i + 1 :] = -r[: n - 1 - i]
    return rows


@njit(cache=True)
def damped_step(gram: Floats, slope: Floats, damping: float, held: Mask) -> Floats:
    """A damped Gauss-Newton step, shape (m,); parameters that are `held` (bool, shape (m,)) stay."""
    size = slope.size
    scale = np.diag(gram) + 1e-12 * np.trace(gram) + 1e-300
    level, towards = np.empty((size, size)), np.empty(size)
    for i in range(size):
        towards[i] = 0.0 if held[i] else slope[i] / math.sqrt(scale[i])
        for j in range(size):
            damped = gram[i, j] + (damping * scale[i] if i == j else 0.0)
            if held[i] or held[j]:
                damped = 1.0 if i == j else 0.0
            level[i, j] = damped / math.sqrt(scale[i] * scale[j]) + (1e-12 if i == j else 0.0)
    return np.linalg.solve(level, towards) / np.sqrt(scale)  # type: ignore[no-any-return]
