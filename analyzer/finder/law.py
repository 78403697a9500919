"""Test of the control law between the moves of two tags, for all pairs of tags at once.

A PI controller moves OP by -Kp (dPV + 1/Ti int (PV - SP) dt). Between the averages of neighbouring blocks of samples
the same law relates the moves of both and the moves of the running integral, for any block length. The noise of PV
acts on OP in the same sample, which is impossible for a process, because it lags: so the innovations of both are also
compared (Haugh 1976, J. Am. Stat. Assoc. 71: cross-correlation of prewhitened series).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WIDTHS = (1, 4, 16, 64)
"""Lengths of the blocks of samples between whose averages moves are compared [samples]: proofs/finder.md;
noise of a recorder shrinks in blocks, and a law does not."""
LEAST_BLOCKS = 150  # Blocks that a length must leave [blocks]: proofs/finder.md
PAST = 4  # Moves of a tag's own past that are removed from its innovations [blocks]: proofs/finder.md

Matrix = NDArray[np.float64]
TINY = 1e-12
"""Length of a column below which it is rounding."""
ALIKE = 1e-6
"""Least share by which moves and integral must differ."""


@dataclass(frozen=True, slots=True)
class Moves:
    """Moves of block averages and of the running integrals of tags, means removed, shape (blocks - 1, tags), and the
    innovations of the moves, without the part explained by each tag's own past."""

    value: Matrix
    integral: Matrix
    innovation: Matrix

    @classmethod
    def of(cls, values: Matrix, width: int) -> Moves:
        """From values, shape (n, tags), in blocks of `width` samples."""
        plain = cls.plain(values, width)
        return cls(plain.value, plain.integral, innovations(plain.value))

    @classmethod
    def plain(cls, values: Matrix, width: int) -> Moves:
        """Without innovations, which take most of the time."""
        centred = values - values.mean(axis=0)
        running = np.cumsum(centred, axis=0) - centred / 2
        value, integral = (np.diff(blocks(x, width), axis=0) for x in (centred, running))
        value, integral = value - value.mean(axis=0), integral - integral.mean(axis=0)
        return cls(value, integral, np.empty((0, value.shape[1])))

    def at(self, rows: NDArray[np.int64]) -> Moves:
        """Some of the moves, with innovations for those that are late enough."""
        late = rows[rows >= PAST]
        return Moves(self.value[late], self.integral[late], self.innovation[late - PAST])

    def of_tags(self, count: int) -> Moves:
        """The first tags alone."""
        return Moves(self.value[:, :count], self.integral[:, :count], self.innovation[:, :count])


def widths(samples: int) -> tuple[int, ...]:
    """Lengths of blocks [samples] for which there are enough blocks."""
    return tuple(w for w in WIDTHS if samples // w >= LEAST_BLOCKS) or (1,)


def explained_share(causes: Moves, effects: Moves) -> Matrix:
    """Share of the moves of each effect explained by the law from each cause, shape (causes, effects), 0 to 1."""
    moved, summed, wanted = _unit(causes.value), _unit(causes.integral), _unit(effects.value)
    return _share(moved.T @ wanted, summed.T @ wanted, (moved * summed).sum(axis=0)[:, None])


def explained_either_way(moves: Moves, count: int) -> Matrix:
    """The larger of `explained_share` of the first `count` tags from each, and of each from the first `count`, shape
    (tags, count)."""
    value, summed = _unit(moves.value), _unit(moves.integral)
    cross, alike = (value * summed).sum(axis=0), value.T @ value[:, :count]
    forth = _share(alike, summed.T @ value[:, :count], cross[:, None])
    return np.maximum(forth, _share(alike, value.T @ summed[:, :count], cross[:count]))


def _share(a: Matrix, b: Matrix, c: Matrix) -> Matrix:
    """Share that a move and an integral explain: correlation of the effect with each, and of both."""
    return np.clip((a**2 + b**2 - 2 * a * b * c) / np.maximum(1 - c**2, ALIKE), 0.0, 1.0)


def explained_by_errors(moves: Moves, set_points: Sequence[int], effects: Sequence[int]) -> Matrix:
    """Share of the moves of effects explained by the law from the error of each tag at that effect's set point, shape
    (tags, effects): `explained_share` of the differences, from products of the tags alone."""
    value, summed = moves.value, moves.integral
    wanted = _unit(value[:, list(effects)])
    sp_value, sp_summed = value[:, list(set_points)], summed[:, list(set_points)]

    a = value.T @ wanted - (sp_value * wanted).sum(axis=0)
    b = summed.T @ wanted - (sp_summed * wanted).sum(axis=0)
    cross = (value * summed).sum(axis=0)[:, None] + (sp_value * sp_summed).sum(axis=0)
    cross = cross - value.T @ sp_summed - summed.T @ sp_value
    one, other = _size(value, sp_value), _size(summed, sp_summed)
    return _share(a / one, b / other, cross / (one * other))


def _size(x: Matrix, y: Matrix) -> Matrix:
    """Lengths of the differences of the columns of x and y, shape (columns of x, columns of y), inf where they are
    rounding."""
    both = (x**2).sum(axis=0)[:, None] + (y**2).sum(axis=0)
    squared = both - 2.0 * x.T @ y
    return np.where(squared > TINY * both, np.sqrt(np.maximum(squared, 0.0)), np.inf)


def shared_noise(causes: Moves, effects: Moves) -> Matrix:
    """Squared correlation of the innovations in the same block, shape (causes, effects)."""
    return (_unit(causes.innovation).T @ _unit(effects.innovation)) ** 2


def direction(moves: Moves, pv: int, op: int, rows: NDArray[np.int64]) -> float:
    """Evidence of some rows of the moves for a controller from `pv` to `op` rather than from `op` to `pv`, in
    standard errors.

    In a controller moves and integral have one sign. In the reverse direction they differ: the response of OP to PV's
    noise has the sign of the controller, that of PV to OP the process's, and feedback makes them opposite.
    """

    def agreeing(cause: int, effect: int) -> float:
        columns = moves.value[rows, cause], moves.integral[rows, cause], moves.integral[rows, effect]
        slope, error = fitted(moves.value[rows, effect], *columns)
        return float(slope[1] / error[1] * np.sign(slope[0]))

    return agreeing(pv, op) - agreeing(op, pv)


def fitted(wanted: Matrix, *columns: Matrix) -> tuple[Matrix, Matrix]:
    """Slopes of a linear regression without a constant, and their standard errors."""
    x = np.column_stack(columns)
    slope, *_ = np.linalg.lstsq(x, wanted, rcond=None)
    residual = wanted - x @ slope
    inverse = np.linalg.pinv(x.T @ x)
    variance = residual @ residual / max(len(wanted) - x.shape[1], 1)
    return np.asarray(slope), np.sqrt(np.maximum(np.diag(inverse) * variance, TINY))


def blocks(values: Matrix, width: int) -> Matrix:
    """Averages of neighbouring samples, shape (blocks, tags)."""
    whole = len(values) // width * width
    return np.asarray(values[:whole].reshape(whole // width, width, values.shape[1]).mean(axis=1))


def _unit(columns: Matrix) -> Matrix:
    """Columns of length one; of a constant one zeros."""
    size = np.sqrt((columns**2).sum(axis=0))
    return columns / np.where(size > TINY, size, np.inf)


def innovations(value: Matrix) -> Matrix:
    """Residual of moves, shape (n, tags), not explained by each tag's own past; shape (n - past, tags)."""
    out = np.empty((len(value) - PAST, value.shape[1]))
    for k in range(value.shape[1]):
        lagged = np.column_stack([value[PAST - 1 - i : len(value) - 1 - i, k] for i in range(PAST)])
        slope, *_ = np.linalg.lstsq(lagged.T @ lagged, lagged.T @ value[PAST:, k], rcond=None)
        out[:, k] = value[PAST:, k] - lagged @ slope
    return out
