"""All constants of a lag behind a valve at once to the least innovations variance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from identification.estimation.covariance import inverse, scattered
from identification.estimation.hammerstein import (
    Fit,
    ValveTrial,
    fine_stem,
    stem_of,
    sticking,
)
from identification.estimation.noise import judged
from identification.estimation.sensitivities import BASE, damped_step, innovations, sensitivities
from identification.estimation.window import Window
from identification.record import Floats, Mask

ITERATIONS = 25
"""Gauss-Newton steps at most; ours: nine in ten fits stop before the fifteenth."""
SETTLED = 0.01
"""Gain in log likelihood [nat] below which the steps stop."""


@dataclass(frozen=True, slots=True)
class _Bench:
    """What all trials of a descent share: the window, PV less its mean, the load's step, the samples judged, None
    where all are, what is held, and whether the stickband is free."""

    window: Window
    y: Floats
    extra: Floats
    counts: Mask | None
    held: Mask
    free_width: bool

    @property
    def factor(self) -> int:
        """Samples of a stem in a block."""
        return self.window.factor if self.window.fine else 1

    def stem(self, valve: ValveTrial) -> Floats:
        """The stem behind a valve, at the interval at which responses are stepped."""
        return (fine_stem if self.window.fine else stem_of)(self.window, valve)

    def of_judged(self, rows: Floats, order: int) -> Floats:
        """Columns of the samples judged."""
        return rows[..., order:] if self.counts is None else rows[..., order:][..., self.counts]


def _bench(window: Window, order: int, free_width: bool) -> _Bench:
    held = np.zeros(BASE + order, dtype=bool)
    held[2], held[7] = not free_width, window.step_at <= 0
    counts = None if window.usable.all() else judged(window.usable, order)[order:]
    return _Bench(window, window.y - window.y.mean(), window.extra, counts, held, free_width)


@dataclass(frozen=True, slots=True)
class _Trial:
    """One point of the descent: constants, stem, unit response, residual, innovations judged, their mean square."""

    theta: Floats
    valve: ValveTrial
    stem: Floats
    x: Floats
    r: Floats
    e: Floats
    loss: float


def _trial(bench: _Bench, theta: Floats, valve: ValveTrial) -> _Trial:
    stem, window = bench.stem(valve), bench.window
    x, r, white = innovations(bench.y, stem, bench.extra, theta, window.dt_s, bench.factor)
    e = bench.of_judged(white, theta.size - BASE)
    return _Trial(theta, valve, stem, x, r, e, float(e @ e) / e.size)


def _slopes(bench: _Bench, trial: _Trial) -> Floats:
    """Derivatives of the innovations judged, shape (8 + order, m)."""
    width_step = 0.01 * trial.valve.stickband if bench.free_width else 0.0
    wider = bench.stem(_widened(trial.valve, width_step)) if bench.free_width else trial.stem
    stems, theta = (trial.stem, wider), trial.theta
    rows = sensitivities(
        trial.x, trial.r, stems, width_step, bench.extra, theta, bench.window.dt_s, bench.factor
    )
    return bench.of_judged(rows, theta.size - BASE)


def _widened(valve: ValveTrial, step: float) -> ValveTrial:
    """The valve with a wider stickband, its jump share kept."""
    share = valve.slip_jump / valve.stickband if valve.stickband > 0 else 0.0
    return sticking(valve.stickband + step, share, valve.tolerance)


def _moved(bench: _Bench, trial: _Trial, step: Floats) -> tuple[Floats, ValveTrial] | None:
    """Parameters after a step, None where it leaves what is searched."""
    window, theta = bench.window, trial.theta + step
    most_t, most_dead = window.bounds
    theta[0] = min(max(theta[0], math.log(0.05 * window.dt_s)), math.log(most_t))
    theta[1] = min(max(theta[1], -window.half_block_s if window.fine else 0.0), most_dead)
    if not bench.free_width:
        return theta, trial.valve
    width = trial.valve.stickband + step[2]
    if width <= 0.2 * trial.valve.stickband:
        return None
    theta[2] = width
    return theta, _widened(trial.valve, step[2])


def _theta(fit: Fit) -> Floats:
    head = [math.log(fit.time_constant_s), fit.dead_time_s, fit.valve.stickband, fit.gain]
    return np.concatenate((head, fit.base, fit.ar))


def covariance(window: Window, fit: Fit, free_width: bool = False) -> Floats:
    """Covariance of (log T, L, stickband, gain) at a fit, shape (4, 4); zero for what was held.

    The noise model's and the slow terms' share is in it (covariance.py).
    """
    bench = _bench(window, fit.ar.size, free_width)
    trial = _trial(bench, _theta(fit), fit.valve)
    slopes = _slopes(bench, trial)
    gram = slopes @ slopes.T
    free = np.array([j for j in range(gram.shape[0]) if not bench.held[j] and gram[j, j] > 0])
    inside = inverse(gram[np.ix_(free, free)])
    out = np.zeros_like(gram)
    out[np.ix_(free, free)] = scattered(inside, (slopes[free] * trial.e).T, trial.loss)
    return out[:4, :4]


def descend(window: Window, fit: Fit, free_width: bool = False) -> Fit:
    """All constants of a model together to the least innovations variance, by damped Gauss-Newton steps.

    Time constant, dead time, gain, slow terms and the noise model, and with `free_width` the stickband, move at
    once, because they trade against each other along narrow valleys.
    """
    bench = _bench(window, fit.ar.size, free_width)
    best = _trial(bench, _theta(fit), fit.valve)
    damping, gram, slope = 1e-3, np.empty((0, 0)), np.empty(0)
    for _ in range(ITERATIONS):
        if not slope.size:
            slopes = _slopes(bench, best)
            gram, slope = slopes @ slopes.T, -(slopes @ best.e)
        moved = _moved(bench, best, damped_step(gram, slope, damping, bench.held))
        trial = _trial(bench, *moved) if moved is not None else None
        if trial is None or not trial.loss < best.loss:
            damping *= 10
            if damping > 1e4:
                break
            continue
        gained = 0.5 * best.e.size * math.log(best.loss / max(trial.loss, 1e-300))
        best, damping, slope = trial, max(damping / 5, 1e-7), np.empty(0)
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
        trial.e.size,
        t[BASE:].copy(),
        t[4:BASE].copy(),
    )
