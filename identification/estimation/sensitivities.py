"""Innovations of a lag behind a stem, and how they change with each of its constants.

Constants stand in one vector theta: log T, dead time [s], width [% OP], gain, coefficients of 1, t, decay and the
load's step, and the noise model of single lags. Stems have `factor` samples a block of `dt` [s], and the response is
averaged over the blocks, as PV was.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identification.estimation.noise import every_lag, whitened
from identification.record import Floats, Mask
from identification.simulation.lag import respond, respond_together, unit_lag

Indices = NDArray[np.int64]
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
    x = respond(stem, unit_lag(math.exp(theta[0]), _dead(theta, dt, factor), dt / factor), factor)
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
    fine = dt / factor
    lags = unit_lag(t_s * STEP_T, dead, fine), unit_lag(t_s, dead + step, fine), unit_lag(t_s, dead, fine)
    out = respond_together((stem, stem, wider), lags, factor)
    out[0] = (out[0] - x) / math.log(STEP_T)
    out[1] = (out[1] - x) / step
    out[2] = (out[2] - x) / width_step if width_step > 0 else np.zeros(x.size)
    return out


@njit(cache=True)
def _of_slow_terms(theta: Floats, n: int, dt: float, at: Indices, out: Floats) -> None:
    """Derivatives by the coefficients of 1, t and decay into `out`, shape (3, m): their innovations have closed forms
    from the order of the noise model on."""
    ar, order = theta[BASE:], theta.size - BASE
    level, back = 1.0, 0.0
    for i in range(order):
        level -= ar[i]
        back += ar[i] * (i + 1)
    free, faded = _decays(theta, n, dt)
    decay = faded**order
    for i in range(order):
        decay -= ar[i] * faded ** (order - 1 - i)
    decay, seen = free * decay, order
    for i in range(at.size):
        while seen < at[i]:
            decay, seen = decay * faded, seen + 1
        out[0, i] = -level
        out[1, i] = -((2.0 * at[i] / n - 1.0) * level + 2.0 / n * back)
        out[2, i] = -decay


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
    at: Indices,
) -> Floats:
    """Derivatives of the innovations judged, shape (8 + order, m), by theta.

    `x` and `r` are those of `innovations`; `stems` the stem and one whose valve is wider by `width_step`, 0 where the
    width is held; `at` are the samples judged, none of them before the order of the noise model.
    """
    n, order = x.size, theta.size - BASE
    out, edges = np.zeros((BASE + order, at.size)), every_lag(order)
    responses = -theta[3] * _responses(x, stems[0], stems[1], width_step, theta, dt, factor)
    for j in range(5):
        if (j == 2 and width_step == 0.0) or (j == 4 and extra[-1] == 0.0):
            continue
        row = responses[j] if j < 3 else -x if j == 3 else -extra
        white, to = whitened(row, theta[BASE:], edges), j if j < 4 else 7
        for k in range(at.size):
            out[to, k] = white[at[k]]
    _of_slow_terms(theta, n, dt, at, out[4:7])
    for i in range(order):
        for k in range(at.size):
            out[BASE + i, k] = -r[at[k] - 1 - i]
    return out


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
