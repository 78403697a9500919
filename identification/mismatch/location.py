"""Location of a misfit: one joint regression of innovations on the state of the loop at each sample.

Separate bins confound correlated features (PV with OP, level with time), so all features enter one regression and
each is judged by what it adds to the others. The null is empirical: blocks of the innovations are permuted against
the features, which removes every dependence and keeps colour and outliers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.ndimage import binary_opening

from identification.controller.check import runs
from identification.limits import LIMITS
from identification.record import Floats, Mask
from identification.signals.robust import OUTLIER, robust_deviation

ORDERS = 400
"""Permutations of the blocks that give the distribution of an independent residual: a p-value of 0.05 is
known within 0.01, and 20,000 samples take under a second."""
CHANCE = 0.02
"""Probability that any feature is reported for a residual that depends on none: one page in fifty."""
BLOCK_MEMORIES = 3.0
"""Length of a block in memories of the loop (dead time plus time constant): a permutation keeps the order
within it."""
SHORTEST_BLOCK = 30  # Fewest samples of a block [samples]
MOST_BLOCKS = 150  # Most blocks: more only cost memory
FEWEST_BLOCKS = 10
"""Fewest blocks for a permutation test; the misfit of a shorter record is not located."""
PIECES = 4
"""Number of linear pieces over a level or over time: enough to follow a step at any place, with few
columns."""
PROFILE_PARTS = 12  # Parts of a feature's profile, of as many samples each
TURN_SHARE = 0.01
"""Least OP reversal, relative to OP's range; a smaller one shows nothing about a valve."""
OP_LEVELS = 12
"""Values that OP must take for an end of its own range to be a limit: a test signal between two is at
none."""
LIMIT_SAMPLES = 10  # Samples at a limit below which the limit is not tested [samples]
PAST = 2
"""Samples by which features are older than the innovation [samples]: one, and one for what looks at a
neighbour."""


@dataclass(frozen=True, slots=True)
class Group:
    """Columns of one feature, shape (n, k), and its signal, shape (n,), for the profile.

    sense : direction of OP where a bias is accumulated along it, shape (n,), else None.
    """

    name: str
    columns: Floats
    signal: Floats
    sense: Floats | None = None


@njit(cache=True)
def turns(op: Floats, least: float) -> tuple[Floats, Floats]:
    """Direction of OP (-1, 0, 1) and samples since its last reversal, shape (n,) each.

    A reversal counts once OP has moved back from its extreme by `least` [% OP], and from then on. Later OP must not
    be used: under feedback it depends on the very innovation that is to be located.
    """
    n = op.size
    direction, since = np.zeros(n), np.zeros(n)
    low, high, now, at = op[0], op[0], 0.0, 0
    for k in range(n):
        low, high = min(low, op[k]), max(high, op[k])
        if now <= 0.0 and op[k] - low > least:
            now, at, high = 1.0, k, op[k]
        elif now >= 0.0 and high - op[k] > least:
            now, at, low = -1.0, k, op[k]
        if now > 0.0:
            low = high
        elif now < 0.0:
            high = low
        direction[k], since[k] = now, k - at
    return direction, since


def least_turn(op: Floats) -> float:
    """Travel back that counts as an OP reversal [% OP]."""
    change = np.diff(op)
    noise = robust_deviation(change - np.median(change)) if change.size else 0.0
    low, high = np.quantile(op, [0.01, 0.99])
    return max(TURN_SHARE * float(high - low), OUTLIER * noise, 1e-6)


def piecewise_linear_basis(x: Floats) -> Floats:
    """Piecewise linear basis between even quantiles of a signal, shape (n, k), none if it is constant."""
    knots = np.unique(np.quantile(x, np.linspace(0.02, 0.98, PIECES + 1)))
    if knots.size < 2:
        return np.zeros((x.size, 0))
    return np.stack([np.interp(x, knots, row) for row in np.eye(knots.size)[1:]], axis=1)


def ranked(x: Floats) -> Floats:
    """Ranks from 0 to 1, shape (n,), equal for equal values."""
    levels, at = np.unique(x, return_inverse=True)
    return at / max(levels.size - 1, 1)


def at_limits(op: Floats) -> Mask:
    """True where OP is at 0 or 100 %, or at an end of its own range for three samples, shape (n,)."""
    least = LIMITS.controller.at_limit
    out = (op <= least) | (op >= 100.0 - least)
    ends = (op.max(), op.min()) if np.unique(op).size > OP_LEVELS else ()
    for end in ends:
        out |= binary_opening(op == end, np.ones(3))
    return out


def delayed(x: Floats, late: int) -> Floats:
    """A signal delayed by `late` samples, its first value held, shape (n,)."""
    return x if late <= 0 else np.concatenate((np.full(late, x[0]), x[:-late]))


def groups(pv: Floats, op: Floats, dt_s: float, late: int, memory: int) -> tuple[Group, ...]:
    """The features of a record, without groups that are constant.

    OP features are delayed by `late` samples, when PV begins to respond; rates and reversals count within the
    `memory` [samples] of the loop. All features are of the past: an innovation is part of its own PV, and through
    feedback of every later OP.
    """
    o, before = delayed(op, late + PAST), delayed(pv, PAST)
    direction, since = turns(o, least_turn(o))
    since_s, window = since * dt_s, min(max(memory // 4, 1), pv.size)
    travel = np.abs(o - delayed(o, window)) / (window * dt_s)
    fading = np.exp(-since_s / (max(memory, 2) * dt_s))
    rate = ranked(travel) - 0.5
    index = dt_s * np.arange(pv.size, dtype=np.float64)
    limit = at_limits(o).astype(float)
    found = [
        Group("pv_level", piecewise_linear_basis(before), before),
        Group("op_level", piecewise_linear_basis(o), o),
        Group("op_direction", direction[:, None], direction),
        Group("op_rate", np.stack([rate, rate * direction], axis=1), travel, direction),
        Group("after_reversals", np.stack([fading, fading * direction], axis=1), since_s, direction),
        Group("time_in_record", piecewise_linear_basis(index), index),
    ]
    if limit.sum() >= LIMIT_SAMPLES:
        found.append(Group("at_limits", limit[:, None], limit))
    return tuple(g for g in found if g.columns.shape[1] and float(np.ptp(g.columns)) > 0)


class Profile(NamedTuple):
    """Misfit along one feature: ends of each bin, samples, mean and mean square of innovations, shape (b,) each."""

    low: Floats
    high: Floats
    samples: Floats
    mean: Floats
    power: Floats


@dataclass(frozen=True, slots=True)
class Feature:
    """Relation of one feature to the misfit.

    p : p-value, corrected for all features; share : share of the variance of the misfit's power or sign explained by
    it alone; by : "power" or "sign", whichever is stronger; range : ends of the part of the feature's range in which
    the misfit is above its mean, none if it has no order.
    """

    name: str
    p: float
    share: float
    by: str
    range: tuple[float, ...] = ()

    @property
    def carries(self) -> bool:
        """Whether the misfit depends on this feature in addition to all others."""
        return self.p <= CHANCE


@dataclass(frozen=True, slots=True)
class Located:
    """The features, most significant first; local : power of the misfit explained by them at each sample, in mean
    squares, shape (n,), 0 where not judged; groups : the features as given, also where they were not tested."""

    features: tuple[Feature, ...]
    local: Floats = field(repr=False)
    groups: tuple[Group, ...] = field(repr=False)

    @property
    def carrying(self) -> tuple[Feature, ...]:
        """Features with a significant relation to the misfit."""
        return tuple(f for f in self.features if f.carries)


def standardized(e: Floats) -> Floats:
    """Power (cut) and sign of innovations about their mean, standardized, shape (n, 2)."""
    square = float(np.mean(e**2))
    power = np.minimum(e**2 / max(square, 1e-300), OUTLIER**2)
    sign = np.clip(e / max(math.sqrt(square), 1e-300), -OUTLIER, OUTLIER)
    y = np.stack([power, sign], axis=1)
    y -= y.mean(axis=0)
    return y / np.maximum(y.std(axis=0), 1e-12)


def directions(columns: list[Floats]) -> list[Floats]:
    """Part of each group's columns not explained by the others: orthonormal, shape (n, k) each; k = 0 if empty."""
    centred = [c - c.mean(axis=0) for c in columns]
    out = []
    for i, own in enumerate(centred):
        others = np.concatenate([c for j, c in enumerate(centred) if j != i] or [own[:, :0]], axis=1)
        residual = own - _along(_basis(others), own)
        out.append(_basis(residual, np.linalg.norm(own, axis=0).max()))
    return out


def _along(basis: Floats, x: Floats) -> Floats:
    return np.asarray(basis @ (basis.T @ x))


def _basis(x: Floats, scale: float | None = None) -> Floats:
    """Orthonormal directions of some columns, without those below a hundredth of their size."""
    if x.shape[1] == 0:
        return x
    u, s, _ = np.linalg.svd(x, full_matrices=False)
    return np.asarray(u[:, s > 0.03 * max(scale or s[0], 1e-12)])


def chances(bases: list[Floats], y: Floats, blocks: int) -> tuple[Floats, Floats]:
    """p-value of each group, corrected for all groups, (groups,), and each response's excess, (groups, 2).

    The largest excess over groups and responses is compared with that of every permutation of the blocks (Westfall
    and Young 1993, single step).
    """
    rng = np.random.default_rng(0)
    ends = np.cumsum([0, *(b.shape[1] for b in bases)])
    pairs = block_products(np.concatenate(bases, axis=1), y, blocks)
    here = np.arange(blocks)
    seen = _scores(pairs[here, here].sum(axis=0), ends)
    orders = (rng.permutation(blocks) for _ in range(ORDERS))
    null = np.stack([_scores(pairs[here, order].sum(axis=0), ends) for order in orders])
    middle, spread = null.mean(axis=0), np.maximum(null.std(axis=0), 1e-9)
    most, excess = ((null - middle) / spread).max(axis=(1, 2)), (seen - middle) / spread
    above = (most[None, :] >= excess.max(axis=1)[:, None]).sum(axis=1)
    return (1 + above) / (ORDERS + 1), excess


def block_products(flat: Floats, y: Floats, blocks: int) -> Floats:
    """Products of each block of the columns with each block of the responses, shape (blocks, blocks, k, 2)."""
    length = y.shape[0] // blocks
    left, right = (x[: blocks * length].reshape(blocks, length, -1) for x in (flat, y))
    return np.tensordot(left, right, axes=(1, 1)).transpose(0, 2, 1, 3)


def _scores(products: Floats, ends: np.ndarray) -> Floats:
    """Excess explained by the stacked bases for each response, nearly standard normal if independent, shape (groups,
    2).

    The cube root of a mean square is nearly normal (Wilson and Hilferty 1931).
    """
    square = np.concatenate((np.zeros((1, products.shape[1])), np.cumsum(products**2, axis=0)))
    k = np.maximum(np.diff(ends), 1)[:, None]
    mean_square = (square[ends[1:]] - square[ends[:-1]]) / k
    return np.asarray((np.cbrt(mean_square) - (1 - 2 / (9 * k))) / np.sqrt(2 / (9 * k)))


def profile(x: Floats, y: Floats) -> Profile:
    """Innovations y, in standard deviations, along a feature x, shape (n,) each, in bins of equal count."""
    parts, order = PROFILE_PARTS, np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    levels = np.flatnonzero(np.diff(x, prepend=x[0] - 1.0))
    if levels.size > parts:
        cuts = x[(np.arange(parts) * x.size) // parts]
        levels = np.unique(np.searchsorted(x, cuts))
    count = np.diff(np.append(levels, x.size))
    mean, power = (np.add.reduceat(w, levels) / count for w in (y, y**2))
    return Profile(x[levels], x[np.append(levels[1:], x.size) - 1], count.astype(np.float64), mean, power)


def part_of_range(height: Floats) -> tuple[int, int] | None:
    """First and last (inclusive) bin of the longest run of a profile well above its median; None without one."""
    line = 0.5 * float(height.max() + np.median(height))
    high = runs(height > line) if height.size >= 4 else []
    if not high:
        return None
    first, last = max(high, key=lambda run: height[run[0] : run[1]].sum())
    return int(first), int(last) - 1


def located(e: Floats, pv: Floats, op: Floats, judged: Mask, dt_s: float, late: int, memory: int) -> Located:
    """Where innovations e [% PV], shape (n,), are large or keep one sign; no location if the record is too short.

    late, memory : samples of dead time, and of dead time and time constant together.
    """
    count = int(judged.sum())
    wanted = max(BLOCK_MEMORIES * memory, SHORTEST_BLOCK)
    blocks = min(max(int(count / wanted), FEWEST_BLOCKS), MOST_BLOCKS)
    found, local, errors = groups(pv, op, dt_s, late, memory), np.zeros(e.size), e[judged]
    if count // blocks < max(memory, SHORTEST_BLOCK) or float(np.ptp(errors)) == 0.0:
        return Located((), local, found)
    columns, y = [g.columns[judged] for g in found], standardized(errors)
    bases, flat = directions(columns), np.concatenate(columns, axis=1)
    whole = _basis(flat - flat.mean(axis=0))
    scaled = errors / max(float(np.sqrt(np.mean(errors**2))), 1e-300)
    features = []
    for g, basis, p, excess in zip(found, bases, *chances(bases, y, blocks), strict=True):
        own, by = ((basis.T @ y) ** 2).sum(axis=0) / y.shape[0], int(np.argmax(excess))
        ends = _carrying_part(g, scaled, judged, by)
        features.append(Feature(g.name, float(p), float(own[by]), ("power", "sign")[by], ends))
    local[judged] = np.maximum(_along(whole, y[:, :1])[:, 0], 0.0)
    return Located(tuple(sorted(features, key=lambda f: (f.p, -f.share))), local, found)


def _carrying_part(g: Group, scaled: Floats, judged: Mask, by: int) -> tuple[float, ...]:
    """Ends of the part of a feature's range in which innovations are large (by 0) or keep one sign; or none."""
    drawn = profile(g.signal[judged], scaled if g.sense is None else scaled * g.sense[judged])
    run = part_of_range(drawn.power if by == 0 else np.abs(drawn.mean))
    return () if run is None else (float(drawn.low[run[0]]), float(drawn.high[run[1]]))
