"""Set point of a controlled tag, and which of two related tags is OP.

A controller with an integral keeps PV at SP: the mean of PV, and the level of PV at which OP is constant, are equal
to SP, and the slow moves of PV are those of SP. OP follows the load instead: it drifts, and reaches its limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from analyzer.finder.law import PAST, TINY, Matrix, Moves, blocks, explained_share, fitted, shared_noise
from analyzer.finder.position_and_mode import POSITION

LEAST_MOVES = 100  # Moves of a tag below which it is neither PV nor OP [moves]: proofs/finder.md
SLOW_BLOCKS = 300
"""Blocks whose averages show whether one tag follows another about its level [blocks]: proofs/finder.md."""
CERTAIN = 4.0  # Largest weight of one sign of which of two tags is OP: proofs/finder.md
NEAREST = 0.001
"""Distance of a set point from the mean of PV, in spreads of PV, below which all count as equally near:
proofs/finder.md."""
DRIFT_BLOCKS = 100  # Blocks whose averages show which of two tags drifts [blocks]: proofs/finder.md
LIMITED_SHARE = 0.01  # Share of the samples at an extreme from which a tag is at rest there: proofs/finder.md
LIMITED_VALUES = 50
"""Values of a tag from which rest at an extreme is not due to a coarse record [values]: proofs/finder.md."""
REPEATS = 0.99
"""Squared correlation of moves in the same sample from which a tag repeats a set point: proofs/finder.md."""
AT_LIMIT = 0.001  # Share of OP's range next to its extremes in which it may be at a limit: proofs/finder.md


def nearness(values: Matrix, tags: Sequence[int], set_points: Sequence[int]) -> Matrix:
    """Evidence for each set point as that of each tag, shape (tags, set points), natural log: the spread of the tag
    over the distance of the means, and the slow moves of the tag over those of its error."""
    x, s = values[:, list(tags)], values[:, list(set_points)]
    near = closeness(np.abs(x.mean(axis=0)[:, None] - s.mean(axis=0)), x.std(axis=0)[:, None])
    return near + tracked(x, s)


def long_blocks(values: Matrix) -> Matrix:
    """Averages over blocks so long that drifting tags show their drift, shape (blocks, tags)."""
    return blocks(values, max(len(values) // DRIFT_BLOCKS, 1))


def deviation_of_mean(slow: Matrix) -> Matrix:
    """Standard errors of the means of drifting tags from their averages over long blocks, shape (blocks, tags)."""
    return np.asarray(slow.std(axis=0) / np.sqrt(len(slow)))


def by_chance(x: Matrix, level: Matrix, slow: Matrix) -> Matrix:
    """Part of the nearness of a tag's mean to set points that is due to chance: a distance below its standard error
    is no further evidence.

    x : shape (n,); level : mean of each set point, shape (set points,); slow : averages of the tag's error at each
    set point over long blocks, shape (blocks, set points).
    """
    away, error = np.abs(x.mean() - level), deviation_of_mean(slow)
    return closeness(away, x.std()) - closeness(np.maximum(away, error), x.std())


def closeness(away: Matrix, spread: Matrix | float) -> Matrix:
    """Log of a spread over a distance, 0 if the distance is larger."""
    return np.asarray(-np.log(np.clip(away / np.maximum(spread, TINY), NEAREST, 1.0)))


def nearness_margin(x: Matrix, level: Matrix, near: Matrix) -> float:
    """How much nearer a tag is to the nearest set point than to the next one at another level, natural log: for
    levels unrelated to the tag the distance exceeds this with odds exp(-this).

    x : shape (n,); level, near : mean of each set point and its nearness, shape (set points,).
    """
    best = int(np.argmax(near))
    others = level != level[best]
    if near[best] <= 0.0 or not others.any():
        return max(float(near[best]), 0.0)
    beyond = np.abs(level[others] - x.mean()).min() / x.std()
    more = near[best] - max(float(near[others].max()), 0.0)
    return float(more + np.log(np.clip(beyond, 1.0, 1.0 / NEAREST)))


def tracked(x: Matrix, s: Matrix) -> Matrix:
    """Log of the slow moves of tags over those of their errors, shape (tags, set points); 0 if SP is constant."""
    width = max(len(x) // SLOW_BLOCKS, 1)
    x, s = (blocks(v, width) for v in (x, s))
    x, s = x - x.mean(axis=0), s - s.mean(axis=0)
    own, moved = (x**2).mean(axis=0)[:, None], (s**2).mean(axis=0)
    residual = own + moved - 2.0 * x.T @ s / len(x)
    size = 0.5 * np.log(np.maximum(own, TINY) / np.maximum(residual, TINY))
    return np.asarray(np.clip(np.where(moved > TINY, size, 0.0), -CERTAIN, CERTAIN))


def resting_level(pv: Matrix, op: Matrix, width: int) -> tuple[float, float]:
    """Level of PV at which OP is constant by the law, and its standard error, from rows without OP at a limit, shape
    (n,); the error is inf if too few remain."""
    x, rows = pv - pv.mean(), free_moves(op, width)
    if len(rows) < LEAST_MOVES:
        return 0.0, np.inf
    columns = np.column_stack([x, np.cumsum(x) - x / 2, op])
    moved, summed, wanted = np.diff(blocks(columns, width), axis=0)[rows].T
    slope, error = fitted(wanted, moved, summed, np.ones(len(rows)))
    level = -slope[2] / (slope[1] or TINY)
    off = np.hypot(error[2], level * error[1]) / (abs(slope[1]) or TINY)
    return float(pv.mean() + level / width), float(off / width)


def free_moves(op: Matrix, width: int) -> NDArray[np.int64]:
    """Indices of the moves between blocks of so many samples, both without OP, shape (n,), at a limit."""
    margin = AT_LIMIT * np.ptp(op)
    limited = (op <= op.min() + margin) | (op >= op.max() - margin)
    within = blocks(limited[:, None].astype(float), width)[:, 0] == 0.0
    return np.flatnonzero(within[1:] & within[:-1])


def alike(values: Matrix) -> NDArray[np.bool_]:
    """Which tags have the same level and the same moves, shape (tags, tags): a stem and its output, two sensors, a PV
    and the SP that it tracks; none is the PV of the other."""
    x, moves = values - values.mean(axis=0), np.diff(values, axis=0)
    spread, mean = x.std(axis=0), values.mean(axis=0)
    cross = x.T @ x / len(x)
    away = spread[:, None] ** 2 + spread**2 - 2.0 * cross + (mean[:, None] - mean) ** 2
    near = away <= (POSITION * np.minimum.outer(spread, spread)) ** 2
    return np.asarray(near & (moves.T @ moves > 0.0))


def at_no_limit(held: Matrix, width: int) -> NDArray[np.int64]:
    """Moves between blocks without a tag at a limit, for those of `held` that rest at limits at all."""
    free = [free_moves(x, width) for x in held.T if limited(x)]
    return reduce(np.intersect1d, free, np.arange(len(held) // width - 1))


def law_of(held: Matrix, each: Sequence[int]) -> tuple[Matrix, Matrix]:
    """Share of PV and OP that the law explains, in both directions, and the common share of their innovations, by
    width; from moves without limits, if there are enough."""
    law, noise = np.empty(len(each)), np.empty(len(each))
    for k, width in enumerate(each):
        moves, rows = Moves.of(held, width), at_no_limit(held, width)
        some = moves.at(rows) if LEAST_MOVES + PAST <= len(rows) < len(moves.value) else moves
        law[k] = max(explained_share(some, some)[0, 1], explained_share(some, some)[1, 0])
        noise[k] = shared_noise(some, some)[0, 1]
    return law, noise


def slower(pv: Matrix, op: Matrix) -> float:
    """Log of the slow share of OP's variance over that of PV's: feedback removes slow moves from PV."""
    share = []
    for x in (op, pv):
        width = max(len(x) // DRIFT_BLOCKS, 1)
        share.append(max(float(blocks(x[:, None], width).var() / max(x.var(), TINY)), TINY))
    return float(np.log(share[0] / share[1]))


def limited(x: Matrix) -> bool:
    """Whether a tag rests at one of its extremes although it moves freely: an output at its limit."""
    at = max((x == x.min()).mean(), (x == x.max()).mean())
    return bool(at > LIMITED_SHARE and len(np.unique(x)) > LIMITED_VALUES)


def answers(values: Matrix, tags: Sequence[int], set_points: Sequence[int]) -> Matrix:
    """Significance of each tag's move with each set point in the same sample or the next, in standard errors, shape
    (tags, set points); 0 if it only repeats it. The proportional action does so; a process lags."""
    x, s = (np.diff(values[:, list(of)], axis=0) for of in (tags, set_points))
    length = np.outer(np.sqrt((x**2).sum(axis=0)), np.sqrt((s**2).sum(axis=0))) + TINY
    now, later = x.T @ s / length, x[1:].T @ s[:-1] / length
    share = np.maximum(np.where(now**2 > REPEATS, 0.0, np.abs(now)), np.abs(later))
    return np.asarray(share * np.sqrt(len(x) / (1.0 - np.minimum(share**2, 1.0 - TINY))))
