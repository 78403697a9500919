"""Relations of found loops beyond their own tags: a set point in ratio to another loop's PV, outputs that share a
valve, and when a controller acts. All are candidates to be checked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analyzer.finder.held import limited
from analyzer.finder.law import TINY, Matrix

IN_RATIO = 0.01
"""Largest share of a set point's variance that a ratio to a PV leaves; ours: recorders differ by less."""
SCANS = 60
"""Longest scan [samples] that is looked for."""
ON_SCAN = 0.98
"""Least share of the moves of an output that are whole scans apart; ours: few are lost by rounding."""
MOVES = 50
"""Moves of an output that show its scan, or a rest; ours."""
REST = 20
"""Length of a rest in usual times between two moves; ours."""
COMPARED = 200
"""Samples at which outputs are compared."""
SHARED = (0.05, 0.95)
"""Range of the share of time in which two outputs with a common valve are equal. Below it they are
unrelated; above it they are one signal."""
AS_ONE = 0.8
"""Least share of the moves of an output, equal to another, after which it is equal again; ours: most, for a
controller that tracks is equal until it takes the valve."""
HALF = 0.9999
"""Least squared correlation of a half of a split range with the controller's output where it is at no limit."""
MASTER, NEXT = 0.99, 0.97
"""Least squared correlation of a set point with its master's output, and largest one with another output; ours:
rounding of both leaves .002 in the mill's cascade, and outputs of one oscillation are less alike."""


def ratios_to(set_points: Matrix, pvs: Matrix, own: Sequence[int]) -> list[int | None]:
    """Of each set point that moves, shape (n, m), the PV, a column of shape (n, k), to which it keeps a ratio; None
    if none. own : the columns of the loops' own PVs."""
    power, spread = (set_points**2).mean(axis=0), set_points.var(axis=0)
    both = set_points.T @ pvs / len(pvs)
    residual_power = power[:, None] - both**2 / np.maximum((pvs**2).mean(axis=0), TINY)
    residual_power /= np.maximum(spread, TINY)[:, None]
    residual_power[np.arange(len(own)), own] = np.inf
    best = residual_power.argmin(axis=1)
    kept = (spread > TINY) & (residual_power.min(axis=1) <= IN_RATIO)
    return [int(k) if good else None for k, good in zip(best, kept, strict=True)]


def masters_of(set_points: Matrix, outputs: Matrix, own: Sequence[int]) -> list[int | None]:
    """The output, a column of shape (n, k), of which each moving set point, shape (n, m), is a scaled copy.
    None if there is none, or if several outputs are alike. own : the columns of the loops' own outputs."""
    agree = _correlations(set_points, outputs)
    agree[np.arange(len(own)), own] = 0.0
    best = agree.argmax(axis=1)
    first = agree[np.arange(len(best)), best]
    agree[np.arange(len(best)), best] = 0.0
    alone = (first >= MASTER) & (agree.max(axis=1) <= NEXT)
    return [int(k) if good else None for k, good in zip(best, alone, strict=True)]


def scan_of(op: Matrix) -> int | None:
    """Samples between two actions of a controller, from the times at which its output, shape (n,), moves; None if it
    moves at any sample, or too seldom."""
    gaps = np.diff(np.flatnonzero(np.diff(op) != 0.0))
    if gaps.size < MOVES:
        return None
    return next((k for k in range(SCANS, 1, -1) if np.mean(gaps % k == 0) >= ON_SCAN), None)


def at_rest(op: Matrix) -> float:
    """Share of the time in which an output, shape (n,), rests far longer than usual: in manual, or at a limit."""
    moved = np.flatnonzero(np.diff(op) != 0.0)
    if moved.size < MOVES:
        return 1.0
    gaps = np.diff(np.concatenate(([-1], moved, [op.size - 1])))
    return float(gaps[gaps > REST * max(float(np.median(gaps)), 1.0)].sum() / op.size)


def equal_at_times(outputs: Matrix) -> list[tuple[int, int]]:
    """Pairs of outputs, columns of shape (n, k), that are equal for a part of the time: candidates for a select."""
    rows = outputs[np.unique(np.linspace(0, len(outputs) - 1, COMPARED).astype(int))]
    equal = np.zeros((outputs.shape[1],) * 2)
    for row in rows:
        equal += np.equal.outer(row, row)
    share = equal / len(rows)
    near = (share >= SHARED[0]) & (share <= SHARED[1])
    return [(int(i), int(j)) for i, j in np.argwhere(near) if i < j and _move_as_one(outputs[:, [i, j]])]


def _move_as_one(pair: Matrix) -> bool:
    """Whether two outputs that are equal mostly stay so when one moves: others meet by chance, or rest at 0."""
    same, moved = pair[:, 0] == pair[:, 1], np.diff(pair[:, 0]) != 0.0
    met, kept = same[:-1] & moved, same[:-1] & same[1:] & moved
    return int(kept.sum()) >= MOVES and bool(kept.sum() >= AS_ONE * met.sum())


def halves(outputs: Matrix, others: Matrix) -> dict[int, list[int]]:
    """Tags, columns of shape (n, m), that follow an output, a column of shape (n, k), wherever they are at no limit,
    by output: halves of its split range."""
    found: dict[int, list[int]] = {}
    for k in range(others.shape[1]):
        x = others[:, k]
        free = (x > x.min()) & (x < x.max())
        if not limited(x) or not SHARED[0] <= free.mean() <= SHARED[1]:
            continue
        agree = _correlations(x[free, None], outputs[free])[0]
        best = int(np.argmax(agree))
        if agree[best] >= HALF:
            found.setdefault(best, []).append(k)
    return found


def _correlations(x: Matrix, y: Matrix) -> Matrix:
    """Squared correlation of each column of x, shape (n, m), with each of y, shape (n, k), 0 of a constant."""
    a, b = x - x.mean(axis=0), y - y.mean(axis=0)
    size = np.outer((a**2).sum(axis=0), (b**2).sum(axis=0))
    return np.where(size > TINY, (a.T @ b) ** 2 / np.maximum(size, TINY), 0.0)
