"""Valve faults as operators on arrays: play (backlash) and stick-slip.

Both are rate independent: the stem's position depends on the order of OP's values, not on their timing.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.models import Backlash, Motion, Stiction, Valve
from identification.record import Floats


@njit(cache=True)
def stem_step(
    stem: float, moving: float, turned: float, op: float, breakaway: float, sliding: float, tolerance: float
) -> tuple[float, float, float]:
    """Stem position, direction of motion (0: at rest) and OP's extreme since it moved, after one OP value.

    At rest the stem holds until |OP - stem| > breakaway and then moves to the distance `sliding`. It follows at
    that distance until OP turns back by more than `tolerance`; see SLIDES, HALTS, RESTS.
    """
    if moving != 0.0:
        advance = moving * (op - turned)
        if advance < -tolerance:
            moving = 0.0
        elif advance > 0.0:
            return op - moving * sliding, moving, op
    if moving == 0.0:
        gap = op - stem
        if gap > breakaway:
            return op - sliding, 1.0, op
        if gap < -breakaway:
            return op + sliding, -1.0, op
    return stem, moving, turned


@njit(cache=True)
def walk(op: Floats, breakaway: float, sliding: float, tolerance: float, stem: float) -> Floats:
    """Stem positions, shape (n,), of a valve given by its two distances and its tolerance [% OP]."""
    out = np.empty_like(op)
    moving, turned = 0.0, op[0]
    for k in range(op.size):
        stem, moving, turned = stem_step(stem, moving, turned, op[k], breakaway, sliding, tolerance)
        out[k] = stem
    return out


@njit(cache=True)
def first_slip(op: Floats, breakaway: float, sliding: float) -> float:
    """Stem position before the first sample [% OP] of a valve of which only OP is known.

    Once OP has covered the stickband (breakaway + sliding) the stem has slipped, wherever it was: it lets go there
    at the latest. A valve whose OP never covers it does not move and stands at the first OP.

    op : shape (n,), controller output [% OP]; breakaway, sliding : distances |OP - stem| at which the stem lets go,
    and at which it comes to rest [% OP].
    """
    low, high = op[0], op[0]
    for k in range(op.size):
        low, high = min(low, op[k]), max(high, op[k])
        if high - low > breakaway + sliding:
            return high - breakaway if op[k] == high else low + breakaway
    return op[0]


SLIDES, HALTS, RESTS = 0.0, -1e-9, -math.inf
"""Tolerances [% OP] of a stem in motion: it follows OP until OP turns (Choudhury, Thornhill, Shah 2005), until OP
turns or stands still (Kano 2004; dry friction does so too, tests/identification/simulation/test_valve.py), or not
at all (He, Wang, Pottmann, Qin 2007)."""
TOLERANCES = {Motion.SLIDES: SLIDES, Motion.HALTS: HALTS, Motion.RESTS: RESTS}


def motion_of(tolerance: float) -> Motion:
    """What a stem of that tolerance [% OP] does; one that ignores a little turning slides."""
    if tolerance >= SLIDES:
        return Motion.SLIDES
    return Motion.RESTS if tolerance == RESTS else Motion.HALTS


def thresholds(stickband: float, slip_jump: float) -> tuple[float, float]:
    """Distance |OP - stem| at which the stem lets go, and at which it comes to rest [% OP].

    (S + J)/2 and (S - J)/2: static and kinetic friction in units of OP (He, Wang, Pottmann, Qin 2007).
    """
    return 0.5 * (stickband + slip_jump), 0.5 * (stickband - slip_jump)


def constants_of(valve: Valve) -> tuple[float, float, float]:
    """Breakaway, sliding distance and tolerance [% OP] of any valve of models.py; breakaway 0 is an ideal one."""
    if valve is None:
        return 0.0, 0.0, RESTS
    if isinstance(valve, Backlash):
        return *thresholds(valve.width, 0.0), RESTS
    return *thresholds(valve.stickband, valve.slip_jump), TOLERANCES[valve.motion]


def play(op: Floats, width: float, start: float | None = None) -> Floats:
    """Stem position behind play of full width `width`.

    op : shape (n,), controller output [% OP]; width : full width of the play [% OP], >= 0; start : stem position
    before the first sample [% OP]; None: the middle of the play, op[0]. Returns shape (n,), stem position [% OP].
    """
    return stick_slip(op, width, 0.0, start)


def stick_slip(
    op: Floats, stickband: float, slip_jump: float, start: float | None = None, motion: Motion = Motion.RESTS
) -> Floats:
    """Stem position of a sticking valve with stickband S and slip jump J.

    The stem rests until |OP - stem| exceeds (S + J)/2, then moves at once to the distance (S - J)/2. It then rests
    again (f_s = (S + J)/2 and f_d = (S - J)/2 of He, Wang, Pottmann, Qin 2007), or follows OP at that distance, as
    `motion` says. J = 0 is play of width S in all; resting with S = J is the relay of the describing function, height
    and hysteresis S/2.

    op : shape (n,), controller output [% OP]; stickband, slip_jump : S and J [% OP], S >= 0 and 0 <= J; start : stem
    position before the first sample [% OP]; None: op[0]; motion : what the stem does after a jump. Returns shape
    (n,), stem position [% OP].
    """
    breakaway, sliding, tolerance = constants_of(Stiction(stickband, slip_jump, motion))
    if op.size == 0 or breakaway <= 0.0:
        return op.copy()
    first = float(op[0]) if start is None or math.isnan(start) else float(start)
    return walk(np.ascontiguousarray(op, dtype=np.float64), breakaway, sliding, tolerance, first)


def stem_position(op: Floats, valve: Valve, start: float | None = None) -> Floats:
    """Stem position [% OP], shape (n,), behind any valve of models.py; None is an ideal valve."""
    if valve is None:
        return op.copy()
    if isinstance(valve, Backlash):
        return play(op, valve.width, start)
    return stick_slip(op, valve.stickband, valve.slip_jump, start, valve.motion)
