"""All constants of a lag behind a valve at once to the least innovations variance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identification.estimation.covariance import inverse, scattered
from identification.estimation.hammerstein import (
    Fit,
    ValveTrial,
    fine_stem,
    stem_of,
    sticking,
)
from identification.estimation.noise import every_lag, judged, whitened
from identification.estimation.window import Window
from identification.record import Floats
from identification.simulation.discretization import respond_in_blocks, unit_lag

ITERATIONS = 25
"""Gauss-Newton steps at most; ours: nine in ten fits stop before the fifteenth."""
SETTLED = 0.01
"""Gain in log likelihood [nat] below which the steps stop."""


@njit(cache=True)
def _responses(
    stem: Floats, wider: Floats, width_step: float, t_s: float, dead_s: float, dt: float, factor: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Response of a unit lag in blocks of `dt` [s], shape (n,), and its derivatives by log T, dead time and width."""
    fine = dt / factor
    dead = dead_s + 0.5 * (factor - 1) * fine
    pole, now, before, delay = unit_lag(t_s, dead, fine)
    x = respond_in_blocks(stem, pole, now, before, delay, factor)
    pole2, now2, before2, delay2 = unit_lag(t_s * 1.01, dead, fine)
    x_t = (respond_in_blocks(stem, pole2, now2, before2, delay2, factor) - x) / math.log(1.01)
    step = 0.05 * dt
    pole3, now3, before3, delay3 = unit_lag(t_s, dead + step, fine)
    x_l = (respond_in_blocks(stem, pole3, now3, before3, delay3, factor) - x) / step
    x_w = np.zeros(x.size)
    if width_step > 0:
        x_w = (respond_in_blocks(wider, pole, now, before, delay, factor) - x) / width_step
    return x, x_t, x_l, x_w


@njit(cache=True)
def _sensitivities(
    y: Floats,
    stem: Floats,
    wider: Floats,
    extra: Floats,
    width_step: float,
    theta: Floats,
    order: int,
    dt: float,
    factor: int,
) -> tuple[Floats, Floats]:
    """Innovations, shape (n,), and their derivatives, shape (n, 8 + order), at theta = log T, L, width, K, 1, t,
    decay, step, noise model; the derivative by the width is that of the given wider stem. Stems have `factor` samples
    a block of `dt` [s], and the response is averaged over the blocks, as PV was."""
    n = y.size
    t_s = math.exp(theta[0])
    x, x_t, x_l, x_w = _responses(stem, wider, width_step, t_s, theta[1], dt, factor)
    columns = np.zeros((n, 8 + order))
    r = np.empty(n)
    free, faded = 1.0, math.exp(-dt / t_s)
    outlasts = t_s > 0.5 * n * dt
    gain = theta[3]
    for k in range(n):
        t = 2.0 * k / n - 1.0
        d = 0.0 if outlasts else free
        r[k] = y[k] - gain * x[k] - theta[4] - theta[5] * t - theta[6] * d - theta[7] * extra[k]
        columns[k, 0] = -gain * x_t[k]
        columns[k, 1] = -gain * x_l[k]
        columns[k, 2] = -gain * x_w[k]
        columns[k, 3] = -x[k]
        columns[k, 4] = -1.0
        columns[k, 5] = -t
        columns[k, 6] = -d
        columns[k, 7] = -extra[k]
        free *= faded
    edges = every_lag(order)
    e = whitened(r, theta[8:], edges)
    for j in range(8):
        columns[:, j] = whitened(columns[:, j].copy(), theta[8:], edges)
    for k in range(order, n):
        for i in range(order):
            columns[k, 8 + i] = -r[k - 1 - i]
    return e, columns


def _steps(gram: Floats, slope: Floats, damping: float, frozen: list[int]) -> Floats:
    """A damped Gauss-Newton step; frozen parameters stay."""
    scale = np.diag(gram) + 1e-12 * np.trace(gram) + 1e-300
    damped = gram + damping * np.diag(scale)
    for j in frozen:
        damped[j, :], damped[:, j], damped[j, j] = 0.0, 0.0, 1.0
        slope = slope.copy()
        slope[j] = 0.0
    root = np.sqrt(scale)
    level = damped / np.outer(root, root)
    level[np.diag_indices_from(level)] += 1e-12
    return np.asarray(np.linalg.solve(level, slope / root) / root, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class _Trial:
    """One point of the Gauss-Newton descent."""

    theta: Floats
    valve: ValveTrial
    loss: float
    count: int
    gram: Floats
    slope: Floats


def _judged(
    window: Window, y: Floats, theta: Floats, valve: ValveTrial, free_width: bool
) -> tuple[Floats, Floats]:
    """Innovations and their derivatives at the samples judged."""
    order = theta.size - 8
    stems = fine_stem if window.fine else stem_of
    stem = stems(window, valve)
    step = 0.01 * valve.stickband if free_width else 0.0
    wider = stems(window, _widened(valve, step)) if free_width else stem
    factor = window.factor if window.fine else 1
    e, columns = _sensitivities(y, stem, wider, window.extra, step, theta, order, window.dt_s, factor)
    e, columns = e[order:], columns[order:]
    if not window.usable.all():
        counts = judged(window.usable, order)[order:]
        e, columns = e[counts], columns[counts]
    return e, columns


def _trial(window: Window, y: Floats, theta: Floats, valve: ValveTrial, free_width: bool) -> _Trial:
    e, columns = _judged(window, y, theta, valve, free_width)
    return _Trial(theta, valve, float(e @ e) / e.size, e.size, columns.T @ columns, -(columns.T @ e))


def _widened(valve: ValveTrial, step: float) -> ValveTrial:
    """The valve with a wider stickband, its jump share kept."""
    share = valve.slip_jump / valve.stickband if valve.stickband > 0 else 0.0
    return sticking(valve.stickband + step, share, valve.tolerance)


def _moved(window: Window, trial: _Trial, step: Floats, free_width: bool) -> tuple[Floats, ValveTrial] | None:
    """Parameters after a step, None where it leaves what is searched."""
    theta = trial.theta + step
    most_t, most_dead = window.bounds
    theta[0] = min(max(theta[0], math.log(0.05 * window.dt_s)), math.log(most_t))
    theta[1] = min(max(theta[1], -window.half_block_s if window.fine else 0.0), most_dead)
    if not free_width:
        return theta, trial.valve
    width = trial.valve.stickband + step[2]
    if width <= 0.2 * trial.valve.stickband:
        return None
    theta[2] = width
    return theta, _widened(trial.valve, step[2])


def _theta(fit: Fit) -> Floats:
    head = [math.log(fit.time_constant_s), fit.dead_time_s, fit.valve.stickband, fit.gain]
    return np.concatenate((head, fit.base, fit.ar))


def _held(window: Window, free_width: bool) -> list[int]:
    """Places in theta that do not move."""
    return ([] if free_width else [2]) + ([] if window.step_at > 0 else [7])


def covariance(window: Window, fit: Fit, free_width: bool = False) -> Floats:
    """Covariance of (log T, L, stickband, gain) at a fit, shape (4, 4); zero for what was held.

    The noise model's and the slow terms' share is in it (covariance.py).
    """
    y, theta, held = window.y - window.y.mean(), _theta(fit), _held(window, free_width)
    e, columns = _judged(window, y, theta, fit.valve, free_width)
    gram = columns.T @ columns
    free = np.array([j for j in range(gram.shape[0]) if j not in held and gram[j, j] > 0])
    inside = inverse(gram[np.ix_(free, free)])
    out = np.zeros_like(gram)
    out[np.ix_(free, free)] = scattered(inside, columns[:, free] * e[:, None], float(e @ e) / e.size)
    return out[:4, :4]


def descend(window: Window, fit: Fit, free_width: bool = False) -> Fit:
    """All constants of a model together to the least innovations variance, by damped Gauss-Newton steps.

    Time constant, dead time, gain, slow terms and the noise model, and with `free_width` the stickband, move at
    once, because they trade against each other along narrow valleys.
    """
    y = window.y - window.y.mean()
    best = _trial(window, y, _theta(fit), fit.valve, free_width)
    damping = 1e-3
    frozen = _held(window, free_width)
    for _ in range(ITERATIONS):
        moved = _moved(window, best, _steps(best.gram, best.slope, damping, frozen), free_width)
        trial = _trial(window, y, *moved, free_width) if moved is not None else None
        if trial is None or not trial.loss < best.loss:
            damping *= 10
            if damping > 1e4:
                break
            continue
        gained = 0.5 * best.count * math.log(best.loss / max(trial.loss, 1e-300))
        best, damping = trial, max(damping / 5, 1e-7)
        if gained < SETTLED:
            break
    return _fitted(best)


def _fitted(trial: _Trial) -> Fit:
    t = trial.theta
    return Fit(
        float(t[3]),
        float(math.exp(t[0])),
        float(t[1]),
        trial.valve,
        max(trial.loss, 1e-14),
        trial.count,
        t[8:].copy(),
        t[4:8].copy(),
    )
