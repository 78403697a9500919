"""Valve faults as operators on arrays: backlash and stick-slip.

Both are rate independent: the stem position depends on the order of OP values, not on their timing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from identification.models import Backlash, Motion, Stiction, Valve
from identification.record import Floats

SLIDES, HALTS, RESTS = 0.0, -1e-9, -math.inf
"""Tolerances [% OP] of a moving stem: it follows OP until OP reverses (Choudhury, Thornhill, Shah 2005), until OP
reverses or stops (Kano 2004; also true of dry friction, tests/identification/simulation/test_valve.py), or not at all
(He, Wang, Pottmann, Qin 2007)."""
TOLERANCES = {Motion.SLIDES: SLIDES, Motion.HALTS: HALTS, Motion.RESTS: RESTS}


class StemLaw(NamedTuple):
    """A valve in the form that kernels use; breakaway 0 is an ideal one.

    breakaway, sliding : distances |OP - stem| at which the stem starts to slip and comes to rest, (S + J)/2 and (S -
    J)/2: static and kinetic friction in units of OP (He, Wang, Pottmann, Qin 2007); tolerance : reversal of OP that a
    sliding stem ignores, or HALTS or RESTS [% OP].
    """

    breakaway: float = 0.0
    sliding: float = 0.0
    tolerance: float = RESTS

    @property
    def stickband(self) -> float:
        """S [% OP]; the backlash width where slip_jump is 0."""
        return self.breakaway + self.sliding

    @property
    def slip_jump(self) -> float:
        """J [% OP]."""
        return self.breakaway - self.sliding

    @property
    def valve(self) -> Valve:
        """The valve of models.py; a stem that ignores a small reversal slides."""
        if self.breakaway <= 0.0:
            return None
        if self.slip_jump <= 0.0:
            return Backlash(float(self.stickband))
        resting = Motion.RESTS if self.tolerance == RESTS else Motion.HALTS
        motion = Motion.SLIDES if self.tolerance >= SLIDES else resting
        return Stiction(float(self.stickband), float(self.slip_jump), motion)


IDEAL = StemLaw()


@register_jitable  # type: ignore[untyped-decorator]
def sticking(stickband: float, jump_share: float, tolerance: float = RESTS) -> StemLaw:
    """Valve of stickband S [% OP] and slip jump J = jump_share S."""
    return StemLaw(0.5 * stickband * (1 + jump_share), 0.5 * stickband * (1 - jump_share), tolerance)


def thresholds(stickband: float, slip_jump: float) -> tuple[float, float]:
    """Breakaway and sliding distance [% OP] of S and J."""
    return 0.5 * (stickband + slip_jump), 0.5 * (stickband - slip_jump)


def law_of(valve: Valve) -> StemLaw:
    """The law of any valve of models.py."""
    if valve is None:
        return IDEAL
    if isinstance(valve, Backlash):
        return StemLaw(*thresholds(valve.width, 0.0))
    return StemLaw(*thresholds(valve.stickband, valve.slip_jump), TOLERANCES[valve.motion])


Stem = tuple[float, float, float]
"""Position [% OP], direction of motion (0: at rest) and OP's extreme since the motion began."""


@njit(cache=True)
def stem_step(stem: Stem, op: float, law: StemLaw) -> Stem:
    """The stem after one OP value.

    A stem at rest holds until |OP - stem| > breakaway and then moves to the distance `sliding`. It follows at that
    distance until OP reverses by more than `tolerance`; see SLIDES, HALTS, RESTS.
    """
    at, moving, turned = stem
    if moving != 0.0:
        advance = moving * (op - turned)
        if advance < -law.tolerance:
            moving = 0.0
        elif advance > 0.0:
            return op - moving * law.sliding, moving, op
    if moving == 0.0:
        gap = op - at
        if gap > law.breakaway:
            return op - law.sliding, 1.0, op
        if gap < -law.breakaway:
            return op + law.sliding, -1.0, op
    return at, moving, turned


STILL = 0.01
"""Speed of a stem with mass, in breakaway over its natural time, below which static friction holds it again; ours."""
MOST_PIECES = 4
"""Largest number of pieces of motion within one sample: a stem that reverses immediately is held; ours."""


@njit(cache=True)
def heavy_step(stem: Stem, op: float, law: StemLaw, time_s: float, dt_s: float) -> tuple[float, Stem]:
    """Mean position over a sample, and the stem after it, of a stem with mass on a spring, critically damped, under
    dry friction (Karnopp 1985), for an OP constant over the sample; solved piece by piece.

    stem : position [% OP], speed [%/s], and an unused value; time_s : natural time of mass and spring [s].
    """
    at, speed, remaining_s, total = stem[0], stem[1], dt_s, 0.0
    for _ in range(MOST_PIECES):
        gap = op - at
        if speed == 0.0 and abs(gap) <= law.breakaway:
            break
        direction = math.copysign(1.0, speed if speed != 0.0 else gap)
        rest = op - direction * law.sliding  # where spring and friction balance
        x, a = at - rest, speed + (at - rest) / time_s
        stops = speed * time_s / a if a * direction > 0.0 else math.inf
        t = min(stops, remaining_s)
        fade = math.exp(-t / time_s)
        moved = time_s * (x + a * time_s) - fade * time_s * (x + a * time_s + a * t)
        total += rest * t + moved
        at, speed, remaining_s = rest + (x + a * t) * fade, (speed - a * t / time_s) * fade, remaining_s - t
        if stops <= t or abs(speed) * time_s < STILL * law.breakaway:
            speed = 0.0
        if remaining_s <= 0.0:
            break
    return (total + at * remaining_s) / dt_s, (at, speed, op)


@njit(cache=True)
def moved_stem(stem: Stem, op: float, law: StemLaw, time_s: float, dt_s: float) -> tuple[float, Stem]:
    """Mean position over a sample, and the stem after it, with mass (time_s > 0) or without."""
    if time_s > 0.0:
        return heavy_step(stem, op, law, time_s, dt_s)
    after = stem_step(stem, op, law)
    return after[0], after


@njit(cache=True)
def walk(op: Floats, law: StemLaw, first: float, time_s: float = 0.0, dt_s: float = 1.0) -> Floats:
    """Stem positions [% OP], shape (n,), of a valve whose stem rests at `first` before the first sample.

    time_s, dt_s : as in `moved_stem`; with mass, the mean positions over the samples.
    """
    out = np.empty_like(op)
    stem = (first, 0.0, op[0])
    for k in range(op.size):
        out[k], stem = moved_stem(stem, op[k], law, time_s, dt_s)
    return out


@njit(cache=True)
def first_slip(op: Floats, law: StemLaw) -> float:
    """Stem position before the first sample [% OP] of a valve of which only OP, shape (n,), is known.

    Once OP has covered the stickband (breakaway + sliding) the stem has slipped, from any position, there at the
    latest. If OP never covers it, the stem does not move and is at the first OP.
    """
    low, high = op[0], op[0]
    for k in range(op.size):
        low, high = min(low, op[k]), max(high, op[k])
        if high - low > law.breakaway + law.sliding:
            return high - law.breakaway if op[k] == high else low + law.breakaway  # type: ignore[no-any-return]
    return op[0]  # type: ignore[no-any-return]


def stem_position(op: Floats, valve: Valve, start: float | None = None) -> Floats:
    """Stem position [% OP], shape (n,), behind any valve of models.py.

    start : stem position before the first sample [% OP], None: op[0], the middle of the backlash. J = 0 is
    backlash of width S for any motion;
    a stem that rests, with S = J, is the relay of the describing function, height
    and hysteresis S/2.
    """
    law = law_of(valve)
    if op.size == 0 or law.breakaway <= 0.0:
        return op.copy()
    first = float(op[0]) if start is None or math.isnan(start) else float(start)
    return walk(np.ascontiguousarray(op, dtype=np.float64), law, first)  # type: ignore[no-any-return]


def backlash_stem(op: Floats, width: float, start: float | None = None) -> Floats:
    """Stem position [% OP], shape (n,), behind backlash of full width `width` [% OP]."""
    return stem_position(op, Backlash(width), start)
