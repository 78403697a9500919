"""Uncertainty of an experiment's constants: 90 % intervals from the curvature at the optimum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from identification.estimation.descent import NINETY
from identification.experiments.columns import Kind
from identification.experiments.fit import TIMES, Fitted, columns, descended
from identification.experiments.wander import whitened
from identification.models import Estimate
from identification.record import Floats

DEAD_STEP = 0.7
"""Step from one dead time to the next, at each of which an experiment's other constants are fitted again
[deviations]: a normal density in steps of .7 deviations has its moments within .1 %."""
DEAD_TIMES = 8  # Dead times on either side of the likeliest at most: they reach 5.6 deviations
UNLIKELY = 4.0
"""Loss of log likelihood from which a dead time no longer counts [nat]. Source: theory: beyond 2.8 deviations
of a normal density, .5 % of it."""
COUNTS = 0.02
"""Akaike weight from which a candidate counts: less moves a mean by less than its deviation's fiftieth."""
LOG_KNOWN = 1.5  # Prior deviation of a lag's log: a second lag without effect has no limit
LOOSE = 0.3
"""Deviation of a gain's log from which a candidate next to the best does not count: its terms are
indistinguishable."""

NUDGE = 1e-4
"""Step of a numerical derivative, in logs, or relative to the shortest time."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Standard deviations of log gain, log of the sum of lags, and dead time [s]; an integrator has no lags.
    covariance : of all constants, times first, then coefficients, shape (m, m)."""

    log_gain: float
    log_lags: float
    dead_s: float
    covariance: Floats = field(repr=False)


def covariance_of(fit: Fitted) -> Floats:
    """Covariance of times and coefficients, shape (m, m), from the white columns' Gram matrix."""
    trial, shape, times = fit.trial, fit.shape, fit.times
    parts = []
    own = TIMES[shape.kind]
    for at in range(times.size):
        is_dead = at == own and shape.answers
        step = NUDGE * max(trial.block_s, 0.1 * fit.dead_s) * 10.0 if is_dead else NUDGE * 10.0
        up, down = times.copy(), times.copy()
        up[at] += step
        down[at] = max(down[at] - step, 0.0) if is_dead else down[at] - step
        moved = (columns(trial, shape, up) - columns(trial, shape, down)) @ fit.linear
        parts.append(moved / (up[at] - down[at]))
    design = np.column_stack([*parts, columns(trial, shape, times)])
    white, _ = whitened(np.ascontiguousarray(design), trial.usable, fit.wander.phi, fit.wander.ratio)
    size = np.sqrt((white**2).sum(axis=0)) + 1e-12
    gram = white.T @ white / fit.variance
    logs = np.zeros(size.size)
    logs[: times.size] = LOG_KNOWN**-2
    if shape.answers:
        logs[own] = (sum(fit.lags_s) + fit.dead_s if fit.lags_s else trial.duration_s) ** -2.0
    gram += np.diag(logs + 1e-10 * size**2 / fit.variance)
    scale = np.sqrt(np.diag(gram))
    return np.asarray(np.linalg.inv(gram / np.outer(scale, scale)) / np.outer(scale, scale))


def spread_of(fit: Fitted) -> Spread:
    """Standard deviations of the constants."""
    cov = covariance_of(fit)
    own, first = TIMES[fit.shape.kind], fit.times.size
    lags = np.exp(fit.times[:own])
    weights = lags / max(float(lags.sum()), 1e-12)
    gain = math.sqrt(max(cov[first, first], 0.0)) / max(abs(fit.gain), 1e-12)
    sum_s = math.sqrt(max(float(weights @ cov[:own, :own] @ weights), 0.0)) if own else 0.0
    dead = math.sqrt(max(cov[own, own], 0.0)) if fit.shape.answers else 0.0
    return Spread(gain, sum_s, dead, cov)


def weights_of(found: Sequence[Fitted]) -> Floats:
    """Weight of each candidate, shape (m,), by Akaike weights (Burnham, Anderson 2002, section 2.9)."""
    score = np.array([f.score for f in found])
    weight = np.exp(score - score.max())
    return np.asarray(weight / weight.sum())


@dataclass(frozen=True, slots=True)
class Averaged:
    """Gain (of an integrator slope), sum of lags [s] and dead time [s] averaged over all candidates of a family, and
    their deviations, within and between candidates. Log gain and log lags are averaged."""

    gain: float
    lags_s: float
    dead: Estimate
    spread: Spread


def _counts(f: Fitted, best: Fitted) -> bool:
    """Whether a candidate is averaged with the best: same family and sign, and no inverse response, whose zero can
    replace dead time."""
    same = f.shape.is_ramp == best.shape.is_ramp and f.gain * best.gain > 0.0
    return same and f.shape.kind is not Kind.INVERSE


def along_dead_time(fit: Fitted, step_s: float) -> list[Fitted]:
    """A candidate refitted at a series of dead times, as far as these are likely: a second lag, or backlash, can
    replace dead time far beyond the curvature at one optimum."""
    own, out = TIMES[fit.shape.kind], [fit]
    most = 0.5 * fit.trial.duration_s
    for direction in (-1.0, 1.0):
        at = fit
        for _ in range(DEAD_TIMES):
            times = at.times.copy()
            times[own] = min(max(times[own] + direction * step_s, 0.0), most)
            if times[own] == at.times[own]:
                break
            at = descended(fit.trial, fit.shape, times, fit.wander, late=False)
            out.append(at)
            if at.log_likelihood < fit.log_likelihood - UNLIKELY:
                break
    return out


def averaged(found: Sequence[Fitted], closed: bool = False) -> Averaged:
    """The constants averaged over a best candidate and all others of its family, best first: one lag cannot always be
    distinguished from two, nor drift from none, and an interval must cover both.

    Each is refitted along its dead times, except those of an experiment in automatic (closed): a fit to their
    residual noise would move the constants.
    """
    best = found[0]
    tried = [(f, spread_of(f)) for f in found if f is best or _counts(f, best)]
    precise = [(f, s) for f, s in tried if f is best or s.log_gain < LOOSE]
    weight, at, own = _mixture(precise, closed)
    mean = weight @ at
    wide = np.sqrt(weight @ (own**2 + (at - mean) ** 2))
    dead = ninety(weight, at[:, 2], own[:, 2])
    deviation_s = (dead.high - dead.low) / (2.0 * NINETY)
    sign = math.copysign(1.0, best.gain)
    spread = Spread(float(wide[0]), float(wide[1]), deviation_s, precise[0][1].covariance)
    return Averaged(sign * math.exp(mean[0]), math.exp(mean[1]), dead, spread)


def _mixture(precise: Sequence[tuple[Fitted, Spread]], closed: bool) -> tuple[Floats, Floats, Floats]:
    """Weights, shape (m,), log gains, log sums of lags and dead times [s], shape (m, 3), and their deviations."""
    rows, inner, weight = [], [], []
    # OP moved at an unknown time between two samples, and the record shows the move at the second
    unseen_s = precise[0][0].trial.dt_s
    for share, (f, s) in zip(weights_of([f for f, _ in precise]), precise, strict=True):
        if share < COUNTS:
            continue
        step_s = max(DEAD_STEP * s.dead_s, 0.05 * unseen_s)
        row = [f] if closed else along_dead_time(f, step_s)
        likely = np.exp([x.log_likelihood - f.log_likelihood for x in row])
        weight += (share * likely / likely.sum()).tolist()
        rows += [
            (math.log(abs(x.gain)), math.log(max(sum(x.lags_s), 1e-9)), x.dead_s + 0.5 * unseen_s)
            for x in row
        ]
        within_s = s.dead_s if closed else step_s / math.sqrt(12.0)
        inner += [(s.log_gain, s.log_lags, math.hypot(within_s, unseen_s / math.sqrt(12.0)))] * len(row)
    return np.array(weight) / sum(weight), np.array(rows), np.array(inner)


def ninety(weight: Floats, at: Floats, wide: Floats) -> Estimate:
    """Median [s] and 90 % interval, at least 0, of a mixture of normal densities; shape (m,) each.

    If one lag and two lags are equally likely, the mean of their dead times fits neither.
    """
    grid = np.linspace(min(float((at - 3.0 * wide).min()), 0.0), float((at + 3.0 * wide).max()), 1000)
    below = ndtr((grid[:, None] - at) / wide) @ weight
    low, middle, high = np.maximum(np.interp((0.05, 0.5, 0.95), below, grid), 0.0).tolist()
    return Estimate(middle, low, high, "s")


def _factor(value: float, log_deviation: float, unit: str) -> Estimate:
    """A number with a relative interval."""
    factor = math.exp(min(NINETY * log_deviation, 20.0))
    low, high = sorted((value / factor, value * factor))
    return Estimate(value, low, high, unit)


def estimates_of(found: Sequence[Fitted], mean: Averaged) -> dict[str, Estimate]:
    """The constants with 90 % intervals, by the names of the ranking's columns; candidates sorted best first."""
    best, wide = found[0], mean.spread
    ramp = best.shape.is_ramp
    out = {}
    if ramp:
        out["slope_pct_per_s"] = _factor(mean.gain, wide.log_gain, "%/(% s)")
    else:
        out["gain"] = _factor(mean.gain, wide.log_gain, "%/%")
        out["lags_s"] = _factor(mean.lags_s, wide.log_lags, "s")
        out |= _lags(best, wide)
    out["dead_time_s"] = mean.dead
    return out | _rest(best, wide)


def _lags(fit: Fitted, spread: Spread) -> dict[str, Estimate]:
    """The individual lags of a candidate, the longest first."""
    out = {}
    order = np.argsort(-fit.times[: TIMES[fit.shape.kind]])
    for name, at in zip(("time_constant_s", "second_lag_s"), order, strict=False):
        log = math.sqrt(max(spread.covariance[at, at], 0.0))
        out[name] = _factor(float(np.exp(fit.times[at])), log, "s")
    return out


def _rest(fit: Fitted, spread: Spread) -> dict[str, Estimate]:
    """Backlash, inverse response, drift and neighbours' gains, if the candidate has them."""
    out, shape, first = {}, fit.shape, fit.times.size
    deviation = np.sqrt(np.maximum(np.diag(spread.covariance), 0.0))
    at = first + shape.answers + 1
    if shape.kind is Kind.INVERSE:
        share = fit.linear[1] / fit.linear[0]
        half = NINETY * deviation[first + 1] / abs(fit.linear[0])
        out["zero_s"] = Estimate(abs(share), abs(share) - half, abs(share) + half, "s")
    if shape.backlash:
        place = TIMES[shape.kind] + 1
        out["backlash_pct"] = _factor(math.exp(fit.times[place]), deviation[place], "% of OP")
    if shape.drift:  # for an integrator it is OP's balance
        per_h = 2.0 * 3600.0 / fit.trial.duration_s
        value, half = per_h * fit.linear[at - first], per_h * NINETY * deviation[at]
        out["drift_pct_per_h"] = Estimate(float(value), float(value - half), float(value + half), "%/h")
    for place in range(len(shape.neighbours)):
        column = fit.linear.size - len(shape.neighbours) + place
        value, half = float(fit.linear[column]), NINETY * float(deviation[first + column])
        out[f"neighbour_{shape.neighbours[place]}_gain"] = Estimate(value, value - half, value + half, "%/%")
    return out
