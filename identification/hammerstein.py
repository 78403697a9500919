"""How well a valve fault followed by a lag explains PV from OP, judged by its innovations.

The model is y = c0 + c1 t + c2 decay + K x + noise with A(q) noise = innovation: the stem is a valve operator on
the recorded OP, x the response of a unit-gain lag with dead time, A an autoregression that makes the residual
white. An integrator is the lag whose time constant outlasts the window; then only gain over time constant is
known. Gain and the c are solved linearly, time constant and dead time are searched, the valve is scanned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identification.innovations import judged_mask, notch, whiten
from identification.models import Fopdt
from identification.record import Floats, Mask
from identification.valve import RESTS, first_slip, stem_step, walk

AR_ORDER = 8
"""Order of the noise model; ours: on the simulated plants 12 gives innovations less than 1 % smaller."""
INPUT_LAGS = 10
"""Lags of OP in the unstructured model that gives the first noise model; ours, as AR_ORDER."""
NOTCH_WIDTH = 0.15
"""Width of the band that is left out when the process is wanted in spite of a load with a line; ours."""
LONGEST_DEAD_TIME = 0.25
"""Largest dead time searched, as a share of the window; ours: beyond it the window holds under four of them."""
LONGEST_TIME_CONSTANT = 3.0
"""Largest time constant searched, in windows; beyond it a lag and an integrator are one (PHYSICS: integrator)."""


@dataclass(frozen=True, slots=True)
class Window:
    """A stretch of a record prepared for fitting.

    y : PV [% PV] in blocks, shape (n,); op : OP [% OP] at the record's own interval, shape (n * factor,);
    usable : bool, shape (n,), False at gaps; dt_s : interval of the blocks [s]; most_time_constant_s and
    most_dead_time_s : what is known of such processes [s], inf where nothing is; step_at : block at which the
    load steps, 0 where it does not.
    """

    y: Floats
    op: Floats
    usable: Mask
    dt_s: float
    factor: int = 1
    most_time_constant_s: float = math.inf
    most_dead_time_s: float = math.inf
    step_at: int = 0

    @property
    def extra(self) -> Floats:
        """A further regressor, shape (n,): a step of the load at block `step_at`; zero where that is 0."""
        out = np.zeros(self.y.size)
        if self.step_at > 0:
            out[self.step_at :] = 1.0
        return out

    @property
    def bounds(self) -> tuple[float, float]:
        """Largest time constant and dead time that are searched [s]."""
        longest = LONGEST_TIME_CONSTANT * self.duration_s, LONGEST_DEAD_TIME * self.duration_s
        known = self.most_time_constant_s, self.most_dead_time_s
        return max(min(longest[0], known[0]), self.dt_s), max(min(longest[1], known[1]), 2 * self.dt_s)

    @property
    def duration_s(self) -> float:
        """Length of the window [s]."""
        return self.y.size * self.dt_s

    @property
    def half_block_s(self) -> float:
        """What is missing from a fitted dead time [s]: the mean of a block of PV stands later than its first sample,
        from which the search, whose model knows blocks alone, counts."""
        return 0.5 * (self.factor - 1) * self.dt_s / self.factor

    @property
    def op_range(self) -> float:
        """Range of OP without its 2 % tails [% OP]."""
        low, high = np.quantile(self.op, [0.02, 0.98])
        return float(high - low)


def block_means(x: Floats, factor: int) -> Floats:
    """Means of consecutive blocks, shape (n // factor,)."""
    n = x.size // factor
    return x[: n * factor].reshape(n, factor).mean(axis=1)


@dataclass(frozen=True, slots=True)
class ValveTrial:
    """Valve constants in the form the kernels use.

    breakaway, sliding [% OP]: (S + J)/2 and (S - J)/2; tolerance [% OP]: OP's turning that a sliding stem
    ignores, or HALTS or RESTS (valve.py).
    """

    breakaway: float = 0.0
    sliding: float = 0.0
    tolerance: float = RESTS

    @property
    def stickband(self) -> float:
        """S [% OP]; the width of the play where slip_jump is 0."""
        return self.breakaway + self.sliding

    @property
    def slip_jump(self) -> float:
        """J [% OP]."""
        return self.breakaway - self.sliding

    @property
    def slides(self) -> bool:
        """Whether the stem follows OP after a jump."""
        return self.tolerance > RESTS


IDEAL = ValveTrial()


def sticking(stickband: float, jump_share: float, tolerance: float = RESTS) -> ValveTrial:
    """Valve of stickband S [% OP] and slip jump J = jump_share S."""
    return ValveTrial(0.5 * stickband * (1 + jump_share), 0.5 * stickband * (1 - jump_share), tolerance)


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted model.

    gain [% PV/% OP], time_constant_s and dead_time_s [s], valve, sigma2 the innovations variance
    [% PV squared], count the samples judged, ar the noise polynomial without its leading one, shape (p,), base
    the coefficients of 1, t, decay and the load's step, shape (4,).
    """

    gain: float
    time_constant_s: float
    dead_time_s: float
    valve: ValveTrial
    sigma2: float
    count: int
    ar: Floats
    base: Floats

    @property
    def log_likelihood(self) -> float:
        """Gaussian log likelihood of the innovations, up to a constant."""
        return -0.5 * self.count * math.log(self.sigma2)

    @property
    def slope(self) -> float:
        """Gain over time constant [% PV / (% OP s)]."""
        return self.gain / self.time_constant_s


@njit(cache=True)
def stem_blocks(op: Floats, breakaway: float, sliding: float, tolerance: float, factor: int) -> Floats:
    """Stem behind OP as means of blocks, shape (n // factor,); breakaway 0 is an ideal valve."""
    n = op.size // factor
    out = np.empty(n)
    stem, moving, turned = first_slip(op, breakaway, sliding), 0.0, op[0]
    for k in range(n):
        total = 0.0
        for i in range(k * factor, (k + 1) * factor):
            if breakaway > 0.0:
                stem, moving, turned = stem_step(stem, moving, turned, op[i], breakaway, sliding, tolerance)
            else:
                stem = op[i]
            total += stem
        out[k] = total / factor
    return out


@njit(cache=True)
def lag(stem: Floats, pole: float, now: float, before: float, delay: int) -> Floats:
    """Unit-gain response at rest at first, shape (n,)."""
    n = stem.size
    out = np.empty(n)
    y = 0.0
    for k in range(n):
        out[k] = y
        y = pole * y + now * stem[max(k - delay, 0)] + before * stem[max(k - delay - 1, 0)]
    return out


@njit(cache=True)
def lag_blocks(stem: Floats, pole: float, now: float, before: float, delay: int, factor: int) -> Floats:
    """The same as means of blocks of the stem's own samples, shape (n // factor,)."""
    n = stem.size // factor
    out = np.empty(n)
    y, k = 0.0, 0
    for block in range(n):
        total = 0.0
        for _ in range(factor):
            total += y
            y = pole * y + now * stem[max(k - delay, 0)] + before * stem[max(k - delay - 1, 0)]
            k += 1
        out[block] = total / factor
    return out


@njit(cache=True)
def unit_lag(time_constant_s: float, dead_time_s: float, dt_s: float) -> tuple[float, float, float, int]:
    """Exact zero-order hold of a unit-gain lag with fractional dead time: pole, now, before, delay."""
    steps = dead_time_s / dt_s
    delay = int(steps)
    fraction = steps - delay
    pole = math.exp(-dt_s / time_constant_s)
    rest = math.exp(-dt_s * (1 - fraction) / time_constant_s)
    return pole, 1 - rest, rest - pole, delay


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
    for i in range(4):
        gram[i, i] = gram[i, i] * (1 + 1e-9) + 1e-12
        for j in range(i):
            gram[i, j] = gram[j, i]
    beta = np.linalg.solve(gram, cross)
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
        return max(1.0 + float(self.ar.sum()), 1e-6)

    def score(self, time_constant_s: float, dead_time_s: float) -> tuple[float, int, Floats]:
        """Innovations variance, count and coefficients for a time constant and a dead time [s]."""
        args = (self.white_y, self.white_stem, self.judged, self.level, self.first)
        sigma2, count, beta = score(*args, time_constant_s, dead_time_s, self.window.dt_s)
        return float(sigma2), int(count), np.asarray(beta, dtype=np.float64)


def _filtered(x: Floats, ar: Floats, notch_period: float) -> Floats:
    white = whiten(np.ascontiguousarray(x), ar)
    return white if notch_period <= 0 else notch(white, notch_period, NOTCH_WIDTH)


def stem_of(window: Window, valve: ValveTrial) -> Floats:
    """Stem in blocks less its mean [% OP], shape (n,)."""
    if valve.breakaway <= 0.0:
        stem = block_means(window.op, window.factor)
    else:
        stem = stem_blocks(window.op, valve.breakaway, valve.sliding, valve.tolerance, window.factor)
    return stem - stem.mean()


def prepare(window: Window, valve: ValveTrial, ar: Floats, notch_period: float = 0.0) -> Prepared:
    """Whiten PV and the stem with one noise model; notch_period in blocks, 0: none."""
    return Prepared(
        window,
        valve,
        ar,
        _filtered(window.y - window.y.mean(), ar, notch_period),
        _filtered(stem_of(window, valve), ar, notch_period),
        judged_mask(window.usable, ar.size),
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
    level = max(1.0 + ar.sum(), 1e-6)
    out = np.empty(pairs.shape[0])
    for i in range(pairs.shape[0]):
        width, share = pairs[i, 0], pairs[i, 1]
        stem = stem_blocks(op, 0.5 * width * (1 + share), 0.5 * width * (1 - share), tolerance, factor)
        white = whiten(stem - stem.mean(), ar)
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
    white_y = whiten(np.ascontiguousarray(window.y - window.y.mean()), ar)
    judged = judged_mask(window.usable, ar.size)
    table = np.array(begins)
    return _scan(window.op, white_y, judged, ar, window.dt_s, window.factor, pairs, tolerance, table)  # type: ignore[no-any-return]


def fine_stem(window: Window, valve: ValveTrial) -> Floats:
    """Stem at the record's own interval less its mean [% OP], shape (n * factor,)."""
    if valve.breakaway <= 0.0:
        return window.op - window.op.mean()
    start = first_slip(window.op, valve.breakaway, valve.sliding)
    stem = walk(window.op, valve.breakaway, valve.sliding, valve.tolerance, start)
    return np.asarray(stem - stem.mean(), dtype=np.float64)


def residual(window: Window, fit: Fit) -> Floats:
    """PV less the response to the stem [% PV], shape (n,): load and noise, with the model's slow terms in it.

    The response is stepped at the record's own interval and then averaged over the blocks, as PV was.
    """
    fine = window.dt_s / window.factor
    steps = unit_lag(fit.time_constant_s, fit.dead_time_s + window.half_block_s, fine)
    x = lag_blocks(fine_stem(window, fit.valve), *steps, window.factor)
    return window.y - window.y.mean() - fit.gain * x


def process_of(window: Window, fit: Fit) -> Fopdt:
    """The process of a fit, its dead time in the record's own samples."""
    return Fopdt(fit.gain, fit.time_constant_s, fit.dead_time_s + window.half_block_s)


def disturbance(window: Window, fit: Fit) -> Floats:
    """PV less the whole model, slow terms included [% PV], shape (n,)."""
    n = window.y.size
    t = 2.0 * np.arange(n) / n - 1.0
    decay = np.exp(-np.arange(n) * window.dt_s / fit.time_constant_s)
    if fit.time_constant_s > 0.5 * window.duration_s:
        decay[:] = 0.0
    slow = fit.base[0] + fit.base[1] * t + fit.base[2] * decay + fit.base[3] * window.extra
    return residual(window, fit) - slow


def starts(window: Window, period_s: float) -> list[Dynamics]:
    """Starts of the search: time constants and dead times spread over the period [s]."""
    times = [period_s * s for s in (0.03, 0.12, 0.5, 2.5)]
    deads = [period_s * s for s in (0.0, 0.06, 0.15, 0.33)]
    most_t, most_dead = window.bounds
    return sorted({(min(t, 0.7 * most_t), min(d, most_dead)) for t in times for d in deads})
