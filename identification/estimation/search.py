"""Where a fit begins: time constant and dead time searched, and many valves tried, under a given noise model.

The search knows blocks alone and solves gain and slow terms linearly; the descent ends at the record's own interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identification.estimation.hammerstein import ValveTrial, stem_blocks, stem_of
from identification.estimation.noise import every_lag, judged, whitened
from identification.estimation.window import Window
from identification.record import Floats, Mask
from identification.signals.notch import notch
from identification.simulation.discretization import unit_lag

AR_ORDER = 8
"""Order of the noise model; ours: on the simulated plants 12 gives innovations less than 1 % smaller."""
INPUT_LAGS = 10
"""Lags of OP in the unstructured model that gives the first noise model; ours, as AR_ORDER."""

NOTCH_WIDTH = 0.15
"""Width of the band that is left out when the process is wanted in spite of a load with a line; ours."""


@njit(cache=True)
def solved(gram: Floats, cross: Floats) -> Floats:
    """Least squares of a matrix of products of which the upper half is filled, shape (4,)."""
    for i in range(4):
        gram[i, i] = gram[i, i] * (1 + 1e-9) + 1e-12
        for j in range(i):
            gram[i, j] = gram[j, i]
    return np.linalg.solve(gram, cross)  # type: ignore[return-value]


@njit(cache=True)
def score(
    y: Floats,
    stem: Floats,
    judged: Mask,
    level: float,
    first: int,
    time_constant_s: float,
    dead_time_s: float,
    dt_s: float,
) -> tuple[float, int, Floats]:
    """Innovations variance, samples judged and coefficients (gain, 1, t, decay) of one candidate.

    `y` and `stem` are whitened already (a lag and A(q) commute), `level` is A(1), `first` the first sample judged.
    """
    n = y.size
    pole, now, before, delay = unit_lag(time_constant_s, dead_time_s, dt_s)
    gram = np.zeros((4, 4))
    cross = np.zeros(4)
    power, count, x, free = 0.0, 0, 0.0, 1.0
    outlasts = time_constant_s > 0.5 * n * dt_s
    for k in range(n):
        if judged[k] and k >= first:
            t = 2.0 * k / n - 1.0
            d = 0.0 if outlasts else free
            v = y[k]
            count += 1
            power += v * v
            cross[0] += x * v
            cross[1] += v
            cross[2] += t * v
            cross[3] += d * v
            gram[0, 0] += x * x
            gram[0, 1] += x
            gram[0, 2] += x * t
            gram[0, 3] += x * d
            gram[1, 2] += t
            gram[1, 3] += d
            gram[2, 2] += t * t
            gram[2, 3] += t * d
            gram[3, 3] += d * d
        x = pole * x + now * stem[max(k - delay, 0)] + before * stem[max(k - delay - 1, 0)]
        free *= pole
    gram[1, 1] = count
    beta = solved(gram, cross)
    left = max((power - np.dot(beta, cross)) / max(count, 1), 1e-14)
    beta[1] /= level
    beta[2] /= level
    return left, count, beta  # type: ignore[return-value]


Dynamics = tuple[float, float]
"""Time constant and dead time [s]."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """A window, a valve and a noise model, whitened once for many dynamics."""

    window: Window
    valve: ValveTrial
    ar: Floats
    white_y: Floats
    white_stem: Floats
    judged: Mask
    first: int
    notch_period: float

    @property
    def level(self) -> float:
        """A(1)."""
        return max(1.0 - float(self.ar.sum()), 1e-6)

    def score(self, time_constant_s: float, dead_time_s: float) -> tuple[float, int, Floats]:
        """Innovations variance, count and coefficients for a time constant and a dead time [s]."""
        args = (self.white_y, self.white_stem, self.judged, self.level, self.first)
        sigma2, count, beta = score(*args, time_constant_s, dead_time_s, self.window.dt_s)
        return float(sigma2), int(count), np.asarray(beta, dtype=np.float64)


@njit(cache=True)
def _white(x: Floats, ar: Floats) -> Floats:
    """Innovations, zero where they are not whole yet: a lag or a notch would ring from those."""
    white = whitened(x, ar, every_lag(ar.size))
    white[: ar.size] = 0.0
    return white


def _filtered(x: Floats, ar: Floats, notch_period: float) -> Floats:
    white = _white(np.ascontiguousarray(x), ar)
    return white if notch_period <= 0 else notch(white, notch_period, NOTCH_WIDTH)


def prepare(window: Window, valve: ValveTrial, ar: Floats, notch_period: float = 0.0) -> Prepared:
    """Whiten PV and the stem with one noise model; notch_period in blocks, 0: none."""
    return Prepared(
        window,
        valve,
        ar,
        _filtered(window.y - window.y.mean(), ar, notch_period),
        _filtered(stem_of(window, valve), ar, notch_period),
        judged(window.usable, ar.size),
        ar.size + int(notch_period),
        notch_period,
    )


@njit(cache=True)
def _least(
    y: Floats,
    stem: Floats,
    judged: Mask,
    level: float,
    first: int,
    dt: float,
    begins: Floats,
    bounds: tuple[float, float],
    halvings: int,
) -> tuple[float, float, float]:
    """Best of the starts (rows of log time constant and dead time), then compass search from there."""
    best_t, best_d, least = begins[0, 0], begins[0, 1], np.inf
    for i in range(begins.shape[0]):
        found = score(y, stem, judged, level, first, math.exp(begins[i, 0]), begins[i, 1], dt)[0]
        if found < least:
            best_t, best_d, least = begins[i, 0], begins[i, 1], found
    low_t, high_t = math.log(0.05 * dt), math.log(bounds[0])
    step_t, step_d = 0.4, 2.0 * dt
    moves = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, -1.0))
    for _ in range(halvings):
        moved = True
        while moved:
            moved = False
            for m_t, m_d in moves:
                t, d = best_t + m_t * step_t, best_d + m_d * step_d
                if d < 0 or d > bounds[1] or t < low_t or t > high_t:
                    continue
                found = score(y, stem, judged, level, first, math.exp(t), d, dt)[0]
                if found < least * (1 - 1e-6):
                    best_t, best_d, least, moved = t, d, found, True
        step_t, step_d = step_t / 2, step_d / 2
    return math.exp(best_t), best_d, least


def search(prepared: Prepared, begins: list[Dynamics], halvings: int = 3) -> Dynamics:
    """Time constant and dead time [s] of least innovations variance: the best start, then compass search."""
    most_t, most_dead = prepared.window.bounds
    dt = prepared.window.dt_s
    rows = np.array([[math.log(min(max(t, 0.06 * dt), 0.95 * most_t)), min(d, most_dead)] for t, d in begins])
    t, dead, _ = _least(
        prepared.white_y,
        prepared.white_stem,
        prepared.judged,
        prepared.level,
        prepared.first,
        dt,
        rows,
        (most_t, most_dead),
        halvings,
    )
    return t, dead


@njit(cache=True)
def _scan(
    op: Floats,
    white_y: Floats,
    judged: Mask,
    ar: Floats,
    dt_s: float,
    factor: int,
    pairs: Floats,
    tolerance: float,
    begins: Floats,
) -> Floats:
    level = max(1.0 - ar.sum(), 1e-6)
    out = np.empty(pairs.shape[0])
    for i in range(pairs.shape[0]):
        width, share = pairs[i, 0], pairs[i, 1]
        stem = stem_blocks(op, 0.5 * width * (1 + share), 0.5 * width * (1 - share), tolerance, factor)
        white = _white(stem - stem.mean(), ar)
        out[i] = np.inf
        for j in range(begins.shape[0]):
            left = score(white_y, white, judged, level, ar.size, begins[j, 0], begins[j, 1], dt_s)[0]
            out[i] = min(out[i], left)
    return out


def scan(window: Window, pairs: Floats, tolerance: float, ar: Floats, begins: list[Dynamics]) -> Floats:
    """Innovations variance of many stick-slips at once.

    Parameters
    ----------
    window : Window
    pairs : ndarray of shape (m, 2)
        Stickband [% OP] and slip jump as a share of it.
    tolerance : float
        How the stems behave in motion (valve.py).
    ar : ndarray of shape (p,)
        Noise model.
    begins : list of Dynamics
        Time constants and dead times tried [s]; the best counts.

    Returns
    -------
    ndarray of shape (m,)
        Least innovations variance of each pair [% PV squared].
    """
    white_y = _white(np.ascontiguousarray(window.y - window.y.mean()), ar)
    counts = judged(window.usable, ar.size)
    table = np.array(begins)
    return _scan(window.op, white_y, counts, ar, window.dt_s, window.factor, pairs, tolerance, table)  # type: ignore[no-any-return]


def starts(window: Window, period_s: float) -> list[Dynamics]:
    """Starts of the search: time constants and dead times spread over the period [s]."""
    times = [period_s * s for s in (0.03, 0.12, 0.5, 2.5)]
    deads = [period_s * s for s in (0.0, 0.06, 0.15, 0.33)]
    most_t, most_dead = window.bounds
    return sorted({(min(t, 0.7 * most_t), min(d, most_dead)) for t in times for d in deads})
