"""Describing functions of backlash and stick-slip: gain and phase of a valve for a sine.

A sine A sin(wt) of OP gives the fundamental N(A) A sin(wt); N is complex, its angle is negative.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.models import Backlash, Motion, Stiction, Valve
from identification.record import Floats
from identification.simulation.valve import thresholds

BACKLASH_JUMP_SHARE = 0.02
"""Slip jump over the stickband below which it counts as backlash: fifty jumps a stickband look like it."""
JUMPS_MOST = 60  # Jumps per half cycle up to which stick-slip has branches of its own: far beyond what is met

Complexes = NDArray[np.complex128]

TABLE_SIZE, CURVE_POINTS = 4000, 400
"""Points of each part of a branch's table, which make its interpolation better than 1e-5 in amplitude and gain; and
of a drawn curve."""


def backlash(amplitude: ArrayLike, width: float) -> Complexes:
    """Describing function of backlash of full width `width` [% OP] at amplitudes > 0 of OP [% OP], of any shape.

    Johansson et al. (2012), the source study's Eq. (1), with d = width/2. Zero up to A = d, where the stem does not
    move.
    """
    share = np.minimum(0.5 * width / np.asarray(amplitude, dtype=np.float64), 1.0)
    u = 1.0 - 2.0 * share
    root = 2.0 * np.sqrt(share * (1.0 - share))
    return (0.5 + (np.arcsin(u) + u * root) / np.pi) - 1j * (root**2 / np.pi)


def jump_range(valve: Stiction, jumps: int) -> tuple[float, float]:
    """Range of OP amplitudes [% OP] of a symmetric cycle with `jumps` jumps per half cycle.

    The stem travels jumps*J; it must reach the last jump and no further one: X + f_d <= A <= X + f_s with X =
    jumps*J/2 and the thresholds f_s, f_d of identification.simulation.valve.
    """
    breakaway, sliding = thresholds(valve.stickband, valve.slip_jump)
    reach = 0.5 * jumps * valve.slip_jump
    return reach + sliding, reach + breakaway


def jumps_at(amplitude: float, valve: Stiction) -> int:
    """Fewest jumps per half cycle of a symmetric cycle at this amplitude [% OP]; 0 where the stem does not move."""
    breakaway, sliding = thresholds(valve.stickband, valve.slip_jump)
    if amplitude < sliding + 0.5 * valve.slip_jump:
        return 0
    return max(int(np.ceil(2.0 * (amplitude - breakaway) / valve.slip_jump)), 1)


def stick_slip(amplitude: ArrayLike, stickband: float, slip_jump: float, jumps: int = 1) -> Complexes:
    """Describing function of two-parameter stick-slip with a given number of jumps per half cycle, at least one.

    A cycle with n jumps is the sum of n relays of height J/2 that switch at h_k = S/2 + J(k - (n+1)/2), k = 1..n,
    each of which has the textbook describing function (Atherton 1982). One jump with S = J = 2d is the source study's
    Eq. (2). Derived here; tests compare it with the projection of the operator. The amplitude [% OP], of any shape,
    lies within `jump_range`; nan outside the switching levels.
    """
    a = np.asarray(amplitude, dtype=np.float64)
    level = 0.5 * stickband + slip_jump * (np.arange(1, jumps + 1) - 0.5 * (jumps + 1))
    inside = a[..., None] ** 2 - level**2
    inside = np.where(inside < -1e-9 * a[..., None] ** 2, np.nan, np.maximum(inside, 0.0))
    height = 2.0 * slip_jump / (np.pi * a**2)
    return height * (np.sqrt(inside).sum(axis=-1) - 1j * 0.5 * jumps * stickband)


def sliding(amplitude: ArrayLike, stickband: float, slip_jump: float) -> Complexes:
    """Describing function of stick-slip whose stem follows OP after its jump.

    From OP's minimum the stem rests at -(A - f_d) up to the angle p with cos p = 1 - S/A, then follows at the
    distance f_d = (S - J)/2 (Choudhury, Thornhill, Shah 2005); the half cycle's integral is derived here. J = 0 is
    backlash of width S. At amplitudes [% OP] of any shape; up to S/2 the stem rests and N is 0.
    """
    a = np.asarray(amplitude, dtype=np.float64)
    gap = thresholds(stickband, slip_jump)[1]
    angle = np.arccos(np.maximum(1.0 - stickband / a, -1.0))
    turn = np.exp(-1j * angle)
    rest = (a - gap) * 1j * (turn - 1.0)
    follow = a * (0.5 * (np.pi - angle) + 0.25j * (1.0 - turn**2)) - 1j * gap * (1.0 + turn)
    return np.where(a > 0.5 * stickband, 2.0 / (np.pi * a) * (rest + follow), 0.0)


def is_backlash(valve: Valve) -> bool:
    """Whether the valve has backlash, or stick-slip with a negligible jump."""
    return isinstance(valve, Backlash) or (
        isinstance(valve, Stiction) and valve.slip_jump <= BACKLASH_JUMP_SHARE * valve.stickband
    )


def band(valve: Valve) -> float:
    """Full width [% OP] of OP travel after a reversal without stem motion: backlash or stickband; 0 without."""
    if valve is None:
        return 0.0
    return valve.width if isinstance(valve, Backlash) else valve.stickband


def scaled_valve(valve: Valve, factor: float) -> Valve:
    """The valve with backlash, or stickband and slip jump, times a factor [-]."""
    if valve is None:
        return None
    if isinstance(valve, Backlash):
        return Backlash(valve.width * factor)
    return replace(valve, stickband=valve.stickband * factor, slip_jump=valve.slip_jump * factor)


def moves_by_jumps(valve: Valve) -> bool:
    """Whether the stem moves only by whole jumps, and so has a describing function for each number of them."""
    return isinstance(valve, Stiction) and valve.motion is Motion.RESTS and not is_backlash(valve)


def describing_function(valve: Backlash | Stiction, amplitude: ArrayLike, jumps: int = 1) -> Complexes:
    """N(A) of a faulty valve at amplitudes [% OP] of any shape; `jumps` per half cycle if it moves by jumps."""
    if isinstance(valve, Backlash) or is_backlash(valve):
        return backlash(amplitude, band(valve))
    if valve.motion is not Motion.RESTS:
        return sliding(amplitude, valve.stickband, valve.slip_jump)
    return stick_slip(amplitude, valve.stickband, valve.slip_jump, jumps)


def describe(valve: Valve, amplitude: float) -> complex:
    """N(A) of any valve at one amplitude [% OP]; if several cycles are possible, that of fewest jumps."""
    if valve is None or band(valve) <= 0.0:
        return 1.0 + 0.0j
    jumps = jumps_at(amplitude, valve) if isinstance(valve, Stiction) and moves_by_jumps(valve) else 1
    return complex(describing_function(valve, amplitude, jumps)) if jumps else 0j


def curve(valve: Valve) -> tuple[Floats, Complexes]:
    """Amplitudes [% OP] and N(A), shape (CURVE_POINTS,), up to 100 half widths, or of stick-slip with one jump."""
    if valve is None or band(valve) <= 0.0:
        return np.ones(1), np.ones(1, dtype=np.complex128)
    amplitude = 0.5 * band(valve) * (1.0 + np.geomspace(1e-4, 100.0, CURVE_POINTS))
    if isinstance(valve, Stiction) and moves_by_jumps(valve):
        amplitude = np.linspace(*jump_range(valve, 1), CURVE_POINTS)
    return amplitude, describing_function(valve, amplitude)


@dataclass(frozen=True, slots=True)
class Branch:
    """One smooth piece of N(A), tabulated by its phase, which increases with A on every piece.

    jumps per half cycle (0: backlash), root shape (m,): sqrt(-phase) descending, log_amplitude [ln % OP] and log_gain
    (m,). The square root makes the table smooth where the phase of backlash goes to zero.
    """

    jumps: int
    root: Floats
    log_amplitude: Floats
    log_gain: Floats

    def at_phase(self, phase: Floats) -> tuple[Floats, Floats]:
        """ln A and ln abs(N) where N has this phase [rad], shaped as `phase`; nan where it has no such phase."""
        known = (phase < 0.0) & (phase > -np.pi)
        root = np.sqrt(np.where(known, -phase, np.nan))
        amplitude = np.interp(root, self.root[::-1], self.log_amplitude[::-1], left=np.nan, right=np.nan)
        gain = np.interp(root, self.root[::-1], self.log_gain[::-1], left=np.nan, right=np.nan)
        return amplitude, gain


def _branch(jumps: int, amplitude: Floats, n: Complexes) -> Branch:
    return Branch(jumps, np.sqrt(np.maximum(-np.angle(n), 0.0)), np.log(amplitude), np.log(np.abs(n)))


def _backlash_branch(width: float) -> Branch:
    """Backlash table over the angle x = acos(2d/A - 1) in which the stem moves.

    N = (x - sin(2x)/2 - i sin(x)^2)/pi, Eq. (1) rewritten without cancellation as A tends to d.
    """
    nearly_stuck = np.geomspace(1e-5, 0.5, TABLE_SIZE, endpoint=False)
    moving = np.concatenate((nearly_stuck, np.linspace(0.5, np.pi, TABLE_SIZE + 1)[:-1]))
    n = (moving - 0.5 * np.sin(2.0 * moving) - 1j * np.sin(moving) ** 2) / np.pi
    return _branch(0, width / (1.0 + np.cos(moving)), n)


def _jump_branch(valve: Stiction, jumps: int) -> Branch:
    low, high = jump_range(valve, jumps)
    amplitude = low + (high - low) * np.linspace(0.0, 1.0, TABLE_SIZE) ** 2
    return _branch(jumps, amplitude, describing_function(valve, amplitude, jumps))


@lru_cache(maxsize=64)
def branches(valve: Valve) -> tuple[Branch, ...]:
    """The pieces of N(A): one for backlash, one per number of jumps for stick-slip, none for an ideal valve."""
    width = band(valve)
    if valve is None or width <= 0.0:
        return ()
    if isinstance(valve, Backlash) or is_backlash(valve):
        return (_backlash_branch(width),)
    if valve.motion is not Motion.RESTS:
        amplitude = width / (1.0 + np.cos(np.linspace(0.0, np.pi, TABLE_SIZE + 1)[:-1]))
        return (_branch(1, amplitude, sliding(amplitude * (1 + 1e-12), width, valve.slip_jump)),)
    most = min(JUMPS_MOST, int(np.ceil(6 * valve.stickband / valve.slip_jump)))
    return tuple(_jump_branch(valve, jumps) for jumps in range(1, most + 1))
