"""The best first-order process behind an ideal valve, behind backlash and behind stick-slip: a scan, then a descent.
A profile of likelihood over backlash widths is kept, so that the profiles of several records can be added."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from numba import njit

from identification.estimation.gauss_newton import descend
from identification.estimation.model import Fitted, start_at
from identification.estimation.noise import generic_noise
from identification.estimation.problem import Problem, stem_blocks
from identification.estimation.search import (
    Dynamics,
    Products,
    WhitePv,
    behind,
    faded_products,
    initial_noise,
    level_of,
    search,
    settled,
    starts,
    variance_left,
    white_pv,
    whitened_stem,
)
from identification.record import Floats
from identification.simulation.lag import Lag, respond, unit_lag
from identification.simulation.valve import HALTS, IDEAL, RESTS, SLIDES, StemLaw, sticking

SCREEN_SHARES = (0.1, 0.3, 0.55, 0.8)
"""Stickbands that a loop without an evident fault is screened with [of OP's range]: the nearest of them
detects backlash of any width between."""
SCREENED = 3.0
"""Gain in log likelihood from which the screening of backlash is followed by its whole search [nat]: a third
of what a verdict needs."""
SMALL = (0.06, 0.12, 0.2, 0.3)
"""Small stickbands tried first [of OP's range]. At the period a small backlash with a long dead time
responds like a large one with a short dead time. The scan ranks the small one first. If only the best of
all is followed, 3 of 20 oscillating loops lose 10 nat or more, and two backlashes lose all evidence. With
the best of each part 3 of 209 lose as much."""
MIDDLE = (0.42, 0.55)  # The same between small and large [of OP's range]: as SMALL
LARGE = (0.7, 0.85, 1.0)
"""The same of large ones: a valve much wider than OP's range would not move at all [of OP's range]: as
SMALL."""
JUMP_SHARES = (0.2, 0.4, 0.7, 1.0)  # Slip jumps tried [of the stickband]
COAST = 0.15  # Reversal of OP that a sliding stem ignores: OP's noise [of the stickband]
LATER = (0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.5, 3.0)
"""Dead times tried beyond that of the best backlash: backlash in place of a jump responds too soon
[blocks]."""
FINALISTS = 8
"""Candidates of the fine scan, per behaviour, that are descended to their minimum: of 165 loops two lost more
than 1 nat where the likeliest two of all these alone were brought there a second time."""
SHORT = 1000  # Length of a record so short that every candidate can be tried on it [blocks]
FOLLOWED_SHORT = 5
"""Candidates that are followed on a short record: with few events there are more local minima."""
FOLLOWED = 2  # Candidates of a scan of stick-slip that are followed to the end
CLEAR = 1.0  # Gain in log likelihood from which one fit of the same model is preferred to another [nat]
WIDTH_SEEN = 0.03  # Width below which backlash moves PV like an ideal valve [of OP's range]
WIDTH_WHOLE = 1.25  # Width from which on the stem never moves [of OP's range]
PROFILE_HALVINGS = 1
"""Halvings of the steps in the search of dynamics, which begins at the result for the neighbouring width."""
FINE_WIDTHS = (0.88, 1.34, 0.012)
"""First, end (not tried) and step of the stickbands tried about the best backlash [of the backlash]: on
simulated stick-slip from 0.94 to 1.3 times the best-fitting backlash, in minima about 1 % wide if OP is
recorded finely."""
FINE_JUMPS = (0.1, 1.01, 0.06)
"""First, end (not tried) and step of the slip jumps tried about the best backlash [of the stickband]."""
NARROW_WIDTHS = (0.6, 0.88, 0.012)
"""The same for stems that jump by most of their stickband: the best backlash in their place is 1.5 times as
wide [of the backlash]: of 16 sticking valves of benchmarks/world (seeds 16 and 72) 3 come to a likelihood
higher by 98 to 820 nat from here, with the right stickband; none to a lower one."""
NEAR_WIDTHS = (0.94, 1.06, 0.004)
"""First, end (not tried) and step of the stickbands tried about a stick-slip that was found [of the
stickband]: pits are about 1 % wide."""
NEAR_JUMPS = (-0.15, 0.16, 0.03)
"""The same for slip jumps, next to the jump found [of the stickband]: as NEAR_WIDTHS."""
NEAR_DEAD = (-1.6, -1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2, 1.6)
"""The same for dead times, next to the one found [blocks]: as NEAR_WIDTHS."""
REFINED_MOST = 3  # Largest number of repetitions: for time
REFINED_WORTH = 5.0
"""Gain of one repetition from which another follows [nat]: the evidence required for a slip jump
(cause.evidence_jump)."""


def fit_linear(problem: Problem, period_s: float) -> Fitted:
    """Fit the process behind an ideal valve.

    period_s : period of the oscillation, or another time scale of the loop [s], about which the search begins.
    """
    noises, begins = (initial_noise(problem), generic_noise()), starts(problem, period_s)
    fits = [descend(_ranked(problem, ar, [IDEAL], begins, 3)[0]) for ar in noises]
    return max(fits, key=lambda fit: fit.log_likelihood)


def _ranked(
    problem: Problem, ar: Floats, valves: list[StemLaw], begins: list[Dynamics], halvings: int = 2
) -> list[Fitted]:
    """Starts for the descent: each valve with its best dynamics under one noise model, best first."""
    trials, pv = [], white_pv(problem, ar)
    for valve in valves:
        (t, dead), sigma2, count, beta = search(behind(pv, valve), begins, halvings)
        fit = start_at(problem, float(beta[0]), (t, dead), valve, ar)
        slow = np.array([beta[1], beta[2], 0.0, 0.0])
        trials.append(replace(fit, loss=sigma2, count=count, slow=slow))
    return sorted(trials, key=lambda fit: fit.loss)


def _chosen(near: Fitted, valves: list[StemLaw], period_s: float, followed: int) -> list[Fitted]:
    """The best few of the given valves under each of two noise models."""
    begins = [(near.time_constant_s, near.dead_time_s), *starts(near.p, period_s)]
    noises = generic_noise(), near.ar
    return [fit for ar in noises for fit in _ranked(near.p, ar, valves, begins)[:followed]]


def _likeliest(fits: list[Fitted]) -> Fitted:
    """Descend from each fit, and return the result with the highest likelihood."""
    ends = (descend(fit, free_width=True) for fit in fits)
    return max(ends, key=lambda fit: fit.log_likelihood)


def fit_backlash(linear: Fitted, period_s: float, screening_nat: float | None = None) -> Fitted:
    """The best backlash followed by a lag: a screening, then the full search if the screening finds anything.

    linear : the best fit behind an ideal valve; period_s : time scale of the search [s]; screening_nat : gain in log
    likelihood [nat] of a quick screening above which the full search follows; None: the screening is thorough and the
    limit is SCREENED.
    """
    problem = linear.p
    reach = problem.reach
    screened = [sticking(share * reach, 0.0) for share in SCREEN_SHARES]
    followed = len(screened) if screening_nat is None else 1
    best = _likeliest(_chosen(linear, screened, period_s, followed))
    if best.log_likelihood - linear.log_likelihood < (SCREENED if screening_nat is None else screening_nat):
        return best
    followed = FOLLOWED_SHORT if problem.y.size < SHORT else 1
    begun = []
    for part in (SMALL, MIDDLE, LARGE, (best.valve.stickband / reach,)):
        valves = [sticking(share * reach, 0.0) for share in part]
        begun += _chosen(best, valves, period_s, followed)
    return max(best, _likeliest(begun), key=lambda fit: fit.log_likelihood)


def better_linear(linear: Fitted, backlash: Fitted) -> Fitted:
    """The better of the linear fit and a linear fit that starts from the dynamics found behind backlash.

    An ideal valve is backlash of width zero, so this start makes the comparison fair. If both are equally likely, the
    linear fit from its own search is returned.
    """
    trial = descend(backlash.moved(valve=IDEAL))
    return trial if trial.log_likelihood > linear.log_likelihood + CLEAR else linear


def fit_stick_slip(backlash: Fitted, period_s: float) -> Fitted:
    """The best stick-slip (J > 0) followed by a lag: a coarse scan of the whole range and a fine scan near the
    backlash.

    backlash : the best one, near the stickband in width, because both set the travel of OP between slips. It is up
    to half as wide again where the slip jump is most of the stickband; narrower bands have their own finalists.
    period_s : time scale of the search [s].
    """
    short = backlash.p.y.size < SHORT
    begun = _chosen(backlash, _coarse(backlash), period_s, FOLLOWED_SHORT if short else FOLLOWED)
    narrow, laws = _grid(NARROW_WIDTHS, FINE_JUMPS), (RESTS, HALTS, SLIDES)
    fits = [_likeliest(begun), *local_minima(backlash, laws), *local_minima(backlash, laws, narrow)]
    return refined(max(fits, key=lambda fit: fit.log_likelihood))


def refined(fit: Fitted) -> Fitted:
    """The most likely stick-slip near a given one. Minima in stickband and slip jump are about 1 % wide, so a scan
    that uses time constant and dead time of the backlash fit misses the deepest one."""
    for _ in range(REFINED_MOST):
        share = fit.valve.slip_jump / max(fit.valve.stickband, 1e-9)
        first, end, step = NEAR_JUMPS
        about = _grid(NEAR_WIDTHS, (max(share + first, step), min(share + end, 1.0 + 1e-9), step))
        found = local_minima(fit, (fit.valve.tolerance,), about, NEAR_DEAD)
        best = max((fit, *found), key=lambda fit: fit.log_likelihood)
        gained, fit = best.log_likelihood - fit.log_likelihood, best
        if gained < REFINED_WORTH:
            break
    return fit


def _grid(widths: tuple[float, ...], jumps: tuple[float, ...]) -> Floats:
    """Stickbands as multiples of a valve's width and slip jumps as shares of the stickband, shape (m, 2), from two
    ranges, each given as start, end (exclusive) and step."""
    return np.array(list(product(np.arange(*widths), np.arange(*jumps))))


def _coarse(backlash: Fitted) -> list[StemLaw]:
    """Stickbands up to the range of OP, with stems that rest and stems that slide."""
    reach = backlash.p.reach
    near = backlash.valve.stickband / reach
    widths = {round(s, 4) for s in MIDDLE + LARGE} | {near, 1.1 * near}
    return [
        sticking(width * reach, jump, tolerance)
        for width in sorted(widths)
        for jump in JUMP_SHARES
        for tolerance in (RESTS, COAST * width * reach)
    ]


def local_minima(
    backlash: Fitted,
    tolerances: tuple[float, ...],
    grid: Floats | None = None,
    later: tuple[float, ...] = LATER,
) -> list[Fitted]:
    """The most likely stick-slips near a backlash or another stick-slip: local minima of the best few of each
    behaviour.

    One slip more or less changes the stem until the next slip, so the likelihood has many narrow optima in S and J.
    grid : shape (m, 2), stickbands as multiples of the backlash width and slip jumps as shares of the stickband;
    later : dead times added to that of the backlash fit [blocks].
    """
    problem = backlash.p
    relative = _grid(FINE_WIDTHS, FINE_JUMPS) if grid is None else grid
    pairs, t = np.array([backlash.valve.stickband, 1.0]) * relative, backlash.time_constant_s
    deads = np.maximum(backlash.dead_time_s + np.array(later) * problem.dt_s, 0.0)
    out, pv, begins = [], white_pv(problem, generic_noise()), [(t, float(dead)) for dead in deads]
    for tolerance in tolerances:
        variances = _scan(pv, pairs, tolerance, t, deads)
        best = [sticking(pairs[i, 0], pairs[i, 1], tolerance) for i in np.argsort(variances)[:FINALISTS]]
        fits = _ranked(problem, generic_noise(), best, begins)
        out += [_local_minimum(descend(fit)) for fit in fits]
    likeliest = sorted(out, key=lambda fit: -fit.log_likelihood)[:FOLLOWED]
    return [_local_minimum(fit) for fit in likeliest]


def _local_minimum(fit: Fitted) -> Fitted:
    """Move stickband and slip jump to their local minimum, then descend in the other constants."""
    dynamics = fit.time_constant_s, fit.dead_time_s
    valve = settled(white_pv(fit.p, fit.ar), fit.valve, fit.loss, dynamics)
    return descend(fit.moved(valve=valve))


@njit(cache=True)
def _scan(pv: WhitePv, pairs: Floats, tolerance: float, time_constant_s: float, deads_s: Floats) -> Floats:
    """Innovations variance of many stick-slips at once, at the best of some dead times [% PV squared], shape (m,).

    pairs : shape (m, 2), stickband [% OP] and slip jump as a share of it; tolerance : behaviour of the moving stem
    (valve.py).
    """
    n, level = pv.rows.shape[1], level_of(pv.ar)
    out, x, decay = np.full(pairs.shape[0], np.inf), np.zeros(n), np.zeros(n)
    pole = unit_lag(time_constant_s, 0.0, pv.dt_s).pole
    outlasts = time_constant_s > 0.5 * n * pv.dt_s
    if not outlasts:
        decay[:] = pv.rows[1] * pole ** np.arange(n)
    fv, _, f1, ft, ff = faded_products(x, pv.rows, pole, outlasts)
    for i in range(pairs.shape[0]):
        stem = stem_blocks(pv.stems, sticking(pairs[i, 0], pairs[i, 1], tolerance))
        whole = respond(whitened_stem(stem - stem.mean(), pv.ar), Lag(pole, 1.0, 0.0, 0))
        for dead_s in deads_s:
            lag = unit_lag(time_constant_s, dead_s, pv.dt_s)
            products, fx = _delayed_response(whole, lag, pv.rows, decay, x)
            out[i] = min(out[i], variance_left(products, (fv, fx, f1, ft, ff), pv.sums, level)[0])
    return out


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _delayed_response(
    whole: Floats, lag: Lag, rows: Floats, decay: Floats, out: Floats
) -> tuple[Products, float]:
    """Write the response at one dead time into `out`, from the one without; return its products and that with the
    decay, summed in any order. The stem is assumed to be at rest at the start.
    """
    n, delay = out.size, lag.delay
    out[: min(delay, n)] = 0.0
    if delay >= n:
        return (0.0, 0.0, 0.0, 0.0), 0.0
    x = lag.now * whole[0]
    out[delay], xv, x1, xt = x, x * rows[0, delay], x * rows[1, delay], x * rows[2, delay]
    xx, xf = x * x1, x * decay[delay]
    v, w, t, f = rows[0, delay + 1 :], rows[1, delay + 1 :], rows[2, delay + 1 :], decay[delay + 1 :]
    late, earlier, later = whole[1 : n - delay], whole[: n - delay - 1], out[delay + 1 :]
    for k in range(v.size):
        x = lag.now * late[k] + lag.before * earlier[k]
        weighted = x * w[k]
        later[k] = x
        xv, x1, xt, xx = xv + x * v[k], x1 + weighted, xt + x * t[k], xx + x * weighted
        xf += x * f[k]
    return (xv, x1, xt, xx), xf


WIDTHS = np.geomspace(0.1, 60.0, 29)
"""Backlash widths of the likelihood profile [% OP], each a quarter wider than the last: from the smallest dead band
of a positioner to a valve whose linkage is loose."""


def width_profile(linear: Fitted, backlash: Fitted) -> Floats:
    """Log likelihood of backlash at each of WIDTHS over that of an ideal valve [nat], shape of WIDTHS.

    Each width has its best process, under the better of two noise models: that of the backlash fit and the generic
    one. The best backlash lies between two widths: it counts for both, less a nat for a whole step of them, so that
    two records of one valve always agree on one width.

    linear, backlash : the fits to one problem behind an ideal valve and behind the best backlash.
    """
    problem = linear.p
    blocks = problem.with_blocks(position=None)
    out, reach = np.zeros(WIDTHS.size), float(np.ptp(problem.blocks.op))
    profiled = np.flatnonzero((WIDTH_SEEN * reach < WIDTHS) & (WIDTH_WHOLE * reach > WIDTHS))
    if profiled.size == 0:
        return out
    ideal, least, own = _ideal(blocks, linear, backlash, linear.ar), np.full(profiled.size, np.inf), math.inf
    for ar in (backlash.ar, generic_noise()):
        pv = white_pv(blocks, ar)
        ideal = min(ideal, _ideal(blocks, linear, backlash, ar))
        least = np.minimum(least, _swept(pv, WIDTHS[profiled], backlash))
        own = min(own, float(_swept(pv, np.array([backlash.valve.stickband]), backlash)[0]))
    out[profiled] = 0.5 * backlash.count * np.log(ideal / least)
    steps = np.abs(np.log(WIDTHS / max(backlash.valve.stickband, 1e-9))) / math.log(WIDTHS[1] / WIDTHS[0])
    adjacent = profiled[steps[profiled] < 1.0]
    own_nat = 0.5 * backlash.count * math.log(ideal / own)
    out[adjacent] = np.maximum(out[adjacent], own_nat - steps[adjacent] ** 2)
    out[profiled[-1] + 1 :] = out[profiled[-1]]
    return out


def _ideal(problem: Problem, linear: Fitted, backlash: Fitted, ar: Floats) -> float:
    """Innovations variance behind an ideal valve under one noise model."""
    begins = [_dynamics(linear), _dynamics(backlash)]
    return search(behind(white_pv(problem, ar), IDEAL), begins, PROFILE_HALVINGS)[1]


def _dynamics(fit: Fitted) -> Dynamics:
    return fit.time_constant_s, fit.dead_time_s


def _swept(pv: WhitePv, widths: Floats, backlash: Fitted) -> Floats:
    """Innovations variance behind backlash of increasing widths, computed from the best width outwards both ways."""
    out = np.empty(widths.size)
    first = int(np.argmin(np.abs(np.log(widths / max(backlash.valve.stickband, 1e-3)))))
    for indices in (range(first, widths.size), range(first - 1, -1, -1)):
        near = _dynamics(backlash)
        for k in indices:
            prepared = behind(pv, sticking(widths[k], 0.0))
            near, out[k], _, _ = search(prepared, [near, _dynamics(backlash)], PROFILE_HALVINGS)
    return out
