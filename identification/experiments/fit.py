"""One experiment fitted over its whole answer: times and play by least squares, gains, bias and drift by projection.

Each candidate is judged by its likelihood on noise that wanders (wander.py), and the one with the least Bayesian
information criterion stands (Schwarz 1978).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from identification.experiments.columns import Kind, Trial, answers, stem_of
from identification.experiments.wander import Wander, log_likelihood, wander_of, whitened
from identification.limits import EXPERIMENTS
from identification.record import Floats, Mask
from identification.simulation.lag import respond, unit_lag

TIMES = {Kind.NO_ANSWER: 0, Kind.LAG: 1, Kind.TWO_LAGS: 2, Kind.INVERSE: 2, Kind.INTEGRATOR: 0}
"""Lags of each kind."""
ALIKE = {Kind.LAG: (Kind.TWO_LAGS,), Kind.TWO_LAGS: (Kind.LAG,)}
"""Kinds that one experiment may not tell apart."""


@dataclass(frozen=True, slots=True)
class Shape:
    """Which terms a candidate has: its kind, whether PV drifts, begins away from rest, play, and which neighbours
    (by their places)."""

    kind: Kind
    drift: bool = False
    start: bool = False
    play: bool = False
    beside: tuple[int, ...] = ()

    @property
    def is_ramp(self) -> bool:
        """Whether the process integrates; a drift is then OP's balance as well."""
        return self.kind is Kind.INTEGRATOR

    @property
    def answers(self) -> int:
        """Columns of the process's answer."""
        return {Kind.NO_ANSWER: 0, Kind.INVERSE: 2}.get(self.kind, 1)

    @property
    def times(self) -> int:
        """Times that are searched for: lags, dead time, play with its first slack, a neighbour's lag each."""
        own = 0 if self.kind is Kind.NO_ANSWER else TIMES[self.kind] + 1
        return own + 2 * self.play + len(self.beside)

    @property
    def constants(self) -> int:
        """All constants, the noise's left out."""
        return self.times + self.answers + 1 + self.drift + self.start + len(self.beside)


@dataclass(frozen=True, slots=True)
class Fitted:
    """A candidate at its optimum.

    times : logs of lags [s], dead time [s], log of play and slack as a share of it, logs of neighbours' lags;
    linear : coefficients of the columns; log_likelihood [nat]; variance of the white noise [% PV squared]; wander of
    the load.
    """

    shape: Shape
    trial: Trial = field(repr=False)
    times: Floats
    linear: Floats
    log_likelihood: float
    variance: float
    wander: Wander

    @property
    def score(self) -> float:
        """Log likelihood [nat] less what its constants cost by Akaike, and what its kind is rarer than others."""
        rare = EXPERIMENTS.rare if self.shape.kind is Kind.INVERSE else 0.0
        return self.log_likelihood - self.shape.constants - rare

    @property
    def criterion(self) -> float:
        """Bayesian information criterion, half of it [nat]: the less the better."""
        return (
            0.5 * self.shape.constants * math.log(max(int(self.trial.usable.sum()), 3)) - self.log_likelihood
        )

    @property
    def lags_s(self) -> tuple[float, ...]:
        """Lags [s], the longest first."""
        return tuple(sorted(np.exp(self.times[: TIMES[self.shape.kind]]).tolist(), reverse=True))

    @property
    def dead_s(self) -> float:
        """Dead time [s]."""
        kind = self.shape.kind
        dead_s = 0.0 if kind is Kind.NO_ANSWER else float(self.times[TIMES[kind]])
        return dead_s if dead_s > 1e-3 * self.trial.dt_s else 0.0

    @property
    def gain(self) -> float:
        """Gain [% PV/% OP], of an integrator its slope [% PV/(% OP s)]; 0 without an answer."""
        return float(self.linear[0]) if self.shape.answers else 0.0

    @property
    def simulated(self) -> Floats:
        """PV as the model has it [% PV], drift and neighbours included, shape (n,)."""
        return columns(self.trial, self.shape, self.times) @ self.linear


def columns(trial: Trial, shape: Shape, times: Floats) -> Floats:
    """The columns that a candidate's PV is made of, shape (n, m)."""
    own = TIMES[shape.kind]
    lags = tuple(np.exp(times[:own]))
    out = []
    if shape.answers:
        at = own + 1
        stem = trial.op
        if shape.play:
            width = math.exp(times[at])
            stem = stem_of(trial.op, width, float(np.clip(times[at + 1], 0.0, 1.0)) * width)
        ordered = tuple(sorted(lags, reverse=True))
        out += answers(shape.kind, stem, trial, ordered, float(times[own]))
    one = np.linspace(-1.0, 1.0, trial.pv.size)
    out.append(np.ones(trial.pv.size))
    if shape.drift:
        out.append(one)
    if shape.start:
        begun = np.ones(trial.op.size)
        begun[0] = 0.0  # OP before the record was another, at which PV was at rest
        out.append(answers(shape.kind, begun, trial, ordered, float(times[own]))[0])
    for place, log_lag in zip(shape.beside, times[times.size - len(shape.beside) :], strict=True):
        op = trial.beside[place]
        out.append(respond(op - op[0], unit_lag(math.exp(log_lag), 0.0, trial.dt_s), trial.factor))
    return np.column_stack(out)


def projected(trial: Trial, shape: Shape, times: Floats, noise: Wander) -> tuple[Floats, Floats, float]:
    """What candidates leave of PV made white, shape (n,), the columns' coefficients, and the logs of variances."""
    x = np.column_stack([columns(trial, shape, times), trial.pv])
    white, logs = whitened(np.ascontiguousarray(x), trial.usable, noise.phi, noise.ratio)
    design, y = white[:, :-1], white[:, -1]
    size = np.sqrt((design**2).sum(axis=0)) + 1e-12
    gram = (design / size).T @ (design / size)
    gram[np.diag_indices_from(gram)] += 1e-9
    linear = np.linalg.solve(gram, (design / size).T @ y) / size
    return y - design @ linear, linear, logs


def bounds_of(trial: Trial, shape: Shape) -> tuple[Floats, Floats]:
    """Least and greatest times, shape (m,) each."""
    long, own = trial.duration_s, TIMES[shape.kind]
    short = 0.5 * trial.block_s if own > 1 else 0.1 * trial.dt_s
    low = [math.log(short)] * own
    high = [math.log(EXPERIMENTS.longest_lag * long)] * own
    if shape.answers:
        low, high = [*low, 0.0], [*high, 0.5 * long]
    if shape.play:
        travel = float(np.ptp(trial.op))
        low, high = [*low, math.log(1e-3 * travel), 0.0], [*high, math.log(0.9 * travel), 1.0]
    low += [math.log(trial.dt_s)] * len(shape.beside)
    high += [math.log(long)] * len(shape.beside)
    return np.array(low), np.array(high)


def descended(trial: Trial, shape: Shape, start: Floats, noise: Wander, late: bool = True) -> Fitted:
    """A candidate at its optimum from a start, under a noise; late, whether its dead time is searched for too."""
    low, high = bounds_of(trial, shape)
    times = np.clip(start, low + 1e-9 * (high - low), high - 1e-9 * (high - low))
    free, scale = np.ones(times.size, dtype=bool), np.ones(times.size)
    if shape.answers:
        free[TIMES[shape.kind]] = late
        scale[TIMES[shape.kind]] = max(0.2 * times[TIMES[shape.kind]], trial.dt_s)

    def left(t: Floats) -> Floats:
        return projected(trial, shape, placed(times, free, t), noise)[0]

    if free.any():
        found = least_squares(
            left,
            times[free],
            bounds=(low[free], high[free]),
            x_scale=scale[free],
            diff_step=1e-4,
            max_nfev=EXPERIMENTS.steps,
        )
        times = placed(times, free, found.x)
    e, linear, logs = projected(trial, shape, times, noise)
    squares, count = float((e**2).sum()), int(trial.usable.sum())
    return Fitted(shape, trial, times, linear, log_likelihood(squares, logs, count), squares / count, noise)


def placed(all_times: Floats, free: Mask, found: Floats) -> Floats:
    """Times with those that were searched for in their places."""
    out = all_times.copy()
    out[free] = found
    return out


def settled(fit: Fitted) -> Fitted:
    """A fit and its noise brought in line with one another."""
    for _ in range(EXPERIMENTS.noise_passes):
        noise = wander_of(fit.trial.pv - fit.simulated, fit.trial.usable)
        again = descended(fit.trial, fit.shape, fit.times, noise)
        if again.log_likelihood <= fit.log_likelihood + 0.01 and noise == fit.wander:
            break
        fit = again
    return fit


def screened(trial: Trial, noise: Wander) -> list[Floats]:
    """Times (log lag, dead time) at which a lag with dead time leaves least, each of another scale; best first."""
    shape = Shape(Kind.LAG, drift=True)
    lags = np.geomspace(max(trial.block_s, 2e-3 * trial.duration_s), trial.duration_s, EXPERIMENTS.screened)
    found = []
    for lag in lags:
        tried = [np.array([math.log(lag), share * lag]) for share in EXPERIMENTS.dead_shares]
        tried = [t for t in tried if t[1] < 0.5 * trial.duration_s]
        left = [float((projected(trial, shape, t, noise)[0] ** 2).sum()) for t in tried]
        found.append((min(left), tried[int(np.argmin(left))]))
    found.sort(key=lambda x: x[0])
    return [times for _, times in found[: EXPERIMENTS.starts]]


def starts_of(kind: Kind, lag: Fitted) -> list[Floats]:
    """Where the search for a kind begins, from the lag with dead time that was found."""
    log_t, dead = float(lag.times[0]), lag.dead_s
    if kind is Kind.INTEGRATOR:
        return [np.array([dead]), np.array([dead + 0.1 * math.exp(log_t)])]
    return [
        np.array([log_t + math.log(a), log_t + math.log(b), c * dead]) for a, b, c in EXPERIMENTS.two_lags
    ]


def best_of(trial: Trial, shape: Shape, starts: list[Floats], noise: Wander) -> Fitted:
    """The likeliest of a shape's optima, its noise settled."""
    return settled(max((descended(trial, shape, s, noise) for s in starts), key=lambda f: f.log_likelihood))


def with_term(fit: Fitted, shape: Shape, more: list[float]) -> Fitted:
    """A fit of a shape with one term more, from where the fit is."""
    at = fit.times.size - len(fit.shape.beside)
    own = np.insert(fit.times, [at] * len(more), more) if not shape.beside else np.append(fit.times, more)
    return best_of(fit.trial, shape, [own], fit.wander)


def candidates(trial: Trial) -> tuple[list[Fitted], Fitted]:
    """All candidates that answer, the one with the least criterion first, and the best without an answer."""
    still = min((_still(trial, drift) for drift in (False, True)), key=lambda f: f.criterion)
    white = Wander()
    tried = (descended(trial, Shape(Kind.LAG, drift=True), s, white) for s in screened(trial, white))
    plain = settled(max(tried, key=lambda f: f.log_likelihood))
    found = [plain, _less_drift(plain)]
    for kind in (Kind.TWO_LAGS, Kind.INTEGRATOR, Kind.INVERSE):
        shape = Shape(kind, drift=True)
        richer = best_of(trial, shape, starts_of(kind, plain), plain.wander)
        found += [richer, _less_drift(richer)]
    found = sorted(filter(_makes_sense, found), key=lambda f: f.criterion)
    return sorted([*found, *_with_more(found)], key=lambda f: f.criterion), still


def _still(trial: Trial, drift: bool) -> Fitted:
    return settled(descended(trial, Shape(Kind.NO_ANSWER, drift=drift), np.zeros(0), Wander()))


def _less_drift(fit: Fitted) -> Fitted:
    """The same shape without drift."""
    return best_of(fit.trial, replace(fit.shape, drift=False), [fit.times], fit.wander)


def _makes_sense(fit: Fitted) -> bool:
    """Whether an inverse response begins the other way, for one that leads is none, and no lag is so long that it is
    an integrator."""
    led = fit.shape.kind is Kind.INVERSE and fit.linear[0] * fit.linear[1] >= 0.0
    return not led and max(fit.lags_s, default=0.0) < EXPERIMENTS.ramp_from * fit.trial.duration_s


def _with_more(found: list[Fitted]) -> list[Fitted]:
    """The best candidates, and the best of each kind that may be taken for theirs, with more: a start away from rest,
    play where OP reverses, and of neighbours what lowers the criterion."""
    best, more = found[0], []
    alike = {f.shape.kind: f for f in reversed(found) if f.shape.kind in ALIKE.get(best.shape.kind, ())}
    bases = [best, *(f for f in alike.values() if f is not best)]
    if not best.shape.is_ramp:
        more += [best_of(f.trial, replace(f.shape, start=True), [f.times], f.wander) for f in bases]
    if tells_play(best.trial.op):
        travel = float(np.ptp(best.trial.op))
        for base in {id(f): f for f in (*bases, *found[: EXPERIMENTS.with_play])}.values():
            shape = replace(base.shape, play=True)
            worn = (with_term(base, shape, [math.log(w * travel), s]) for w, s in EXPERIMENTS.play_starts)
            more.append(max(worn, key=lambda f: f.log_likelihood))
    best = min(best, *more, key=lambda f: f.criterion) if more else best
    for place in range(len(best.trial.beside)):
        log_lag = float(best.times[0]) if best.lags_s else math.log(0.1 * best.trial.duration_s)
        shape = replace(best.shape, beside=(*best.shape.beside, place))
        coupled = with_term(best, shape, [log_lag])
        if coupled.criterion < best.criterion:
            best = coupled
            more.append(coupled)
    return more


def tells_play(op: Floats) -> bool:
    """Whether OP moves both ways and three times at least: one move more than play and gain are unknown."""
    moves = np.diff(op)
    return bool((moves > 0).any() and (moves < 0).any() and np.count_nonzero(moves) >= 3)
