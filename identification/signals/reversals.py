"""OP reversals and the half-cycles after them, superimposed, with the part in which the stem is at rest."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numba import njit

from identification.record import Floats, Mask

TURN = 0.4  # Least OP reversal, as a share of OP's usual range within a period: noise on OP turns by less
SMOOTHED = 12  # Parts of a period over which OP is smoothed to find its reversals

POINTS = 40
"""Points of a half-cycle of usual length; ours: enough to show a corner."""
LONGEST = 2.0
"""Half-cycles are cut at this many usual lengths [-]; ours."""


@njit(cache=True)
def turning_points(x: Floats, size: float) -> np.ndarray:
    """Samples at which a signal, shape (n,), reverses by more than a size, shape (t,)."""
    out = np.empty(x.size, dtype=np.int64)
    count, high, low, direction = 0, 0, 0, 0
    for k in range(x.size):
        if direction >= 0 and x[k] > x[high]:
            high = k
        if direction <= 0 and x[k] < x[low]:
            low = k
        if direction >= 0 and x[high] - x[k] >= size:
            out[count] = high
            count, direction, low = count + 1, -1, k
        elif direction <= 0 and x[k] - x[low] >= size:
            out[count] = low
            count, direction, high = count + 1, 1, k
    return out[:count]


def _usual_range(x: Floats, length: int) -> float:
    """Median range within stretches of a length [samples]."""
    rows = x.size // length
    if rows < 2:
        return float(np.ptp(x))
    return float(np.median(np.ptp(x[: rows * length].reshape(rows, length), axis=1)))


def op_reversals(op: Floats, period: float) -> np.ndarray:
    """Samples of OP reversals, shape (t,), in a cycle of a period [samples]; op of shape (n,)."""
    half = max(int(period / (2 * SMOOTHED)), 1)
    kernel = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    smooth = np.convolve(np.pad(op, half, mode="edge"), kernel, mode="valid")
    return turning_points(smooth, max(TURN * _usual_range(smooth, max(round(period), 2)), 1e-12))


@dataclass(frozen=True, slots=True)
class HalfCycle:
    """One half-cycle after an OP reversal.

    start_s : time of the reversal, from the record's start [s]; op, pv, late : OP, PV, and PV delayed by the dead
    time, every `step_s` after the reversal [% of OP, % of span], shape (k,) each; stuck : first and last (excluded)
    of the points at which OP has not yet moved by the stickband and PV has settled from earlier moves.
    """

    start_s: float
    step_s: float
    op: Floats
    pv: Floats
    late: Floats
    stuck: tuple[int, int]


@dataclass(frozen=True, slots=True)
class StemMarks:
    """Limits of the time in which a stem is at rest: stickband [% of OP], 0 for a valve without fault; dead time, and
    the settling time of PV after earlier moves [s]."""

    stickband: float
    dead_s: float
    answered_s: float


def halves(
    op: Floats,
    pv: Floats,
    good: Mask,
    turns: np.ndarray,
    dt_s: float,
    period_s: float,
    marks: StemMarks,
    most: int,
) -> tuple[HalfCycle, ...]:
    """The last half-cycles of a record without bad samples.

    op, pv : shape (n,) [% of OP, % of span]; good : bool, shape (n,), True where samples may be used; turns : shape
    (t,), samples of OP reversals; dt_s, period_s : sample interval and period of the cycle [s]; most : largest number
    of half-cycles. Oldest first; empty with fewer than two OP reversals.
    """
    step = max(0.5 * period_s / POINTS, dt_s)
    found: list[HalfCycle] = []
    clock = np.arange(op.size)
    for first, last in reversed(list(pairwise(turns))):
        if len(found) == most:
            break
        if last - first < 3 or not good[first : last + 1].all():
            continue
        at = np.arange(first, min(last, first + LONGEST * 0.5 * period_s / dt_s) + 1e-9, step / dt_s)
        o, p = np.interp(at, clock, op), np.interp(at, clock, pv)
        later = np.interp(at + marks.dead_s / dt_s, clock, pv)
        found.append(HalfCycle(float(first) * dt_s, step, o, p, later, _stuck(o, step, marks)))
    return tuple(reversed(found))


def _stuck(op: Floats, step_s: float, marks: StemMarks) -> tuple[int, int]:
    """Points from the settling of PV to where OP has moved by the stickband; (0, 0) for none."""
    if marks.stickband <= 0:
        return 0, 0
    moved = np.abs(op - op[0]) >= marks.stickband
    end = int(np.argmax(moved)) if moved.any() else op.size
    begin = round(marks.answered_s / step_s)
    return (begin, end) if end - begin >= 2 else (0, end) if end >= 2 else (0, 0)
