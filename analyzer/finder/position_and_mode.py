"""Further tags of a loop: the position of its valve and the mode of its controller; none if several tags may be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analyzer.finder.law import TINY, Matrix

LIVE_SHARE = 0.02  # Share of the samples in which a PV or an OP moves at least: proofs/finder.md
POSITION = 0.4
"""Distance of a tag from OP, in spreads of OP, from which it is the position of the valve:
proofs/finder.md."""
POSITION_LATE = 3  # Samples by which a position follows OP at most [samples]: proofs/finder.md
POSITION_LAGS = 30  # Samples among which this lag is looked for [samples]: proofs/finder.md
NEXT_BEST_RATIO = 3.0  # How much farther any other tag must be: proofs/finder.md
MODE = 0.05  # Share of the samples in which a mode may disagree with the moves of OP: proofs/finder.md
MODE_VALUES = 6  # Values of a mode at most [values]: proofs/finder.md
MODE_CHANGES = 2  # Changes of a mode at least [changes]: proofs/finder.md
MODE_MOVES = 0.1  # Share of the samples in which OP moves in automatic at least: proofs/finder.md
MODE_REACH = 5.0  # Usual moves of OP that are missing before it counts as constant [moves]: proofs/finder.md


def positions(values: Matrix, outputs: Sequence[int], others: Sequence[int]) -> dict[int, int]:
    """The tag with the same values as an output except for backlash, in the output's own unit: by output, indices of
    tags in values, shape (n, tags)."""
    op, x = values[:, list(outputs)], values[:, list(others)]
    spread = np.maximum(op.std(axis=0)[:, None], TINY)
    power = (op**2).mean(axis=0)[:, None] + (x**2).mean(axis=0) - 2.0 * op.T @ x / len(values)
    away = np.sqrt(np.maximum(power, 0.0)) / spread
    away[:, x.std(axis=0) < TINY] = np.inf
    found = _alone(away, POSITION, lambda i, k: (outputs[i], others[k]))
    return {i: k for i, k in found.items() if _at_once(values[:, i], values[:, k])}


def _at_once(op: NDArray[np.float64], x: NDArray[np.float64]) -> bool:
    """Whether a tag is nearest to an output at most a few samples earlier: a process has a longer lag."""
    lags = range(min(POSITION_LAGS, len(op) // 2))
    away = [float(np.mean((x[k:] - op[: len(op) - k]) ** 2)) for k in lags]
    return bool(np.argmin(away) <= POSITION_LATE)


def modes(outputs: Mapping[int, NDArray[np.float64]], tags: Sequence[NDArray[np.float64]]) -> dict[int, int]:
    """The tag of which exactly one value coincides with a constant output: by output, index of the tag."""
    keys = list(outputs)
    off = np.array([[_disagreement(outputs[key], tag) for tag in tags] for key in keys])
    return _alone(off.reshape(len(keys), len(tags)), MODE, lambda i, k: (keys[i], k))


def may_be_mode(tag: NDArray[np.float64]) -> bool:
    """Whether a tag has few values and changes rarely."""
    changes = int((np.diff(tag) != 0).sum())
    seldom = MODE_CHANGES <= changes <= LIVE_SHARE * len(tag)
    return seldom and len(np.unique(tag)) <= MODE_VALUES


def _alone(away: Matrix, most: float, named: Callable[[int, int], tuple[int, int]]) -> dict[int, int]:
    """Rows and columns that are near each other, and near no other."""
    found = []
    for i, k in np.argwhere(away <= most):
        next_best = min(
            np.delete(away[i], k).min(initial=np.inf), np.delete(away[:, k], i).min(initial=np.inf)
        )
        if next_best >= max(NEXT_BEST_RATIO * float(away[i, k]), most):
            found.append(named(int(i), int(k)))
    return dict(found)


def _disagreement(op: NDArray[np.float64], tag: NDArray[np.float64]) -> float:
    """Share of the samples in which an output moves in manual or is constant in automatic, with manual the value of a
    tag at which it moves least; inf if the output hardly moves at the others, or the tag changes constantly."""
    values = np.unique(tag)
    moved = np.concatenate([[False], np.diff(op) != 0])
    shares = [float(moved[tag == value].mean()) for value in values]
    manual = tag == values[int(np.argmin(shares))]
    usual = float(moved[~manual].mean())
    if usual < MODE_MOVES:
        return np.inf
    reach = int(np.ceil(MODE_REACH / usual))
    constant = np.convolve(moved, np.ones(2 * reach + 1), "same") == 0
    near = np.convolve(np.concatenate([[False], np.diff(tag) != 0]), np.ones(4 * reach + 1), "same") > 0
    return float(np.mean((constant != manual)[~near])) if not near.all() else np.inf
