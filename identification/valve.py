"""Valve faults as operators on arrays: play (backlash) and stick-slip.

Both are rate independent: the stem's position depends on the order of OP's values, not on their timing.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.models import Backlash, Valve
from identification.record import Floats


@njit(cache=True)
def play_step(stem: float, op: float, half_width: float) -> float:
    """Stem position after one OP value, for play of half width `half_width` (all % of OP)."""
    if op - stem > half_width:
        return op - half_width
    if stem - op > half_width:
        return op + half_width
    return stem


@njit(cache=True)
def stick_slip_step(stem: float, op: float, breakaway: float, sliding: float) -> float:
    """Stem position after one OP value: held until |OP - stem| > breakaway, then at distance `sliding`."""
    gap = op - stem
    if gap > breakaway:
        return op - sliding
    if gap < -breakaway:
        return op + sliding
    return stem


@njit(cache=True)
def _walk(op: Floats, breakaway: float, sliding: float, stem: float) -> Floats:
    out = np.empty_like(op)
    for k in range(op.size):
        stem = stick_slip_step(stem, op[k], breakaway, sliding)
        out[k] = stem
    return out


def thresholds(stickband: float, slip_jump: float) -> tuple[float, float]:
    """Distance |OP - stem| at which the stem lets go, and at which it comes to rest [% OP].

    (S + J)/2 and (S - J)/2: static and kinetic friction in units of OP (He, Wang, Pottmann, Qin 2007).
    """
    return 0.5 * (stickband + slip_jump), 0.5 * (stickband - slip_jump)


def play(op: Floats, width: float, start: float | None = None) -> Floats:
    """Stem position behind play of full width `width`.

    Parameters
    ----------
    op : ndarray of shape (n,)
        Controller output [% OP].
    width : float
        Full width of the play [% OP], >= 0.
    start : float or None
        Stem position before the first sample [% OP]; None: the middle of the play, op[0].

    Returns
    -------
    ndarray of shape (n,)
        Stem position [% OP].
    """
    return stick_slip(op, width, 0.0, start)


def stick_slip(op: Floats, stickband: float, slip_jump: float, start: float | None = None) -> Floats:
    """Stem position of a sticking valve with stickband S and slip jump J.

    The stem rests until |OP - stem| exceeds (S + J)/2, then moves at once to the distance (S - J)/2 and rests
    again (He, Wang, Pottmann, Qin 2007, with f_s = (S + J)/2 and f_d = (S - J)/2). J = 0 is play of width S;
    S = J is the relay of the describing function with height and hysteresis S/2.

    Parameters
    ----------
    op : ndarray of shape (n,)
        Controller output [% OP].
    stickband, slip_jump : float
        S and J [% OP], S >= 0 and 0 <= J.
    start : float or None
        Stem position before the first sample [% OP]; None: op[0].

    Returns
    -------
    ndarray of shape (n,)
        Stem position [% OP].
    """
    breakaway, sliding = thresholds(stickband, slip_jump)
    if op.size == 0 or breakaway <= 0.0:
        return op.copy()
    first = float(op[0]) if start is None or math.isnan(start) else float(start)
    return _walk(np.ascontiguousarray(op, dtype=np.float64), breakaway, sliding, first)


def stem_position(op: Floats, valve: Valve, start: float | None = None) -> Floats:
    """Stem position [% OP], shape (n,), behind any valve of models.py; None is an ideal valve."""
    if valve is None:
        return op.copy()
    if isinstance(valve, Backlash):
        return play(op, valve.width, start)
    return stick_slip(op, valve.stickband, valve.slip_jump, start)
