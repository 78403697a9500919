"""All constants of a lag behind a valve at once to the least innovations variance."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.estimation.covariance import inverse, scattered
from identification.estimation.hammerstein import Fit, ValveTrial, stem_behind
from identification.estimation.noise import judged
from identification.estimation.sensitivities import BASE, Indices, damped_step, innovations, sensitivities
from identification.estimation.window import Stems, Window
from identification.record import Floats, Mask

ITERATIONS = 25
"""Gauss-Newton steps at most; ours: nine in ten fits stop before the fifteenth."""
SETTLED = 0.01
"""Gain in log likelihood [nat] below which the steps stop."""
NARROWEST = 0.2
"""Stickband after a step, in terms of that before, that is tried no more."""

Valve = tuple[float, float, float]
"""Breakaway, sliding distance and tolerance [% OP]."""


class _Bench(NamedTuple):
    """What all points of a descent share: PV less its mean, the stems known beforehand, the load's step, the samples
    judged, what is held, whether the stickband is free, the interval, samples of a stem in a block, and the ranges of
    log time constant and dead time."""

    y: Floats
    stems: Stems
    extra: Floats
    at: Indices
    held: Mask
    free_width: bool
    dt_s: float
    factor: int
    ranges: tuple[float, float, float, float]


def _bench(window: Window, order: int, free_width: bool) -> _Bench:
    held = np.zeros(BASE + order, dtype=bool)
    held[2], held[7] = not free_width, window.step_at <= 0
    most_t, most_dead = window.bounds
    least_dead = -window.half_block_s if window.fine else 0.0
    return _Bench(
        window.centred,
        window.stems,
        window.extra,
        np.flatnonzero(judged(window.usable, order)),
        held,
        free_width,
        window.dt_s,
        window.factor if window.fine else 1,
        (math.log(0.05 * window.dt_s), math.log(most_t), least_dead, most_dead),
    )


class _Point(NamedTuple):
    """One point of a descent: constants, valve, stem, unit response, residual, innovations judged, their mean
    square."""

    theta: Floats
    valve: Valve
    stem: Floats
    x: Floats
    r: Floats
    e: Floats
    loss: float


@njit(cache=True)
def _point(b: _Bench, theta: Floats, valve: Valve) -> _Point:
    stem = stem_behind(b.stems, *valve)
    x, r, white = innovations(b.y, stem, b.extra, theta, b.dt_s, b.factor)
    e = white[b.at]
    return _Point(theta, valve, stem, x, r, e, float(np.dot(e, e)) / e.size)


@njit(cache=True)
def _widened(valve: Valve, step: float) -> Valve:
    """The valve with a stickband wider by a step, its jump share kept."""
    stickband = valve[0] + valve[1]
    share = (valve[0] - valve[1]) / stickband if stickband > 0 else 0.0
    wider = stickband + step
    return 0.5 * wider * (1 + share), 0.5 * wider * (1 - share), valve[2]


@njit(cache=True)
def _slopes(b: _Bench, p: _Point) -> Floats:
    """Derivatives of the innovations judged, shape (8 + order, m)."""
    wider, width_step = p.stem, 0.0
    if b.free_width:
        width_step = 0.01 * (p.valve[0] + p.valve[1])
        wider = stem_behind(b.stems, *_widened(p.valve, width_step))
    stems = (p.stem, wider)
    return sensitivities(p.x, p.r, stems, width_step, b.extra, p.theta, b.dt_s, b.factor, b.at)  # type: ignore[no-any-return]


@njit(cache=True)
def _moved(b: _Bench, p: _Point, step: Floats) -> tuple[bool, Floats, Valve]:
    """Whether a step stays within what is searched, and the constants and the valve after it."""
    theta, valve, width = p.theta + step, p.valve, p.valve[0] + p.valve[1]
    theta[0] = min(max(theta[0], b.ranges[0]), b.ranges[1])
    theta[1] = min(max(theta[1], b.ranges[2]), b.ranges[3])
    if not b.free_width:
        return True, theta, valve
    theta[2] = width + step[2]
    return theta[2] > NARROWEST * width, theta, _widened(valve, step[2])


@njit(cache=True)
def _descend(b: _Bench, theta: Floats, valve: Valve) -> _Point:
    """Damped Gauss-Newton steps to the least mean square of the innovations judged."""
    best, damping, fresh = _point(b, theta, valve), 1e-3, True
    gram, slope = np.empty((theta.size, theta.size)), np.empty(theta.size)
    for _ in range(ITERATIONS):
        if fresh:
            rows = _slopes(b, best)
            gram, slope, fresh = np.dot(rows, rows.T), -np.dot(rows, best.e), False
        inside, moved, other = _moved(b, best, damped_step(gram, slope, damping, b.held))
        trial = _point(b, moved, other) if inside else best
        if not trial.loss < best.loss:
            damping *= 10
            if damping > 1e4:
                break
            continue
        gained = 0.5 * best.e.size * math.log(best.loss / max(trial.loss, 1e-300))
        best, damping, fresh = trial, max(damping / 5, 1e-7), True
        if gained < SETTLED:
            break
    return best


def _theta(fit: Fit) -> Floats:
    head = [math.log(fit.time_constant_s), fit.dead_time_s, fit.valve.stickband, fit.gain]
    return np.concatenate((head, fit.base, fit.ar))


def _constants(valve: ValveTrial) -> Valve:
    return float(valve.breakaway), float(valve.sliding), float(valve.tolerance)


def covariance(window: Window, fit: Fit, free_width: bool = False) -> Floats:
    """Covariance of (log T, L, stickband, gain) at a fit, shape (4, 4); zero for what was held.

    The noise model's and the slow terms' share is in it (covariance.py).
    """
    b = _bench(window, fit.ar.size, free_width)
    found = _point(b, _theta(fit), _constants(fit.valve))
    slopes = _slopes(b, found)
    gram = slopes @ slopes.T
    free = np.array([j for j in range(gram.shape[0]) if not b.held[j] and gram[j, j] > 0])
    inside = inverse(gram[np.ix_(free, free)])
    out = np.zeros_like(gram)
    out[np.ix_(free, free)] = scattered(inside, (slopes[free] * found.e).T, found.loss)
    return out[:4, :4]


def descend(window: Window, fit: Fit, free_width: bool = False) -> Fit:
    """All constants of a model together to the least innovations variance, by damped Gauss-Newton steps.

    Time constant, dead time, gain, slow terms and the noise model, and with `free_width` the stickband, move at
    once, because they trade against each other along narrow valleys.
    """
    best = _descend(_bench(window, fit.ar.size, free_width), _theta(fit), _constants(fit.valve))
    theta = best.theta
    return Fit(
        float(theta[3]),
        float(math.exp(theta[0])),
        float(theta[1]),
        ValveTrial(*best.valve),
        max(best.loss, 1e-14),
        int(best.e.size),
        theta[BASE:].copy(),
        theta[4:BASE].copy(),
    )
