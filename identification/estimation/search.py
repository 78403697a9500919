"""Where a fit begins: time constant and dead time searched, and many valves tried, under a given noise model.

The search knows blocks alone and solves gain and slow terms linearly; the descent ends at the record's own interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from identification.estimation.descent import compass
from identification.estimation.hammerstein import stem_of
from identification.estimation.noise import every_lag, judged, whitened
from identification.estimation.window import Window
from identification.record import Floats, Mask
from identification.signals.filters import notch
from identification.simulation.lag import Lag, stepped, unit_lag
from identification.simulation.valve import StemLaw

AR_ORDER = 8
"""Order of the noise model; ours: on the simulated plants 12 gives innovations less than 1 % smaller."""
INPUT_LAGS = 10
"""Lags of OP in the unstructured model that gives the first noise model; ours, as AR_ORDER."""

FADED = 1e-17
"""A decay under this share of its start is over; numbers have sixteen digits."""
MOVES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, -1.0))
"""Steps of log time constant and dead time that are tried."""
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
def _known(y: Floats, judged: Mask, first: int) -> tuple[Floats, Floats]:
    """What does not depend on dynamics: PV, weight and weight times t, shape (3, n), zero where nothing is judged,
    and the sums over PV squared, PV, PV t, 1, t and t squared, shape (6,)."""
    n = y.size
    rows = np.zeros((3, n))
    vv, v1, vt, count, t1, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(first, n):
        if judged[k]:
            t, v = 2.0 * k / n - 1.0, y[k]
            rows[0, k], rows[1, k], rows[2, k] = v, 1.0, t
            vv, v1, vt = vv + v * v, v1 + v, vt + t * v
            count, t1, tt = count + 1.0, t1 + t, tt + t * t
    return rows, np.array((vv, v1, vt, count, t1, tt))


Products = tuple[float, float, float, float]
"""Sums of a response times PV, 1, t and itself over the samples judged."""


@njit(cache=True)
def _response(stem: Floats, lag: Lag, rows: Floats, out: Floats) -> Products:
    """The response of a lag into `out`, as `respond`, and its products; each step of it waits for the one before, and
    the sums are made meanwhile."""
    y, xv, x1, xt, xx = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(stem.size):
        out[k] = y
        weighted = y * rows[1, k]
        xv, x1, xt, xx = xv + y * rows[0, k], x1 + weighted, xt + y * rows[2, k], xx + y * weighted
        y = stepped(y, lag, stem[max(k - lag.delay, 0)], stem[max(k - lag.delay - 1, 0)])
    return xv, x1, xt, xx


@njit(cache=True)
def variance_left(
    x: Floats, products: Products, rows: Floats, sums: Floats, level: float, pole: float, outlasts: bool
) -> tuple[float, int, Floats]:
    """Innovations variance, samples judged and coefficients (gain, 1, t, decay) of one response; see `score`."""
    gram, cross = np.zeros((4, 4)), np.zeros(4)
    cross[0], gram[0, 1], gram[0, 2], gram[0, 0] = products
    power, cross[1], cross[2], gram[1, 1], gram[1, 2], gram[2, 2] = sums
    free, k = 0.0 if outlasts else 1.0, 0
    while k < x.size and free > FADED:
        w, t, faded = rows[1, k], rows[2, k], free
        cross[3] += faded * rows[0, k]
        gram[0, 3] += faded * x[k] * w
        gram[1, 3] += faded * w
        gram[2, 3] += faded * t
        gram[3, 3] += faded * faded * w
        free *= pole
        k += 1
    beta = solved(gram, cross)
    count = int(sums[3])
    left = max((power - np.dot(beta, cross)) / max(count, 1), 1e-14)
    beta[1] /= level
    beta[2] /= level
    return left, count, beta  # type: ignore[return-value]


@njit(cache=True)
def score(
    rows: Floats,
    sums: Floats,
    stem: Floats,
    level: float,
    time_constant_s: float,
    dead_time_s: float,
    dt_s: float,
) -> tuple[float, int, Floats]:
    """Innovations variance, samples judged and coefficients (gain, 1, t, decay) of one candidate.

    `rows` and `sums` are those of PV (`_known`); it and `stem` are whitened already (a lag and A(q) commute), `level`
    is A(1).
    """
    lag = unit_lag(time_constant_s, dead_time_s, dt_s)
    x = np.empty_like(stem)
    products = _response(stem, lag, rows, x)
    return variance_left(x, products, rows, sums, level, lag.pole, time_constant_s > 0.5 * x.size * dt_s)


Dynamics = tuple[float, float]
"""Time constant and dead time [s]."""


@dataclass(frozen=True, slots=True)
class WhitePv:
    """PV of a window under one noise model, whitened once for many valves.

    rows, shape (3, n), and sums, shape (6,): see `_known`; notch_period in blocks, 0: none.
    """

    window: Window
    ar: Floats
    rows: Floats
    sums: Floats
    notch_period: float

    def behind(self, valve: StemLaw) -> Prepared:
        """The same with the stem behind one valve."""
        stem = _filtered(stem_of(self.window.stems_in_blocks, valve), self.ar, self.notch_period)
        return Prepared(self.window, valve, self.ar, self.rows, self.sums, stem)


@dataclass(frozen=True, slots=True)
class Prepared:
    """A window, a valve and a noise model, whitened once for many dynamics."""

    window: Window
    valve: StemLaw
    ar: Floats
    rows: Floats
    sums: Floats
    white_stem: Floats

    @property
    def level(self) -> float:
        """A(1)."""
        return max(1.0 - float(self.ar.sum()), 1e-6)

    def score(self, time_constant_s: float, dead_time_s: float) -> tuple[float, int, Floats]:
        """Innovations variance, count and coefficients for a time constant and a dead time [s]."""
        args = (self.rows, self.sums, self.white_stem, self.level)
        sigma2, count, beta = score(*args, time_constant_s, dead_time_s, self.window.dt_s)
        return float(sigma2), int(count), np.asarray(beta, dtype=np.float64)


@njit(cache=True)
def whitened_stem(x: Floats, ar: Floats) -> Floats:
    """Innovations, zero where they are not whole yet: a lag or a notch would ring from those."""
    white = whitened(x, ar, every_lag(ar.size))
    white[: ar.size] = 0.0
    return white


def _filtered(x: Floats, ar: Floats, notch_period: float) -> Floats:
    white = whitened_stem(np.ascontiguousarray(x), ar)
    return white if notch_period <= 0 else notch(white, notch_period, NOTCH_WIDTH)


def white_pv(window: Window, ar: Floats, notch_period: float = 0.0) -> WhitePv:
    """Whiten PV with one noise model; notch_period in blocks, 0: none."""
    y = _filtered(window.centred, ar, notch_period)
    rows, sums = _known(y, judged(window.usable, ar.size), ar.size + int(notch_period))
    return WhitePv(window, ar, rows, sums, notch_period)


def prepare(window: Window, valve: StemLaw, ar: Floats, notch_period: float = 0.0) -> Prepared:
    """Whiten PV and the stem with one noise model; notch_period in blocks, 0: none."""
    return white_pv(window, ar, notch_period).behind(valve)


class _Scored(NamedTuple):
    """What candidates of one valve are scored by: see `score`; and the largest time constant and dead time [s]."""

    rows: Floats
    sums: Floats
    stem: Floats
    level: float
    dt_s: float
    most: Dynamics


@njit(cache=True)
def _left(s: _Scored, t: float, dead_s: float) -> float:
    return score(s.rows, s.sums, s.stem, s.level, math.exp(t), dead_s, s.dt_s)[0]  # type: ignore[no-any-return]


@register_jitable  # type: ignore[untyped-decorator]
def _tried(s: _Scored, at: Dynamics, move: Dynamics, step: float) -> tuple[Dynamics, float]:
    """Log time constant and dead time moved by a step of .4 and of two blocks, and the variance left there."""
    t, d = at[0] + move[0] * 0.4 * step, at[1] + move[1] * 2.0 * s.dt_s * step
    if d < 0 or d > s.most[1] or t < math.log(0.05 * s.dt_s) or t > math.log(s.most[0]):
        return (t, d), np.inf
    return (t, d), _left(s, t, d)


@njit(cache=True)
def _least(s: _Scored, begins: Floats, halvings: int) -> Dynamics:
    """Best of the starts (rows of log time constant and dead time), then compass search from there."""
    best, least = (begins[0, 0], begins[0, 1]), np.inf
    for i in range(begins.shape[0]):
        found = _left(s, begins[i, 0], begins[i, 1])
        if found < least:
            best, least = (begins[i, 0], begins[i, 1]), found
    (t, dead_s), _ = compass(s, best, least, _tried, MOVES, 0.5 ** np.arange(float(halvings)), 1e-6)
    return math.exp(t), dead_s


def search(prepared: Prepared, begins: list[Dynamics], halvings: int = 3) -> Dynamics:
    """Time constant and dead time [s] of least innovations variance: the best start, then compass search."""
    w = prepared.window
    most_t, most_dead = w.bounds
    scored = _Scored(
        prepared.rows, prepared.sums, prepared.white_stem, prepared.level, w.dt_s, (most_t, most_dead)
    )
    first = [[math.log(min(max(t, 0.06 * w.dt_s), 0.95 * most_t)), min(d, most_dead)] for t, d in begins]
    return _least(scored, np.array(first), halvings)  # type: ignore[no-any-return]


def starts(window: Window, period_s: float) -> list[Dynamics]:
    """Starts of the search: time constants and dead times spread over the period [s]."""
    times = [period_s * s for s in (0.03, 0.12, 0.5, 2.5)]
    deads = [period_s * s for s in (0.0, 0.06, 0.15, 0.33)]
    most_t, most_dead = window.bounds
    return sorted({(min(t, 0.7 * most_t), min(d, most_dead)) for t in times for d in deads})
