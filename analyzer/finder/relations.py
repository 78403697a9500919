"""Relations of found loops beyond their own tags: a set point in ratio to another loop's PV, outputs that share a
valve, and when a controller acts. All are candidates to be checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
"""Share of the time in which outputs with a common valve are equal: beyond it they are never, or one signal."""
AS_ONE = 0.8
"""Least share of the moves of an output, equal to another, after which it is equal again; ours: most, for a
controller that tracks is equal until it takes the valve."""
HALF = 0.9999
"""Least squared correlation of a half of a split range with the controller's output where it is at no limit."""
MASTER, NEXT = 0.99, 0.97
"""Least squared correlation of a set point with its master's output, and largest one with another output; ours:
rounding of both leaves .002 in the mill's cascade, and outputs of one oscillation are less alike."""


def ratio_to(sp: Matrix, pvs: Matrix) -> int | None:
    """The PV, a column of shape (n, k), to which a set point that moves, shape (n,), keeps a ratio; None if none."""
    spread = float(sp.var())
    if spread <= TINY or not pvs.size:
        return None
    ratio = sp @ pvs / np.maximum((pvs**2).sum(axis=0), TINY)
    left = ((sp[:, None] - ratio * pvs) ** 2).mean(axis=0) / spread
    best = int(np.argmin(left))
    return best if left[best] <= IN_RATIO else None


def output_behind(sp: Matrix, outputs: Matrix) -> int | None:
    """The output, a column of shape (n, k), that a set point that moves, shape (n,), is in another scale; None if
    none."""
    if not outputs.size or float(sp.var()) <= TINY:
        return None
    agree = _correlation(outputs, sp)
    best = int(np.argmax(agree))
    alone = np.delete(agree, best).max(initial=0.0) <= NEXT
    return best if agree[best] >= MASTER and alone else None


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
        agree = _correlation(outputs[free], x[free])
        best = int(np.argmax(agree))
        if agree[best] >= HALF:
            found.setdefault(best, []).append(k)
    return found


def _correlation(columns: Matrix, x: Matrix) -> NDArray[np.float64]:
    """Squared correlation of each column with a signal."""
    a, b = columns - columns.mean(axis=0), x - x.mean()
    size = np.maximum((a**2).sum(axis=0) * float(b @ b), TINY)
    return np.asarray((a.T @ b) ** 2 / size)
