"""Fit of one experiment over its response: times and backlash by least squares, gains, bias and drift by projection.

Each candidate is judged by its likelihood under white noise and an autoregressive load (wander.py); the one with the
least Bayesian information criterion is chosen (Schwarz 1978).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from identification.experiments.columns import Kind, Trial, answers, stem_of
from identification.experiments.wander import Wander, log_likelihood, wander_of, whitened
from identification.record import Floats, Mask
from identification.simulation.lag import respond, unit_lag

LONGEST_LAG = 5.0
"""Longest lag that is searched for [of the experiment]: beyond it the answer is an integrator's."""
STEPS = 40  # Evaluations of a search for times
NOISE_PASSES = 3
"""Passes that make a fit and its noise consistent: the likelihood moves by less than .1 nat with more."""
SCREENED = 14
"""Lags that are screened from a block to the whole experiment: neighbours are nearer than a factor of two."""
DEAD_SHARES = (0.0, 0.1, 0.3, 0.6, 1.0, 1.6, 2.5)  # Dead times that are screened with each lag [of the lag]
STARTS = 3  # Screened lags that are followed
TWO_LAGS = ((0.9, 0.3, 0.6), (0.7, 0.6, 0.3), (1.0, 0.1, 1.0))
"""Where the search for two lags begins, in terms of the best lag with dead time [of lag, lag, dead time]."""
BACKLASH_STARTS = ((0.1, 0.5), (0.3, 0.9))
"""Backlash, and the part of it that the first move takes up, at the start of the search [of OP's range, of
the backlash]."""
WITH_BACKLASH = 2  # Best candidates that are tried with backlash if OP reverses [candidates]
RARE = 2.3
"""Additional gain that an inverse response needs over other candidates: one process in ten has one [nat]."""
RAMP_FROM = 1.5
"""Lag from which a response is an integrator's: PV has made less than half of its move [of the
experiment]."""

TIMES = {Kind.NO_ANSWER: 0, Kind.LAG: 1, Kind.TWO_LAGS: 2, Kind.INVERSE: 2, Kind.INTEGRATOR: 0}
"""Lags of each kind."""
ALIKE = {Kind.LAG: (Kind.TWO_LAGS,), Kind.TWO_LAGS: (Kind.LAG,)}
"""Kinds that one experiment may not distinguish."""


@dataclass(frozen=True, slots=True)
class Shape:
    """Terms of a candidate: its kind, whether PV drifts or begins away from rest, backlash, and neighbours (by
    index)."""

    kind: Kind
    drift: bool = False
    start: bool = False
    backlash: bool = False
    neighbours: tuple[int, ...] = ()

    @property
    def is_ramp(self) -> bool:
        """Whether the process integrates; a drift is then also OP's balance."""
        return self.kind is Kind.INTEGRATOR

    @property
    def answers(self) -> int:
        """Columns of the process response."""
        return {Kind.NO_ANSWER: 0, Kind.INVERSE: 2}.get(self.kind, 1)

    @property
    def times(self) -> int:
        """Number of times searched for: lags, dead time, backlash with its first slack, one lag per neighbour."""
        own = 0 if self.kind is Kind.NO_ANSWER else TIMES[self.kind] + 1
        return own + 2 * self.backlash + len(self.neighbours)

    @property
    def constants(self) -> int:
        """Number of constants without the noise's."""
        return self.times + self.answers + 1 + self.drift + self.start + len(self.neighbours)


@dataclass(frozen=True, slots=True)
class Fitted:
    """A candidate at its optimum.

    times : logs of lags [s], dead time [s], log backlash width, slack as a share of it, logs of neighbours' lags;
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
        """Log likelihood [nat] less the Akaike penalty of its constants and the prior penalty of its kind."""
        rare = RARE if self.shape.kind is Kind.INVERSE else 0.0
        return self.log_likelihood - self.shape.constants - rare

    @property
    def criterion(self) -> float:
        """Half of the Bayesian information criterion [nat]: less is better."""
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
        """Gain [% PV/% OP], of an integrator its slope [% PV/(% OP s)]; 0 without a response."""
        return float(self.linear[0]) if self.shape.answers else 0.0

    @property
    def simulated(self) -> Floats:
        """Simulated PV [% PV], drift and neighbours included, shape (n,)."""
        return columns(self.trial, self.shape, self.times) @ self.linear


def columns(trial: Trial, shape: Shape, times: Floats) -> Floats:
    """The regression columns of a candidate's PV, shape (n, m)."""
    own = TIMES[shape.kind]
    lags = tuple(np.exp(times[:own]))
    out = []
    if shape.answers:
        at = own + 1
        stem = trial.op
        if shape.backlash:
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
        begun[0] = 0.0  # before the record OP had another value, at which PV was at rest
        out.append(answers(shape.kind, begun, trial, ordered, float(times[own]))[0])
    for place, log_lag in zip(shape.neighbours, times[times.size - len(shape.neighbours) :], strict=True):
        op = trial.neighbours[place]
        out.append(respond(op - op[0], unit_lag(math.exp(log_lag), 0.0, trial.dt_s), trial.factor))
    return np.column_stack(out)


def projected(trial: Trial, shape: Shape, times: Floats, noise: Wander) -> tuple[Floats, Floats, float]:
    """Whitened residuals of PV, shape (n,), the columns' coefficients, and the logs of variances."""
    x = np.column_stack([columns(trial, shape, times), trial.pv])
    white, logs = whitened(np.ascontiguousarray(x), trial.usable, noise.phi, noise.ratio)
    design, y = white[:, :-1], white[:, -1]
    size = np.sqrt((design**2).sum(axis=0)) + 1e-12
    gram = (design / size).T @ (design / size)
    gram[np.diag_indices_from(gram)] += 1e-9
    linear = np.linalg.solve(gram, (design / size).T @ y) / size
    return y - design @ linear, linear, logs


def bounds_of(trial: Trial, shape: Shape) -> tuple[Floats, Floats]:
    """Lower and upper bounds of the times, shape (m,) each."""
    long, own = trial.duration_s, TIMES[shape.kind]
    short = 0.5 * trial.block_s if own > 1 else 0.1 * trial.dt_s
    low = [math.log(short)] * own
    high = [math.log(LONGEST_LAG * long)] * own
    if shape.answers:
        low, high = [*low, 0.0], [*high, 0.5 * long]
    if shape.backlash:
        travel = float(np.ptp(trial.op))
        low, high = [*low, math.log(1e-3 * travel), 0.0], [*high, math.log(0.9 * travel), 1.0]
    low += [math.log(trial.dt_s)] * len(shape.neighbours)
    high += [math.log(long)] * len(shape.neighbours)
    return np.array(low), np.array(high)


def descended(trial: Trial, shape: Shape, start: Floats, noise: Wander, late: bool = True) -> Fitted:
    """A candidate at its optimum from a start, under a noise model; late: whether its dead time is searched too."""
    low, high = bounds_of(trial, shape)
    times = np.clip(start, low + 1e-9 * (high - low), high - 1e-9 * (high - low))
    free, scale = np.ones(times.size, dtype=bool), np.ones(times.size)
    if shape.answers:
        free[TIMES[shape.kind]] = late
        scale[TIMES[shape.kind]] = max(0.2 * times[TIMES[shape.kind]], trial.dt_s)

    def residuals(t: Floats) -> Floats:
        return projected(trial, shape, placed(times, free, t), noise)[0]

    if free.any():
        found = least_squares(
            residuals,
            times[free],
            bounds=(low[free], high[free]),
            x_scale=scale[free],
            diff_step=1e-4,
            max_nfev=STEPS,
        )
        times = placed(times, free, found.x)
    e, linear, logs = projected(trial, shape, times, noise)
    squares, count = float((e**2).sum()), int(trial.usable.sum())
    return Fitted(shape, trial, times, linear, log_likelihood(squares, logs, count), squares / count, noise)


def placed(all_times: Floats, free: Mask, found: Floats) -> Floats:
    """All times, with the searched ones replaced."""
    out = all_times.copy()
    out[free] = found
    return out


def settled(fit: Fitted) -> Fitted:
    """Fit and noise model estimated alternately until they agree."""
    for _ in range(NOISE_PASSES):
        noise = wander_of(fit.trial.pv - fit.simulated, fit.trial.usable)
        again = descended(fit.trial, fit.shape, fit.times, noise)
        if again.log_likelihood <= fit.log_likelihood + 0.01 and noise == fit.wander:
            break
        fit = again
    return fit


def screened(trial: Trial, noise: Wander) -> list[Floats]:
    """Times (log lag, dead time) of the lags with dead time of least residual, one per time scale; best first."""
    shape = Shape(Kind.LAG, drift=True)
    lags = np.geomspace(max(trial.block_s, 2e-3 * trial.duration_s), trial.duration_s, SCREENED)
    found = []
    for lag in lags:
        tried = [np.array([math.log(lag), share * lag]) for share in DEAD_SHARES]
        tried = [t for t in tried if t[1] < 0.5 * trial.duration_s]
        losses = [float((projected(trial, shape, t, noise)[0] ** 2).sum()) for t in tried]
        found.append((min(losses), tried[int(np.argmin(losses))]))
    found.sort(key=lambda x: x[0])
    return [times for _, times in found[:STARTS]]


def starts_of(kind: Kind, lag: Fitted) -> list[Floats]:
    """Starts of the search for a kind, from the fitted lag with dead time."""
    log_t, dead = float(lag.times[0]), lag.dead_s
    if kind is Kind.INTEGRATOR:
        return [np.array([dead]), np.array([dead + 0.1 * math.exp(log_t)])]
    return [np.array([log_t + math.log(a), log_t + math.log(b), c * dead]) for a, b, c in TWO_LAGS]


def best_of(trial: Trial, shape: Shape, starts: list[Floats], noise: Wander) -> Fitted:
    """The most likely optimum of a shape, with its noise model."""
    return settled(max((descended(trial, shape, s, noise) for s in starts), key=lambda f: f.log_likelihood))


def with_term(fit: Fitted, shape: Shape, more: list[float]) -> Fitted:
    """A fit of a shape with one more term, started from the given fit."""
    at = fit.times.size - len(fit.shape.neighbours)
    own = np.insert(fit.times, [at] * len(more), more) if not shape.neighbours else np.append(fit.times, more)
    return best_of(fit.trial, shape, [own], fit.wander)


def candidates(trial: Trial) -> tuple[list[Fitted], Fitted]:
    """All candidates with a response, least criterion first, and the best without a response."""
    still = min((_without_response(trial, drift) for drift in (False, True)), key=lambda f: f.criterion)
    white = Wander()
    tried = (descended(trial, Shape(Kind.LAG, drift=True), s, white) for s in screened(trial, white))
    plain = settled(max(tried, key=lambda f: f.log_likelihood))
    found = [plain, _without_drift(plain)]
    for kind in (Kind.TWO_LAGS, Kind.INTEGRATOR, Kind.INVERSE):
        shape = Shape(kind, drift=True)
        richer = best_of(trial, shape, starts_of(kind, plain), plain.wander)
        found += [richer, _without_drift(richer)]
    found = sorted(filter(_is_plausible, found), key=lambda f: f.criterion)
    return sorted([*found, *_with_more_terms(found)], key=lambda f: f.criterion), still


def _without_response(trial: Trial, drift: bool) -> Fitted:
    return settled(descended(trial, Shape(Kind.NO_ANSWER, drift=drift), np.zeros(0), Wander()))


def _without_drift(fit: Fitted) -> Fitted:
    """The same shape without drift."""
    return best_of(fit.trial, replace(fit.shape, drift=False), [fit.times], fit.wander)


def _is_plausible(fit: Fitted) -> bool:
    """Whether an inverse response really starts in the opposite direction, and no lag is so long that it is an
    integrator."""
    led = fit.shape.kind is Kind.INVERSE and fit.linear[0] * fit.linear[1] >= 0.0
    return not led and max(fit.lags_s, default=0.0) < RAMP_FROM * fit.trial.duration_s


def _with_more_terms(found: list[Fitted]) -> list[Fitted]:
    """The best candidates, and the best of each kind that may be confused with theirs, with more terms: a start away
    from rest, backlash where OP reverses, and neighbours that lower the criterion."""
    best, more = found[0], []
    alike = {f.shape.kind: f for f in reversed(found) if f.shape.kind in ALIKE.get(best.shape.kind, ())}
    bases = [best, *(f for f in alike.values() if f is not best)]
    if not best.shape.is_ramp:
        more += [best_of(f.trial, replace(f.shape, start=True), [f.times], f.wander) for f in bases]
    if backlash_identifiable(best.trial.op):
        travel = float(np.ptp(best.trial.op))
        for base in {id(f): f for f in (*bases, *found[:WITH_BACKLASH])}.values():
            shape = replace(base.shape, backlash=True)
            worn = (with_term(base, shape, [math.log(w * travel), s]) for w, s in BACKLASH_STARTS)
            more.append(max(worn, key=lambda f: f.log_likelihood))
    best = min(best, *more, key=lambda f: f.criterion) if more else best
    for place in range(len(best.trial.neighbours)):
        log_lag = float(best.times[0]) if best.lags_s else math.log(0.1 * best.trial.duration_s)
        shape = replace(best.shape, neighbours=(*best.shape.neighbours, place))
        coupled = with_term(best, shape, [log_lag])
        if coupled.criterion < best.criterion:
            best = coupled
            more.append(coupled)
    return more


def backlash_identifiable(op: Floats) -> bool:
    """Whether OP moves in both directions and at least three times: gain and backlash alone need two moves."""
    moves = np.diff(op)
    return bool((moves > 0).any() and (moves < 0).any() and np.count_nonzero(moves) >= 3)
