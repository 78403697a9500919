"""Starts of a fit: a search for time constant and dead time, and a scan of valves, under a given noise model.

The search uses blocks and solves gain and slow terms linearly; the descent ends at the record's own interval. The
starts of `explain`'s baseline model come from the same search, but its descent is a different one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from identification.estimation.descent import compass
from identification.estimation.noise import AR_ORDER, arx_noise, every_lag, generic_noise, judged, whitened
from identification.estimation.problem import Problem, Stems, stem_of
from identification.models import Fopdt
from identification.record import Floats, Mask
from identification.simulation.lag import Lag, stepped, unit_lag
from identification.simulation.valve import IDEAL, StemLaw, sticking

INPUT_LAGS = 10  # Lags of OP in the unstructured model that gives the first noise model: as AR_ORDER
SHORTEST = 1.5  # Shortest time constant tried [samples]
APART = 2.5  # Ratio of neighbouring time constants tried: the descent covers a factor of three either way
DELAYS = (0.0, 0.1, 0.3, 0.8)  # Dead times tried [of the time constant]
LONGEST_DELAY = 0.1  # Longest dead time tried at first, as a share of the record; the descent may exceed it
PIT_STEPS = (0.02, 0.007, 0.0025)  # Relative steps of the search within a minimum of stickband and jump

FADED = 1e-17
"""A decay below this share of its start is treated as zero; numbers have sixteen digits."""
MOVES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, -1.0))
"""Compass moves in log time constant and dead time."""
PIT_MOVES = ((1, 0), (-1, 0), (0, 1), (0, -1))
"""Compass moves in stickband and jump."""
NO_WHITENING = np.zeros(1)
"""Empty noise model, for a simulation judged by its own errors."""


@njit(cache=True)
def solved(gram: Floats, cross: Floats) -> Floats:
    """Least squares from a product matrix whose upper half is filled, shape (4,), by elimination in place. A call of
    a library solver takes longer than the elimination of four rows."""
    n, beta = cross.size, cross.copy()
    for i in range(n):
        gram[i, i] = gram[i, i] * (1 + 1e-9) + 1e-12
    least = 1e-12 * np.diag(gram)
    for i in range(n):
        gram[i, i] = max(gram[i, i], least[i])
        for j in range(i + 1, n):
            factor = gram[i, j] / gram[i, i]
            for k in range(j, n):
                gram[j, k] -= factor * gram[i, k]
            beta[j] -= factor * beta[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            beta[i] -= gram[i, k] * beta[k]
        beta[i] /= gram[i, i]
    return beta


@njit(cache=True)
def _known(y: Floats, judged: Mask, first: int) -> tuple[Floats, Floats]:
    """Terms that do not depend on dynamics: PV, weight and weight times t, shape (3, n), zero where nothing is
    judged, and the sums over PV squared, PV, PV t, 1, t and t squared, shape (6,)."""
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
    """Write the response of a lag into `out`, as `respond`, and return its products. Each step depends on the one
    before; the sums are computed meanwhile."""
    y, xv, x1, xt, xx = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(stem.size):
        out[k] = y
        weighted = y * rows[1, k]
        xv, x1, xt, xx = xv + y * rows[0, k], x1 + weighted, xt + y * rows[2, k], xx + y * weighted
        y = stepped(y, lag, stem[max(k - lag.delay, 0)], stem[max(k - lag.delay - 1, 0)])
    return xv, x1, xt, xx


Faded = tuple[float, float, float, float, float]
"""Sums of a decay times PV, a response, 1, t and itself over the samples judged."""


@njit(cache=True)
def faded_products(x: Floats, rows: Floats, pole: float, outlasts: bool) -> Faded:
    """Products of the decay of a response; zero where its time constant exceeds half the stretch."""
    fv, fx, f1, ft, ff = 0.0, 0.0, 0.0, 0.0, 0.0
    free, k = 0.0 if outlasts else 1.0, 0
    while k < x.size and free > FADED:
        weighted = free * rows[1, k]
        fv, fx, f1 = fv + free * rows[0, k], fx + x[k] * weighted, f1 + weighted
        ft, ff = ft + free * rows[2, k], ff + free * weighted
        free *= pole
        k += 1
    return fv, fx, f1, ft, ff


@njit(cache=True)
def variance_left(products: Products, faded: Faded, sums: Floats, level: float) -> tuple[float, int, Floats]:
    """Innovations variance, samples judged and coefficients (gain, 1, t, decay) of one response; see `score`."""
    gram, cross = np.zeros((4, 4)), np.zeros(4)
    cross[0], gram[0, 1], gram[0, 2], gram[0, 0] = products
    power, cross[1], cross[2], gram[1, 1], gram[1, 2], gram[2, 2] = sums
    cross[3], gram[0, 3], gram[1, 3], gram[2, 3], gram[3, 3] = faded
    beta = solved(gram, cross)
    count = int(sums[3])
    variance = max((power - np.dot(beta, cross)) / max(count, 1), 1e-14)
    beta[1] /= level
    beta[2] /= level
    return variance, count, beta


Dynamics = tuple[float, float]
"""Time constant and dead time [s]."""


class WhitePv(NamedTuple):
    """PV of a problem under one noise model, whitened once for many valves.

    stems : stems of the problem, in blocks; rows, shape (3, n), and sums, shape (6,): see `_known`; ar : the noise
    model, shape (p,); dt_s : interval of blocks [s]; most : largest time constant and dead time searched [s].
    """

    stems: Stems
    rows: Floats
    sums: Floats
    ar: Floats
    dt_s: float
    most: Dynamics


class Prepared(NamedTuple):
    """Whitened PV and the whitened stem behind one valve, for many dynamics: a lag and A(q) commute."""

    pv: WhitePv
    stem: Floats


@njit(cache=True)
def behind(pv: WhitePv, valve: StemLaw) -> Prepared:
    """Whitened PV with the whitened stem behind a valve."""
    return Prepared(pv, whitened_stem(stem_of(pv.stems, valve), pv.ar))


@njit(cache=True)
def score(prepared: Prepared, time_constant_s: float, dead_time_s: float) -> tuple[float, int, Floats]:
    """Innovations variance, samples judged and coefficients (gain, 1, t, decay) of one candidate."""
    pv, stem = prepared.pv, prepared.stem
    lag = unit_lag(time_constant_s, dead_time_s, pv.dt_s)
    x = np.empty_like(stem)
    products = _response(stem, lag, pv.rows, x)
    faded = faded_products(x, pv.rows, lag.pole, time_constant_s > 0.5 * x.size * pv.dt_s)
    return variance_left(products, faded, pv.sums, level_of(pv.ar))


@njit(cache=True)
def level_of(ar: Floats) -> float:
    """A(1) of a noise model."""
    return max(1.0 - ar.sum(), 1e-6)  # type: ignore[no-any-return]


@njit(cache=True)
def whitened_stem(x: Floats, ar: Floats) -> Floats:
    """Innovations, zero where incomplete: a lag would ring from incomplete ones."""
    white = whitened(x, ar, every_lag(ar.size))
    white[: ar.size] = 0.0
    return white


def white_pv(problem: Problem, ar: Floats) -> WhitePv:
    """Whiten PV with one noise model."""
    rows, sums = _known(whitened_stem(problem.centred, ar), judged(problem.usable, ar.size), ar.size)
    return WhitePv(problem.stems_in_blocks, rows, sums, ar, problem.dt_s, problem.bounds)


@register_jitable  # type: ignore[untyped-decorator]
def _tried(p: Prepared, at: Dynamics, move: Dynamics, step: float) -> tuple[Dynamics, float]:
    """Move log time constant and dead time by a step of .4 and of two blocks; return the residual variance there."""
    t, d = at[0] + move[0] * 0.4 * step, at[1] + move[1] * 2.0 * p.pv.dt_s * step
    if d < 0 or d > p.pv.most[1] or t < math.log(0.05 * p.pv.dt_s) or t > math.log(p.pv.most[0]):
        return (t, d), np.inf
    return (t, d), score(p, math.exp(t), d)[0]


@njit(cache=True)
def _least(p: Prepared, begins: Floats, halvings: int) -> Dynamics:
    """Compass search from the best of the starts (rows of log time constant and dead time)."""
    best, least = (begins[0, 0], begins[0, 1]), np.inf
    for i in range(begins.shape[0]):
        found = score(p, math.exp(begins[i, 0]), begins[i, 1])[0]
        if found < least:
            best, least = (begins[i, 0], begins[i, 1]), found
    (t, dead_s), _ = compass(p, best, least, _tried, MOVES, 0.5 ** np.arange(float(halvings)), 1e-6)
    return math.exp(t), dead_s


def search(prepared: Prepared, begins: list[Dynamics], halvings: int) -> tuple[Dynamics, float, int, Floats]:
    """Time constant and dead time [s] of least innovations variance, and their score: compass search from the best
    start."""
    (most_t, most_dead), dt_s = prepared.pv.most, prepared.pv.dt_s
    first = [[math.log(min(max(t, 0.06 * dt_s), 0.95 * most_t)), min(d, most_dead)] for t, d in begins]
    found = _least(prepared, np.array(first), halvings)
    return found, *score(prepared, *found)


@register_jitable  # type: ignore[untyped-decorator]
def _valve_tried(
    at: tuple[WhitePv, Dynamics], valve: StemLaw, move: tuple[int, int], step: float
) -> tuple[StemLaw, float]:
    """A valve with stickband or jump moved by a relative step, and its residual variance."""
    pv, (time_constant_s, dead_time_s) = at
    width = (valve.breakaway + valve.sliding) * (1 + move[0] * step)
    share = min((valve.breakaway - valve.sliding) * (1 + 2 * move[1] * step), width) / width
    other = sticking(width, share, valve.tolerance)
    return other, score(behind(pv, other), time_constant_s, dead_time_s)[0]


@njit(cache=True)
def settled(pv: WhitePv, valve: StemLaw, least: float, dynamics: Dynamics) -> StemLaw:
    """The local minimum in stickband and jump: decreasing steps to the least innovations variance, `least` at the
    start, under given dynamics."""
    return compass((pv, dynamics), valve, least, _valve_tried, PIT_MOVES, PIT_STEPS, 1e-7)[0]  # type: ignore[no-any-return]


def starts(problem: Problem, period_s: float) -> list[Dynamics]:
    """Starts of the search: time constants and dead times distributed over the period [s]."""
    times = [period_s * s for s in (0.03, 0.12, 0.5, 2.5)]
    deads = [period_s * s for s in (0.0, 0.06, 0.15, 0.33)]
    most_t, most_dead = problem.bounds
    return sorted({(min(t, 0.7 * most_t), min(d, most_dead)) for t in times for d in deads})


def record_starts(samples: int, dt_s: float) -> list[Dynamics]:
    """Time constants and dead times [s] at which the search begins, over all time scales of the record."""
    count = 1 + math.ceil(math.log(max(samples / SHORTEST, APART)) / math.log(APART))
    times = SHORTEST * APART ** np.arange(count)
    pairs = {(t, min(round(t * d, 1), LONGEST_DELAY * samples)) for t in times for d in DELAYS}
    return [(t * dt_s, d * dt_s) for t, d in sorted(pairs)]


def _plain(problem: Problem, ar: Floats) -> Fopdt:
    """The best process behind an ideal valve in a problem under one noise model."""
    prepared = behind(white_pv(problem, np.ascontiguousarray(ar)), IDEAL)
    dynamics, _, _, beta = search(prepared, record_starts(problem.y.size, problem.dt_s), 2)
    return Fopdt(float(beta[0]), *dynamics)


def simulated_best(p: Problem) -> Fopdt:
    """The baseline model with the least simulation error of PV, linear load removed; see plain_processes."""
    return _plain(p, NO_WHITENING)


def initial_noise(problem: Problem) -> Floats:
    """An initial noise model of a problem, shape (AR_ORDER,), learnt without a process."""
    stem = problem.stems_in_blocks.ideal
    return arx_noise(problem.centred, stem, problem.usable, AR_ORDER, INPUT_LAGS)


def plain_processes(p: Problem) -> list[Fopdt]:
    """The best baseline models of PV from OP: one step ahead under each of two initial noise models, and simulated.
    Starts for a descent, one for each; the last is the simulated one."""
    return [_plain(p, ar) for ar in (initial_noise(p), generic_noise(), NO_WHITENING)]
