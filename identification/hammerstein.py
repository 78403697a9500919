"""How well a valve fault followed by a lag explains PV from OP, judged by its innovations.

The model is y = c0 + c1 t + c2 decay + K x + noise with A(q) noise = innovation: the stem is a valve operator on
the recorded OP, x the response of a unit-gain lag with dead time, A an autoregression that makes the residual
white. An integrator is the lag whose time constant outlasts the window; then only gain over time constant is
known. Gain and the c are solved linearly, time constant and dead time are searched, the valve is scanned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from identification.innovations import arx_noise, judged_mask, notch, whiten
from identification.record import Floats, Mask
from identification.valve import RESTS, stem_step

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
    ignores, negative where the stem rests after each move.
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
    stem, moving, turned = op[0], 0.0, op[0]
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


def residual(window: Window, fit: Fit) -> Floats:
    """PV less the response to the stem [% PV], shape (n,): load and noise, with the model's slow terms in it."""
    x = lag(stem_of(window, fit.valve), *unit_lag(fit.time_constant_s, fit.dead_time_s, window.dt_s))
    return window.y - window.y.mean() - fit.gain * x


def disturbance(window: Window, fit: Fit) -> Floats:
    """PV less the whole model, slow terms included [% PV], shape (n,)."""
    n = window.y.size
    t = 2.0 * np.arange(n) / n - 1.0
    decay = np.exp(-np.arange(n) * window.dt_s / fit.time_constant_s)
    if fit.time_constant_s > 0.5 * window.duration_s:
        decay[:] = 0.0
    slow = fit.base[0] + fit.base[1] * t + fit.base[2] * decay + fit.base[3] * window.extra
    return residual(window, fit) - slow


OUTLIER = 4.0
"""Innovations count up to this many standard deviations [-]: beyond it one event (a step of the load, a spike), not
the valve's repeated motion, would decide; ours: it leaves 0.006 % of Gaussian innovations cut."""


def innovations(window: Window, fit: Fit) -> Floats:
    """Innovations of a fit at the samples judged [% PV]."""
    white = whiten(np.ascontiguousarray(disturbance(window, fit)), fit.ar)
    return white[judged_mask(window.usable, fit.ar.size)]


@dataclass(frozen=True, slots=True)
class Rival:
    """A fit and the window that it is of (which may hold a step of the load)."""

    window: Window
    fit: Fit


def evidence(ours: Rival, theirs: Rival) -> float:
    """Gain in log likelihood [nat] of one fit over another, no innovation counting for more than OUTLIER.

    The scale is the median absolute innovation of the first over 0.6745, which outliers leave alone.
    """
    mine, other = innovations(ours.window, ours.fit), innovations(theirs.window, theirs.fit)
    scale = float(np.median(np.abs(mine))) / 0.6745
    if scale <= 0:
        return 0.0
    top = (OUTLIER * scale) ** 2
    gained = np.minimum(other**2, top).sum() - np.minimum(mine**2, top).sum()
    return float(gained) / (2 * scale**2)


STEP_PRICE = 6.0
"""Gain in log likelihood [nat] that one step of the load at any time costs: log of the blocks, nearly."""


def stem_moves(window: Window, valve: ValveTrial) -> int:
    """How often the stem of a valve sets out or turns: stretches of motion in one direction with rest between."""
    moved = np.sign(np.diff(stem_of(window, valve)))
    set_out = np.concatenate(([0.0], moved))
    return int(((set_out[1:] != set_out[:-1]) & (set_out[1:] != 0)).sum())


def with_load_step(window: Window, fit: Fit, answering: Mask, noise: Floats) -> Rival:
    """The plain process with one step of the load where its largest innovation is, if that is worth its price.

    A single slip of a stem and a single step of the load look alike; only the slip that also explains why the
    stem stood still before is evidence of the valve. Where PV is due to answer a set point move (`answering`,
    bool, shape (n,)) its step is no load: a load does not wait for the operator. `noise` is the noise model of
    the rival, shape (p,), a second start: one fitted across the step is nearly an integrator.
    """
    judged = judged_mask(window.usable, fit.ar.size)
    white = np.where(answering[judged], 0.0, np.abs(innovations(window, fit)))
    if white.size < 50:
        return Rival(window, fit)
    at = int(np.flatnonzero(judged)[int(np.argmax(white))])
    stepped = replace(window, step_at=at)
    trial = max(
        (descend(stepped, start) for start in (fit, replace(fit, ar=noise))), key=lambda f: f.log_likelihood
    )
    if trial.log_likelihood - fit.log_likelihood > STEP_PRICE:
        return Rival(stepped, trial)
    return Rival(window, fit)


def starts(window: Window, period_s: float) -> list[Dynamics]:
    """Starts of the search: time constants and dead times spread over the period [s]."""
    times = [period_s * s for s in (0.03, 0.12, 0.5, 2.5)]
    deads = [period_s * s for s in (0.0, 0.06, 0.15, 0.33)]
    most_t, most_dead = window.bounds
    return sorted({(min(t, 0.7 * most_t), min(d, most_dead)) for t in times for d in deads})


ITERATIONS = 25
"""Gauss-Newton steps at most; ours: nine in ten fits stop before the fifteenth."""
SETTLED = 0.01
"""Gain in log likelihood [nat] below which the steps stop."""


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
) -> tuple[Floats, Floats]:
    """Innovations, shape (n,), and their derivatives, shape (n, 8 + order), at theta = log T, L, width, K, 1, t,
    decay, step, A; the derivative by the width is that of the given wider stem."""
    n = y.size
    t_s, dead = math.exp(theta[0]), theta[1]
    pole, now, before, delay = unit_lag(t_s, dead, dt)
    x = lag(stem, pole, now, before, delay)
    pole2, now2, before2, delay2 = unit_lag(t_s * 1.01, dead, dt)
    x_t = (lag(stem, pole2, now2, before2, delay2) - x) / math.log(1.01)
    step = 0.05 * dt
    pole3, now3, before3, delay3 = unit_lag(t_s, dead + step, dt)
    x_l = (lag(stem, pole3, now3, before3, delay3) - x) / step
    x_w = (lag(wider, pole, now, before, delay) - x) / width_step if width_step > 0 else np.zeros(n)
    columns = np.zeros((n, 8 + order))
    r = np.empty(n)
    free = 1.0
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
        free *= pole
    e = whiten(r, theta[8:])
    for j in range(8):
        columns[:, j] = whiten(columns[:, j].copy(), theta[8:])
    for k in range(order, n):
        for i in range(order):
            columns[k, 8 + i] = r[k - 1 - i]
    return e, columns


def _steps(gram: Floats, slope: Floats, damping: float, frozen: list[int]) -> Floats:
    """A damped Gauss-Newton step; frozen parameters stay."""
    scale = np.diag(gram) + 1e-12 * np.trace(gram) + 1e-300
    damped = gram + damping * np.diag(scale)
    for j in frozen:
        damped[j, :], damped[:, j], damped[j, j] = 0.0, 0.0, 1.0
        slope = slope.copy()
        slope[j] = 0.0
    return np.linalg.lstsq(damped / np.sqrt(np.outer(scale, scale)), slope / np.sqrt(scale), rcond=1e-12)[
        0
    ] / np.sqrt(scale)


@dataclass(frozen=True, slots=True)
class _Trial:
    """One point of the Gauss-Newton descent."""

    theta: Floats
    valve: ValveTrial
    loss: float
    count: int
    gram: Floats
    slope: Floats


def _trial(window: Window, y: Floats, theta: Floats, valve: ValveTrial, free_width: bool) -> _Trial:
    order = theta.size - 8
    stem = stem_of(window, valve)
    step = 0.01 * valve.stickband if free_width else 0.0
    wider = stem_of(window, _widened(valve, step)) if free_width else stem
    e, columns = _sensitivities(y, stem, wider, window.extra, step, theta, order, window.dt_s)
    e, columns = e[order:], columns[order:]
    if not window.usable.all():
        judged = judged_mask(window.usable, order)[order:]
        e, columns = e[judged], columns[judged]
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
    theta[1] = min(max(theta[1], 0.0), most_dead)
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
    """Covariance of (log T, L, stickband, gain) from the curvature at a fit, shape (4, 4).

    The inverse of the Gauss-Newton matrix times the innovations variance (Ljung 1999, eq. 9.31), the noise model's
    and the slow terms' share in it; zero for what was held.
    """
    trial = _trial(window, window.y - window.y.mean(), _theta(fit), fit.valve, free_width)
    held = _held(window, free_width)
    free = np.array([j for j in range(trial.gram.shape[0]) if j not in held and trial.gram[j, j] > 0])
    scale = np.sqrt(np.diag(trial.gram)[free])
    inside = np.linalg.pinv(trial.gram[np.ix_(free, free)] / np.outer(scale, scale), rcond=1e-10)
    out = np.zeros_like(trial.gram)
    out[np.ix_(free, free)] = trial.loss * inside / np.outer(scale, scale)
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


def begin(prepared: Prepared, dynamics: Dynamics) -> Fit:
    """The fit at given dynamics under a given noise model, a start for the descent."""
    sigma2, count, beta = prepared.score(*dynamics)
    t, dead = dynamics
    base = np.array([beta[1], beta[2], 0.0, 0.0])
    return Fit(float(beta[0]), t, dead, prepared.valve, float(sigma2), int(count), prepared.ar, base)


def fit_linear(window: Window, period_s: float) -> Fit:
    """The process behind an ideal valve.

    Parameters
    ----------
    window : Window
    period_s : float
        Period of the oscillation, or other scale of the loop [s], about which the search begins.
    """
    stem = stem_of(window, IDEAL)
    ar = arx_noise(window.y - window.y.mean(), stem, window.usable, AR_ORDER, INPUT_LAGS)
    prepared = prepare(window, IDEAL, ar)
    return descend(window, begin(prepared, search(prepared, starts(window, period_s))))


SCREEN_SHARES = (0.1, 0.3, 0.55, 0.8)
"""Stickbands that a loop without an evident fault is screened with, as shares of OP's range; ours: a play of any
width between is seen by the nearest of them."""
SCREENED = 3.0
"""Gain in log likelihood [nat] from which the screening is followed by the whole search; ours: a third of what a
verdict needs."""
STICKBAND_SHARES = (0.06, 0.12, 0.2, 0.3, 0.42, 0.55, 0.7, 0.85, 1.0)
"""Stickbands tried first, as shares of OP's range; a valve much wider than OP's range would not move at all."""
JUMP_SHARES = (0.2, 0.4, 0.7, 1.0)
"""Slip jumps tried, as shares of the stickband."""
COAST_SHARES = (0.0, 0.15)
"""Turnings of OP that a sliding stem ignores, as shares of the stickband: none, and OP's noise; ours."""
WORK = 5000
"""Blocks that candidates of a scan may take together; short records can afford to follow more of them."""
FOLLOWED = 2
"""Candidates of a scan that are followed to the end; ours: the best of the scan is among its first two."""


GENERIC = -0.95
"""First coefficient of a noise model that knows nothing: nearly a difference. A noise model that was fitted with
another valve takes that valve's side, so candidates are ranked by both."""


def _ranked(window: Window, ar: Floats, valves: list[ValveTrial], begins: list[Dynamics]) -> list[Fit]:
    """Valves with dynamics searched anew under one noise model, best first."""
    trials = []
    for valve in valves:
        prepared = prepare(window, valve, ar)
        trials.append(begin(prepared, search(prepared, begins, 2)))
    return sorted(trials, key=lambda fit: fit.sigma2)


def _scan(window: Window, near: Fit, valves: list[ValveTrial], period_s: float, followed: int) -> Fit:
    """Valves tried under two noise models; the best few of each followed to the end, the best returned."""
    begins = [(near.time_constant_s, near.dead_time_s), *starts(window, period_s)]
    followed = max(followed, WORK // window.y.size)
    generic = np.zeros(near.ar.size)
    generic[0] = GENERIC
    chosen = [fit for ar in (generic, near.ar) for fit in _ranked(window, ar, valves, begins)[:followed]]
    return max((descend(window, fit, free_width=True) for fit in chosen), key=lambda fit: fit.log_likelihood)


def fit_play(window: Window, linear: Fit, period_s: float) -> Fit:
    """The best play followed by a lag: a quick screening, and the whole search where it finds anything.

    Parameters
    ----------
    window : Window
    linear : Fit
        The best fit behind an ideal valve.
    period_s : float
        Scale of the search [s].
    """
    reach = max(window.op_range, 1e-9)
    best = _scan(window, linear, [sticking(share * reach, 0.0) for share in SCREEN_SHARES], period_s, 1)
    if best.log_likelihood - linear.log_likelihood < SCREENED:
        return best
    shares = (*STICKBAND_SHARES, best.valve.stickband / reach)
    found = _scan(window, best, [sticking(share * reach, 0.0) for share in shares], period_s, FOLLOWED)
    return max(best, found, key=lambda fit: fit.log_likelihood)


def better_linear(window: Window, linear: Fit, play: Fit) -> Fit:
    """The better of the plain fit and one followed from the dynamics that were found behind a play.

    The plain process is the play of no width; found from there it is never unfairly behind.
    """
    trial = descend(window, replace(play, valve=IDEAL))
    return max(linear, trial, key=lambda fit: fit.log_likelihood)


def fit_stick_slip(window: Window, play: Fit, period_s: float) -> Fit:
    """The best stick-slip (J > 0, sliding after a jump) followed by a lag, scanned whole and about the play."""
    reach = max(window.op_range, 1e-9)
    near = play.valve.stickband / reach
    widths = {round(s, 4) for s in STICKBAND_SHARES[4:]} | {near, 1.1 * near}
    valves = [
        sticking(width * reach, jump, coast * width * reach)
        for width in sorted(widths)
        for jump in JUMP_SHARES
        for coast in COAST_SHARES
    ]
    near_play = [
        descend(
            window, replace(play, valve=sticking(grown * play.valve.stickband, jump, coast)), free_width=True
        )
        for jump, grown in ((0.15, 1.0), (0.4, 1.1), (0.8, 1.1))
        for coast in (0.0, 0.15 * play.valve.stickband)
    ]
    whole = _scan(window, play, valves, period_s, FOLLOWED)
    return max([*near_play, whole], key=lambda fit: fit.log_likelihood)
