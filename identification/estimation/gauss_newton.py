"""Joint descent in all constants of a lag behind a valve to the smallest innovations variance, for the batch run.

One vector theta holds the constants: log T, dead time [s], stickband [% OP], gain, coefficients of 1, t, decay and
the load's step, and the noise model of single lags. The residual is that of `explain`'s baseline model behind a valve
(prediction_error.py), with the noise model fitted jointly; tests check that both have the same optimum.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from identification.estimation.descent import Descent, down, inverse, scattered
from identification.estimation.model import Fitted
from identification.estimation.noise import every_lag, judged, whitened
from identification.estimation.problem import Stems, stem_of
from identification.record import Floats
from identification.simulation.lag import respond, respond_together, unit_lag
from identification.simulation.valve import StemLaw, sticking

ITERATIONS = 25  # Largest number of Gauss-Newton steps: nine in ten fits stop before the fifteenth
SETTLED = 0.01  # Gain in log likelihood below which the steps stop [nat]
NARROWEST = 0.2  # Stickband after a step, in terms of that before, that is tried no more

BASE = 8
"""Number of constants before the noise model."""
STEP_T = 1.01
"""Factor of the time constant for its numeric derivative."""
STEP_DEAD = 0.05
"""Share of a block for the numeric derivative of the dead time."""


class _Bench(NamedTuple):
    """Data shared by all points of a descent: PV less its mean, stems known beforehand, the load's step, the samples
    judged, whether the stickband is free, the interval of blocks, stem samples per block, and the ranges of log time
    constant and dead time."""

    y: Floats
    stems: Stems
    extra: Floats
    at: NDArray[np.int64]
    free_width: bool
    dt_s: float
    factor: int
    ranges: tuple[float, float, float, float]


class _Point(NamedTuple):
    """One point of a descent: constants, valve, stem, unit response, residual, innovations judged, their mean
    square."""

    theta: Floats
    valve: StemLaw
    stem: Floats
    x: Floats
    r: Floats
    e: Floats
    loss: float


@njit(cache=True)
def _dead(b: _Bench, theta: Floats) -> float:
    """Dead time counted from the stem's own samples [s]: the mean of a block is later than its first sample."""
    return theta[1] + 0.5 * (b.factor - 1) * b.dt_s / b.factor  # type: ignore[no-any-return]


@njit(cache=True)
def _decays(b: _Bench, theta: Floats) -> tuple[float, float]:
    """Start value of a decay and its factor per block; no decay if the time constant exceeds half the stretch."""
    t_s = math.exp(theta[0])
    return 0.0 if t_s > 0.5 * b.y.size * b.dt_s else 1.0, math.exp(-b.dt_s / t_s)


@njit(cache=True)
def _point(b: _Bench, theta: Floats, valve: StemLaw) -> _Point:
    n, stem = b.y.size, stem_of(b.stems, valve)
    x = respond(stem, unit_lag(math.exp(theta[0]), _dead(b, theta), b.dt_s / b.factor), b.factor)
    r = np.empty(n)
    free, faded = _decays(b, theta)
    for k in range(n):
        t = 2.0 * k / n - 1.0
        r[k] = b.y[k] - theta[3] * x[k] - theta[4] - theta[5] * t - theta[6] * free - theta[7] * b.extra[k]
        free *= faded
    e = whitened(r, theta[BASE:], every_lag(theta.size - BASE))[b.at]
    return _Point(theta, valve, stem, x, r, e, float(np.dot(e, e)) / e.size)


@njit(cache=True)
def _widened(valve: StemLaw, step: float) -> StemLaw:
    """The valve with its stickband widened by a step and its jump share unchanged."""
    stickband = valve.breakaway + valve.sliding
    share = (valve.breakaway - valve.sliding) / stickband if stickband > 0 else 0.0
    return sticking(stickband + step, share, valve.tolerance)  # type: ignore[no-any-return]


@njit(cache=True)
def _responses(b: _Bench, p: _Point) -> Floats:
    """Derivatives of the unit response by log T, dead time and stickband, shape (3, n)."""
    fine, t_s, dead, step = b.dt_s / b.factor, math.exp(p.theta[0]), _dead(b, p.theta), STEP_DEAD * b.dt_s
    wider, width_step = p.stem, 0.0
    if b.free_width:
        width_step = 0.01 * (p.valve.breakaway + p.valve.sliding)
        wider = stem_of(b.stems, _widened(p.valve, width_step))
    lags = unit_lag(t_s * STEP_T, dead, fine), unit_lag(t_s, dead + step, fine), unit_lag(t_s, dead, fine)
    out = respond_together((p.stem, p.stem, wider), lags, b.factor)
    out[0] = (out[0] - p.x) / math.log(STEP_T)
    out[1] = (out[1] - p.x) / step
    out[2] = (out[2] - p.x) / width_step if width_step > 0 else np.zeros(p.x.size)
    return out


@njit(cache=True)
def _of_slow_terms(b: _Bench, theta: Floats, out: Floats) -> None:
    """Write derivatives by the coefficients of 1, t and decay into `out`, shape (3, m). Their innovations have closed
    forms beyond the order of the noise model."""
    n, ar, order = b.y.size, theta[BASE:], theta.size - BASE
    level, back = 1.0, 0.0
    for i in range(order):
        level -= ar[i]
        back += ar[i] * (i + 1)
    free, faded = _decays(b, theta)
    decay = faded**order
    for i in range(order):
        decay -= ar[i] * faded ** (order - 1 - i)
    decay, seen = free * decay, order
    for i in range(b.at.size):
        while seen < b.at[i]:
            decay, seen = decay * faded, seen + 1
        out[0, i] = -level
        out[1, i] = -((2.0 * b.at[i] / n - 1.0) * level + 2.0 / n * back)
        out[2, i] = -decay


@njit(cache=True)
def _slopes(b: _Bench, p: _Point) -> Floats:
    """Derivatives of the innovations judged by theta, shape (8 + order, m); zero for fixed constants."""
    order = p.theta.size - BASE
    out, edges = np.zeros((BASE + order, b.at.size)), every_lag(order)
    responses = -p.theta[3] * _responses(b, p)
    for j in range(5):
        if (j == 2 and not b.free_width) or (j == 4 and b.extra[-1] == 0.0):
            continue
        row = responses[j] if j < 3 else -p.x if j == 3 else -b.extra
        white, to = whitened(row, p.theta[BASE:], edges), j if j < 4 else 7
        for k in range(b.at.size):
            out[to, k] = white[b.at[k]]
    _of_slow_terms(b, p.theta, out[4:7])
    for i in range(order):
        for k in range(b.at.size):
            out[BASE + i, k] = -p.r[b.at[k] - 1 - i]
    return out


@register_jitable  # type: ignore[untyped-decorator]
def _curved(b: _Bench, p: _Point, taken: int) -> tuple[bool, Floats, Floats]:
    """Gauss-Newton matrix and gradient at a point; the flag to continue is always True."""
    rows = _slopes(b, p)
    return True, np.dot(rows, rows.T), -np.dot(rows, p.e)


@register_jitable  # type: ignore[untyped-decorator]
def _stepped(b: _Bench, p: _Point, step: Floats) -> _Point:
    """The point after a step; the unchanged point if the step leaves the bounds."""
    theta, valve = p.theta + step, p.valve
    theta[0] = min(max(theta[0], b.ranges[0]), b.ranges[1])
    theta[1] = min(max(theta[1], b.ranges[2]), b.ranges[3])
    if b.free_width:
        width = p.valve.breakaway + p.valve.sliding
        theta[2], valve = width + step[2], _widened(p.valve, step[2])
        if theta[2] <= NARROWEST * width:
            return p
    return _point(b, theta, valve)  # type: ignore[no-any-return]


@njit(cache=True)
def _descend(b: _Bench, theta: Floats, valve: StemLaw, rule: Descent) -> _Point:
    """Damped Gauss-Newton steps to the smallest mean square of the innovations judged."""
    return down(b, _point(b, theta, valve), _curved, _stepped, rule)  # type: ignore[no-any-return]


def _at(fit: Fitted, free_width: bool = False) -> tuple[_Bench, Floats, StemLaw]:
    """State of a fit in the kernels' types: the data that its descent shares, its constants and its valve."""
    problem, (most_t, most_dead), valve = fit.p, fit.p.bounds, fit.valve
    factor, least_dead = (problem.blocks.factor, -problem.half_block_s) if problem.blocks.fine else (1, 0.0)
    ranges = math.log(0.05 * problem.dt_s), math.log(most_t), least_dead, most_dead
    at = np.flatnonzero(judged(problem.usable, fit.ar.size))
    y, extra = problem.centred, problem.extra
    bench = _Bench(y, problem.stems, extra, at, free_width, problem.dt_s, factor, ranges)
    head = [math.log(fit.time_constant_s), fit.dead_time_s, valve.stickband, fit.gain]
    return bench, np.concatenate((head, fit.slow, fit.ar)), StemLaw(*(float(x) for x in valve))


def innovations(fit: Fitted) -> Floats:
    """Innovations of a fit at the samples judged [% PV]."""
    return _point(*_at(fit)).e


def disturbance(fit: Fitted) -> Floats:
    """PV less the whole model, slow terms included [% PV], shape (n,)."""
    return _point(*_at(fit)).r


def residual(fit: Fitted) -> Floats:
    """PV less the response to the stem [% PV], shape (n,): load and noise, including the model's slow terms.

    In a fine problem the response is computed at the record's own interval and then averaged over blocks, as PV was.
    """
    return np.asarray(fit.p.centred - fit.gain * _point(*_at(fit)).x)


def slow_terms(fit: Fitted) -> Floats:
    """Mean, trend, decay and step of PV in a fit [% PV], shape (n,)."""
    point = _point(*_at(fit))
    return np.asarray(fit.p.centred - fit.gain * point.x - point.r)


def covariance(fit: Fitted, free_width: bool = False) -> Floats:
    """Covariance of (log T, L, stickband, gain) at a fit, shape (4, 4); zero for fixed constants.

    It includes the uncertainty from the noise model and the slow terms (descent.py).
    """
    b, theta, valve = _at(fit, free_width)
    found = _point(b, theta, valve)
    slopes = _slopes(b, found)
    gram = slopes @ slopes.T
    free = np.flatnonzero(np.diag(gram) > 0)
    inside = inverse(gram[np.ix_(free, free)])
    out = np.zeros_like(gram)
    out[np.ix_(free, free)] = scattered(inside, (slopes[free] * found.e).T, found.loss)
    return out[:4, :4]


def descend(fit: Fitted, free_width: bool = False) -> Fitted:
    """Move all constants of a model jointly to the smallest innovations variance, by damped Gauss-Newton steps.

    Time constant, dead time, gain, slow terms, the noise model and, with `free_width`, the stickband move together,
    because their optimum lies in narrow valleys.
    """
    b, theta, valve = _at(fit, free_width)
    rule = Descent(ITERATIONS, ITERATIONS, b.at.size, SETTLED, 10.0, 5.0, ITERATIONS)
    best = _descend(b, theta, valve, rule)
    head, slow, ar = np.split(best.theta, (4, BASE))
    valve, t, dead = StemLaw(*best.valve), math.exp(head[0]), float(head[1])
    end = fit.moved(gain=float(head[3]), time_constant_s=t, dead_time_s=dead, valve=valve)
    return replace(end, loss=max(best.loss, 1e-14), count=int(best.e.size), ar=ar.copy(), slow=slow.copy())
