"""What a loop was doing at each sample: the features on which a misfit is laid out, in named groups."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.ndimage import binary_opening

from identification.record import Floats, Mask
from identification.signals.robust import robust_deviation

PIECES = 4
"""Straight pieces over a level or over time; ours: a step at any place is followed, ten columns are not spent."""
TURN_SHARE = 0.01
"""Least travel back, in terms of OP's range, that counts as a turn; ours: less tells nothing of a valve."""
TURN_NOISE = 4.0
"""The same in robust standard deviations of OP's change per sample, so that noise alone turns nothing."""
PAST = 2
"""Samples by which features are older than the innovation; ours: one, and one for what looks at a neighbour."""
LIMIT = 0.05
"""Distance from 0 or 100 % of OP that counts as at the limit [% OP]; a historian rounds to that."""
FEWEST_LEVELS = 12
"""Values that OP must take for an end of its own range to be a limit; a test signal between two is at none."""
FEWEST_AT_LIMIT = 10
"""Samples at a limit below which there is nothing to be told of them."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What OP does, shape (n,) each: direction (-1, 0, 1), travel over a window [% OP/s], time since its turn [s]."""

    direction: Floats
    rate: Floats
    since_turn: Floats


@dataclass(frozen=True, slots=True)
class Group:
    """Columns that stand for one question, shape (n, k), and the signal they are of, shape (n,), for its profile.

    sense : OP's direction where a bias is counted along it, shape (n,), else None.
    """

    name: str
    columns: Floats
    signal: Floats
    sense: Floats | None = None


@njit(cache=True)
def turns(op: Floats, least: float) -> tuple[Floats, Floats]:
    """Direction of OP (-1, 0, 1) and samples since it last turned, shape (n,) each.

    A turn counts once OP has gone back from its extreme by `least` [% OP], and from then on: what OP does later must
    not be known, for under feedback it answers the very innovation that is to be located.
    """
    n = op.size
    way, since = np.zeros(n), np.zeros(n)
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
        way[k], since[k] = now, k - at
    return way, since


def least_turn(op: Floats) -> float:
    """Travel back that counts as a turn of OP [% OP]."""
    change = np.diff(op)
    noise = robust_deviation(change - np.median(change)) if change.size else 0.0
    low, high = np.quantile(op, [0.01, 0.99])
    return max(TURN_SHARE * float(high - low), TURN_NOISE * noise, 1e-6)


def motion(op: Floats, dt_s: float, window: int) -> Motion:
    """What OP does.

    Parameters
    ----------
    op : ndarray of shape (n,)
        OP [% OP].
    dt_s : float
        Sample interval [s].
    window : int
        Samples over which a rate is taken, >= 1.
    """
    way, since = turns(op, least_turn(op))
    back = np.concatenate((np.full(window, op[0]), op[: op.size - window]))[: op.size]
    return Motion(way, np.abs(op - back) / (window * dt_s), since * dt_s)


def hats(x: Floats, pieces: int = PIECES) -> Floats:
    """Straight pieces between even quantiles of a signal, shape (n, k), k <= pieces; none where it stands still."""
    knots = np.unique(np.quantile(x, np.linspace(0.02, 0.98, pieces + 1)))
    if knots.size < 2:
        return np.zeros((x.size, 0))
    return np.stack([np.interp(x, knots, row) for row in np.eye(knots.size)[1:]], axis=1)


def ranked(x: Floats) -> Floats:
    """Ranks from 0 to 1, shape (n,), equal values alike."""
    levels, at = np.unique(x, return_inverse=True)
    return at / max(levels.size - 1, 1)


def at_limits(op: Floats) -> Mask:
    """True where OP is at 0 or 100 %, or stands at an end of its own range for three samples, shape (n,)."""
    out = (op <= LIMIT) | (op >= 100.0 - LIMIT)
    ends = (op.max(), op.min()) if np.unique(op).size > FEWEST_LEVELS else ()
    for end in ends:
        out |= binary_opening(op == end, np.ones(3))
    return out


def delayed(x: Floats, late: int) -> Floats:
    """A signal that many samples later, its first value held, shape (n,)."""
    return x if late <= 0 else np.concatenate((np.full(late, x[0]), x[:-late]))


def groups(pv: Floats, op: Floats, dt_s: float, late: int, memory: int) -> tuple[Group, ...]:
    """The features of a record, each group as far as there is anything in it.

    Parameters
    ----------
    pv, op : ndarray of shape (n,)
        PV [% PV] and OP [% OP].
    dt_s : float
        Sample interval [s].
    late : int
        Samples after which PV begins to answer OP; OP's features are taken that much later. All features are of the
        past: an innovation is part of its own PV, and feedback makes it part of every later OP.
    memory : int
        Samples that the loop remembers: time constant and dead time.
    """
    o, before = delayed(op, late + PAST), delayed(pv, PAST)
    m = motion(o, dt_s, max(memory // 4, 1))
    fading = np.exp(-m.since_turn / (max(memory, 2) * dt_s))
    rate = ranked(m.rate) - 0.5
    index = dt_s * np.arange(pv.size, dtype=np.float64)
    limit = at_limits(o)
    found = (
        Group("pv_level", hats(before), before),
        Group("op_level", hats(o), o),
        Group("op_direction", m.direction[:, None], m.direction),
        Group("op_rate", np.stack([rate, rate * m.direction], axis=1), m.rate, m.direction),
        Group("after_reversals", np.stack([fading, fading * m.direction], axis=1), m.since_turn, m.direction),
        Group("time_in_record", hats(index), index),
        Group("at_limits", limit[:, None].astype(float), limit.astype(float)),
    )
    alive = [g for g in found if g.columns.shape[1] and float(np.ptp(g.columns)) > 0]
    return tuple(g for g in alive if g.name != "at_limits" or limit.sum() >= FEWEST_AT_LIMIT)
