"""Source of a resonance: the loop or its load. A process is fitted under a load that is smooth, has a line, or both.

Direct identification with a free noise model cannot distinguish a resonant loop from a resonant load: the noise model
takes over the resonance and the process gain goes to zero. Physics restricts the noise. A load that enters before the
process and wanders is smooth: its noise model has real poles, one of them the process's own, and real zeros. Only a
periodic load has a pair of complex poles. Under a smooth load the loop itself must cause the resonance, and gain,
time constant and dead time follow from it (prediction errors, Ljung 1999, ch. 13: consistent in closed loop if the
noise model can represent the true one).

The model of a record is y = K x + c + H w with x the response of a unit lag with dead time to the stem and H = (1 -
z1 q)(1 - z2 q) / ((1 - p q)(1 - s q)) (1 - 2 v cos(a) q + v^2 q^2) / (1 - 2 r cos(a) q + r^2 q^2), q one block back,
p the pole of the lag, s of the load's corner, r and v > 0 where the load has a line of angle a.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from identification.estimation.descent import Descent, down, nats
from identification.estimation.model import Fitted, start_at
from identification.estimation.noise import AR_ORDER
from identification.estimation.problem import Problem, stem_of
from identification.estimation.search import Dynamics
from identification.models import Fopdt
from identification.record import Floats, Mask
from identification.simulation.lag import Lag, stepped, unit_lag
from identification.simulation.valve import IDEAL, StemLaw

LAGS = (0.05, 0.1, 0.2, 0.45, 1.0, 2.1, 4.5, 10.0, 20.0)
"""Time constants of the lags with which a controller would ring at a period, from which the search begins
[periods]: from a lag whose phase is that of a gain alone to one that is an integrator there."""
MARGIN = 1.2  # Gain margin of these lags: a damping of about .05
FOLLOWED = 2
"""Starts that are followed to the end: on 48 loops of benchmarks/world of seed 1 two come to the optimum that
nine come to."""
FIRST_STEPS = 5  # Gauss-Newton steps of every start, after which the best are followed: as followed
SMOOTH_STEPS = 20  # Largest number of Gauss-Newton steps
SETTLED = 0.1  # Gain of a step below which a descent ends [nat]: far below what an answer needs
FORGETS = 3
"""Usable blocks after a hole that are not judged [blocks]: a noise model of two poles and two zeros looks
back two."""
LINE_AWAY = 1.3
"""Factor within which the period of a load's line is searched: the error's own period is known far better."""
LINE_KEPT = 3.0
"""Time over which a periodic load keeps its phase at least; less is the resonance of a loop [periods]: a loop
of damping .1 forgets its phase in 1.6 periods, one of .05 in 3.2."""
LINE_STARTS = (6.0, 60.0)  # The same from which the search begins [periods]
CUT = 0.02
"""Share of an innovation that remains in a load's correlation where its noise model is truncated: innovations
within 5 % of the load's own (tests/identification/estimation/test_smooth_load.py)."""
MOST_LAGS = 30  # Lags of such a noise model at most: with more, holes in a record leave no block to judge

LOAD, LINE = 5, 8
"""Constants of a model: log time constant [s], dead time [blocks], log corner time [s], inverse hyperbolic tangents
of both zeros; of a line: log frequency relative to the expected one, log of the coherence time in periods, and log of
its height; of a load that is no sine: log of the height of each of its HARMONICS."""
HARMONICS = (3, 5)
"""Harmonics of a line whose load is no sine, but symmetric; their phase wanders with the line's."""
ORDERS = np.array((1.0, *HARMONICS))
"""A line and its harmonics, in the kernel's type."""
STEPS = np.array([0.01, 0.02, 0.02, 0.02, 0.02, 0.001, 0.02, 0.02, 0.02, 0.02])
"""Steps of the constants for numeric derivatives."""
LONGEST = np.array([1.0, 4.0, 1.5, 1.0, 1.0, 0.05, 1.5, 1.5, 1.5, 1.5])
"""Longest steps of a descent in each constant, because the least squares are not convex."""
CORNERS, ZEROS = (1.0, 10.0, 100.0), ((0.0, 0.2), (0.4, 0.7), (1.0, 1.5))
"""Starts of the load: its corner time [periods] and its zeros, which always differ to be distinguishable."""


@dataclass(frozen=True, slots=True)
class Line:
    """A periodic load: its period [s] and its coherence time [periods]."""

    period_s: float
    kept: float


@dataclass(frozen=True, slots=True)
class SmoothFit:
    """A process with its load.

    process, its dead time in the record's own samples; log_likelihood [nat] up to a constant, over `count` blocks;
    theta, the constants as in LOAD and LINE; law, the valve's; line, None where the load has none.
    """

    process: Fopdt
    log_likelihood: float
    count: int
    sigma2: float
    theta: Floats
    law: StemLaw
    line: Line | None


class _Case(NamedTuple):
    """Data shared by all points of a descent: PV and stem in blocks, less their means; blocks judged; interval [s];
    ranges of the constants, shape (2, m); expected period [s]."""

    y: Floats
    stem: Floats
    at: NDArray[np.int64]
    dt_s: float
    ranges: Floats
    period_s: float


class _Point(NamedTuple):
    """One point of a descent: constants, innovations judged, gain, and their mean square."""

    theta: Floats
    e: Floats
    gain: float
    loss: float


Noise = tuple[float, float, float, float]
"""Sums and products of the load's poles and zeros: -(p + s), p s, -(z1 + z2), z1 z2."""


@njit(cache=True)
def _whitened(y: Floats, stem: Floats, lag: Lag, noise: Noise, lines: Floats) -> tuple[Floats, Floats]:
    """PV and the unit response to the stem, both whitened by the load model, shape (n,) each.

    lines : shape (m, 4), coefficients of each line: of 1/q and 1/q^2 in the poles, and in the zeros.
    """
    n = y.size
    yw, xw = np.zeros(n), np.zeros(n)
    a1, a2, b1, b2 = noise
    x0, x1, x2 = 0.0, 0.0, 0.0
    m1, m2, k1, k2 = 0.0, 0.0, 0.0, 0.0
    y1, y2 = y[0], y[0]
    for k in range(n):
        xm = x0 + a1 * x1 + a2 * x2 - b1 * k1 - b2 * k2
        ym = y[k] + a1 * y1 + a2 * y2 - b1 * m1 - b2 * m2
        y2, y1, x2, x1 = y1, y[k], x1, x0
        m2, m1, k2, k1 = m1, ym, k1, xm
        yw[k], xw[k] = ym, xm
        x0 = stepped(x0, lag, stem[max(k - lag.delay, 0)], stem[max(k - lag.delay - 1, 0)])
    for i in range(lines.shape[0]):
        r1, r2, v1, v2 = lines[i, 0], lines[i, 1], lines[i, 2], lines[i, 3]
        y1, y2, x1, x2, m1, m2, k1, k2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            ym = yw[k] + r1 * y1 + r2 * y2 - v1 * m1 - v2 * m2
            xm = xw[k] + r1 * x1 + r2 * x2 - v1 * k1 - v2 * k2
            y2, y1, x2, x1 = y1, yw[k], x1, xw[k]
            m2, m1, k2, k1 = m1, ym, k1, xm
            yw[k], xw[k] = ym, xm
    return yw, xw


@njit(cache=True)
def _line(angle: float, rate: float, height: float) -> tuple[float, float, float, float]:
    """Coefficients of a line of this angle [rad/block], rate of decay [1/block] and log of its height."""
    r, v = math.exp(-rate), math.exp(-rate * (1.0 + math.exp(height)))
    turn = 2.0 * math.cos(angle)
    return -turn * r, r * r, -turn * v, v * v


@njit(cache=True)
def _noise(theta: Floats, pole: float, case: _Case) -> tuple[Noise, Floats]:
    """The load model of the constants in the kernel's form."""
    slow = math.exp(-case.dt_s / math.exp(theta[2]))
    z1, z2 = math.tanh(theta[3]), math.tanh(theta[4])
    lines = np.empty((max(theta.size - LINE + 1, 0), 4))
    if theta.size > LOAD:
        angle = 2.0 * math.pi * case.dt_s / case.period_s * math.exp(theta[5])
        rate = case.dt_s / (case.period_s * math.exp(theta[6]))
        for i in range(lines.shape[0]):
            lines[i] = _line(ORDERS[i] * angle, ORDERS[i] ** 2 * rate, theta[7 + i])
    return (-(pole + slow), pole * slow, -(z1 + z2), z1 * z2), lines


@njit(cache=True)
def _at(case: _Case, theta: Floats, gain: float) -> _Point:
    """The innovations of the constants with a gain, or with the best one where it is NaN; the offset is the best."""
    lag = unit_lag(math.exp(theta[0]), theta[1] * case.dt_s, case.dt_s)
    noise, lines = _noise(theta, lag.pole, case)
    yw, xw = _whitened(case.y, case.stem, lag, noise, lines)
    y, x = yw[case.at], xw[case.at]
    y, x = y - y.mean(), x - x.mean()
    k = np.dot(x, y) / max(np.dot(x, x), 1e-300) if math.isnan(gain) else gain
    e = y - k * x
    return _Point(theta, e, k, np.dot(e, e) / e.size)


def _point(case: _Case, theta: Floats, gain: float | None = None) -> _Point:
    """The innovations of the constants, with gain and offset solved for, or with the given gain."""
    return _at(case, theta, math.nan if gain is None else gain)  # type: ignore[no-any-return]


@register_jitable  # type: ignore[untyped-decorator]
def _curved(case: _Case, p: _Point, taken: int) -> tuple[bool, Floats, Floats]:
    """The Gauss-Newton matrix and the gradient, from differences in each constant."""
    rows = np.empty((p.theta.size, p.e.size))
    for i in range(p.theta.size):
        moved = p.theta.copy()
        step = STEPS[i] if moved[i] + STEPS[i] <= case.ranges[1, i] else -STEPS[i]
        moved[i] += step
        rows[i] = (_at(case, moved, math.nan).e - p.e) / step
    return True, rows @ rows.T, -rows @ p.e


@register_jitable  # type: ignore[untyped-decorator]
def _stepped(case: _Case, p: _Point, step: Floats) -> _Point:
    short = step / max(np.max(np.abs(step) / LONGEST[: step.size]), 1.0)
    return _at(case, np.minimum(np.maximum(p.theta + short, case.ranges[0]), case.ranges[1]), math.nan)


@njit(cache=True)
def _down(case: _Case, begun: _Point, rule: Descent) -> _Point:
    """The end of a descent."""
    return down(case, begun, _curved, _stepped, rule)  # type: ignore[no-any-return]


def _judged(usable: Mask) -> NDArray[np.int64]:
    """Blocks that are judged: usable, with enough usable ones before for the noise model to forget a gap."""
    out = ~usable
    for k in range(1, FORGETS + 1):
        out[k:] |= ~usable[:-k]
    out[: 2 * FORGETS] = True
    return np.flatnonzero(~out)


def _case(problem: Problem, law: StemLaw, period_s: float, count: int) -> _Case:
    """The data of a model with so many constants."""
    stem = stem_of(problem.stems_in_blocks, law)
    (most_t, most_dead), dt_s = problem.bounds, problem.dt_s
    periods = problem.duration_s / period_s
    low = [math.log(0.1 * dt_s), 0.0, math.log(0.5 * dt_s), -1.5, -1.5]
    high = [math.log(most_t), most_dead / dt_s, math.log(1e3 * problem.duration_s), 3.0, 3.0]
    if count > LOAD:
        ratio, heights = math.log(LINE_AWAY), count - LINE + 1
        low += [-ratio, math.log(LINE_KEPT), *heights * [-1.0]]
        high += [ratio, math.log(10.0 * periods), *heights * [8.0]]
    ranges = np.array([low, high])
    return _Case(problem.centred, stem, _judged(problem.usable), dt_s, ranges, period_s)


def _descended(case: _Case, starts: Sequence[Floats]) -> _Point:
    """The most likely result of several starts: all take a few steps, the best of them descend to the end."""

    def continued(begun: _Point, steps: int) -> _Point:
        rule = Descent(steps, 2 * steps, case.at.size, SETTLED, 10.0, 5.0, steps)
        return _down(case, begun, rule)  # type: ignore[no-any-return]

    begun = (_point(case, np.clip(s, case.ranges[0], case.ranges[1])) for s in starts)
    near = sorted((continued(p, FIRST_STEPS) for p in begun), key=lambda p: p.loss)
    return min((continued(p, SMOOTH_STEPS) for p in near[:FOLLOWED]), key=lambda p: p.loss)


def _fit(problem: Problem, law: StemLaw, case: _Case, p: _Point) -> SmoothFit:
    line = None
    if p.theta.size > LOAD:
        line = Line(case.period_s / math.exp(p.theta[5]), math.exp(p.theta[6]))
    dead_s = float(p.theta[1]) * case.dt_s + problem.half_block_s
    process = Fopdt(p.gain, math.exp(p.theta[0]), dead_s)
    loss = max(p.loss, 1e-14)
    return SmoothFit(process, -nats(p.e.size, loss, 1.0), p.e.size, loss, p.theta, law, line)


def resonant_starts(problem: Problem, period_s: float, law_response: complex) -> list[tuple[Dynamics, float]]:
    """Time constant and dead time [s] of lags with which the controller would oscillate at a period [s], and their
    gains.

    law_response : the controller's response there [% OP / % PV]. The loop phase is -180 degrees with the gain margin
    MARGIN; empty where no dead time achieves this.
    """
    omega, found = 2.0 * math.pi / period_s, []
    sign = 1.0 if law_response.real >= 0.0 else -1.0
    phase = float(np.angle(sign * law_response))
    for t in LAGS * np.array(period_s):
        dead_s = (math.pi - math.atan(omega * t) + phase) / omega - problem.half_block_s
        if 0.0 <= dead_s <= problem.bounds[1] and t <= problem.bounds[0]:
            gain = sign * math.hypot(1.0, omega * t) / (abs(law_response) * MARGIN)
            found.append(((float(t), dead_s), gain))
    return found


def fit_smooth(
    problem: Problem,
    period_s: float,
    starts: Sequence[tuple[Dynamics, float | None]],
    law: StemLaw = IDEAL,
    like: SmoothFit | None = None,
) -> SmoothFit:
    """Fit the process under a smooth load, behind a valve.

    starts : time constant and dead time [s] at which the search begins, with the gain if known; like : a fit whose
    load is also a start. Raises ValueError without a start.
    """
    case = _case(problem, law, period_s, LOAD)
    loads = [like.theta[2:LOAD]] if like is not None else []
    loads += _loads(period_s)
    firsts = []
    for (t, dead_s), gain in starts:
        heads = [np.array([math.log(t), dead_s / case.dt_s, *load]) for load in loads]
        firsts.append(
            min((_point(case, np.clip(h, *case.ranges), gain) for h in heads), key=lambda p: p.loss)
        )
    return _fit(problem, law, case, _descended(case, [p.theta for p in firsts]))


def fit_line(
    problem: Problem,
    period_s: float,
    near: Sequence[SmoothFit],
    begins: Sequence[Dynamics] = (),
    law: StemLaw = IDEAL,
) -> SmoothFit:
    """Fit the process behind a valve under a load with a line near a period [s] and a smooth part.

    near : fits at which the search begins, and whose loads are starts; begins : further time
    constants and dead times [s] at which it begins. If the load has a line, a fit under a smooth load can give a
    process far from the true one.
    """
    case = _case(problem, law, period_s, LINE)
    lines = [np.array([0.0, math.log(kept), 2.0]) for kept in LINE_STARTS]
    starts = [fit.theta[:LINE] for fit in near if fit.line is not None]
    starts += [np.append(fit.theta[:LOAD], line) for fit in near for line in lines]
    loads = [*_loads(period_s), *(fit.theta[2:LOAD] for fit in near)]
    for t, dead_s in begins:
        head = np.array([math.log(t), dead_s / case.dt_s])
        tried = (np.concatenate((head, load, line)) for load in loads for line in lines)
        starts.append(min(tried, key=lambda x: _point(case, np.clip(x, *case.ranges)).loss))
    return _fit(problem, law, case, _descended(case, starts))


def _loads(period_s: float) -> list[Floats]:
    """Starts of the load's constants."""
    return [np.array([math.log(c * period_s), *z]) for c in CORNERS for z in ZEROS]


def with_harmonics(lined: SmoothFit, problem: Problem, period_s: float) -> SmoothFit:
    """The fit under a load with a line found at a period [s], fitted again under a load whose line also
    has harmonics."""
    count = LINE + len(HARMONICS)
    case = _case(problem, lined.law, period_s, count)
    starts = [np.append(lined.theta, len(HARMONICS) * [height]) for height in (-1.0, 2.0)]
    return _fit(problem, lined.law, case, _descended(case, starts))


def innovations_of(found: SmoothFit, problem: Problem, period_s: float) -> tuple[NDArray[np.int64], Floats]:
    """The blocks judged, shape (m,), and the innovations of a fit there [% of PV's span], found at a period [s]."""
    case = _case(problem, found.law, period_s, found.theta.size)
    return case.at, _point(case, found.theta).e


def as_fit(found: SmoothFit, problem: Problem) -> Fitted:
    """The result as a fit of the batch run, whose noise model has single lags: as many as reproduce the load to
    CUT."""
    dt_s, p = problem.dt_s, found.process
    pole, slow = math.exp(-dt_s / p.time_constant_s), math.exp(-dt_s / math.exp(found.theta[2]))
    z1, z2 = math.tanh(found.theta[3]), math.tanh(found.theta[4])
    longest = max(abs(z1), abs(z2), 1e-3)
    order = min(max(math.ceil(math.log(CUT) / math.log(longest)), AR_ORDER), MOST_LAGS)
    given, memory = np.zeros(order + 1), np.zeros(order + 1)
    given[:3] = 1.0, -(pole + slow), pole * slow
    for k in range(order + 1):
        before = (z1 + z2) * (memory[k - 1] if k else 0.0) - z1 * z2 * (memory[k - 2] if k > 1 else 0.0)
        memory[k] = given[k] + before
    dead_s = p.dead_time_s - problem.half_block_s
    fit = start_at(problem, p.gain, (p.time_constant_s, dead_s), found.law, -memory[1:])
    return replace(fit, loss=found.sigma2, count=found.count)
