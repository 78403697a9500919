"""Each turn of OP as a trial of the valve: does a faulty valve explain what PV then did, again and again?

Log likelihood adds up over a record, and a few events, or one wrong assumption about the noise, can make much of it.
Between two turns of OP the stem of a faulty valve stands and slips once; there the gain of one model over another is
one trial, and the trials are as good as independent. A fault is believed where they agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identification.estimation.evidence import WindowFit, innovations, moves_begun
from identification.estimation.noise import judged
from identification.record import Floats
from identification.signals.robust import clipped_gain

TURN = 0.4
"""A turn of OP is one by this share of its usual range within a period [-]; ours: noise on OP turns by less."""
SMOOTHED = 12
"""Parts of a period over which OP is smoothed for its turns; ours."""


@dataclass(frozen=True, slots=True)
class Trials:
    """How trials agree that one model is better than another.

    count; agreeing, share of them in which it is [-]; steadiness, mean gain over its standard error [-].
    """

    count: int
    agreeing: float
    steadiness: float


@njit(cache=True)
def turning_points(x: Floats, size: float) -> np.ndarray:
    """Samples at which a signal, shape (n,), turns by more than a size, shape (t,)."""
    out = np.empty(x.size, dtype=np.int64)
    count, high, low, way = 0, 0, 0, 0
    for k in range(x.size):
        if way >= 0 and x[k] > x[high]:
            high = k
        if way <= 0 and x[k] < x[low]:
            low = k
        if way >= 0 and x[high] - x[k] >= size:
            out[count] = high
            count, way, low = count + 1, -1, k
        elif way <= 0 and x[k] - x[low] >= size:
            out[count] = low
            count, way, high = count + 1, 1, k
    return out[:count]


def _usual_range(x: Floats, length: int) -> float:
    """Median range within stretches of a length [samples]."""
    rows = x.size // length
    if rows < 2:
        return float(np.ptp(x))
    return float(np.median(np.ptp(x[: rows * length].reshape(rows, length), axis=1)))


def turns_of(op: Floats, period: float) -> np.ndarray:
    """Samples at which OP, shape (n,), turns in a cycle of that period [samples], shape (t,)."""
    half = max(int(period / (2 * SMOOTHED)), 1)
    kernel = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    smooth = np.convolve(np.pad(op, half, mode="edge"), kernel, mode="valid")
    return turning_points(smooth, max(TURN * _usual_range(smooth, max(round(period), 2)), 1e-12))


def gains(ours: WindowFit, theirs: WindowFit) -> Floats:
    """Gain in log likelihood of one fit over another at every block [nat], shape (n,), outliers cut."""
    counts = judged(ours.window.usable, ours.fit.ar.size)
    mine, other = innovations(ours.window, ours.fit), innovations(theirs.window, theirs.fit)
    out = np.zeros(ours.window.y.size)
    out[counts] = clipped_gain(mine, other)
    return out


def trials(ours: WindowFit, theirs: WindowFit, period_s: float) -> Trials | None:
    """Agreement of the stretches between OP's turns that one fit explains PV better; None with fewer than four."""
    window = ours.window
    at = turns_of(window.op_blocks, period_s / window.dt_s)
    if at.size < 5:
        return None
    return _agreement(np.add.reduceat(gains(ours, theirs), at)[:-1])


def _agreement(gained: Floats) -> Trials:
    """How stretches agree of their gains, shape (t,), t > 1."""
    spread = float(gained.std(ddof=1)) / math.sqrt(gained.size)
    return Trials(gained.size, float((gained > 0).mean()), float(gained.mean()) / max(spread, 1e-9))


def trials_between_moves(ours: WindowFit, theirs: WindowFit) -> Trials | None:
    """The same of the stretches that the moves of our valve's stem part, for a loop without cycles; None without a
    move."""
    at = moves_begun(ours.window, ours.fit.valve)
    at = at[at > 0]
    return _agreement(np.add.reduceat(gains(ours, theirs), np.append(0, at))) if at.size else None
