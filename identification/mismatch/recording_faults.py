"""What the recording itself did to the trends: compression, grid, clip, stamps. Judged before any physics."""

from __future__ import annotations

import numpy as np

from identification.limits import LIMITS, RecorderLimits
from identification.mismatch.recording import STEP, Finding
from identification.record import Floats, Mask

OFTEN, FEWEST = 0.2, 4
"""Share of the mean count from which a value is one at which PV dwells, and samples there at least; ours."""


def level_gaps(pv: Floats) -> Floats:
    """Differences of neighbouring values that occur, in the middle nine tenths of the range; shape (levels - 1,)."""
    low, high = np.quantile(pv, [0.05, 0.95])
    return np.diff(np.unique(pv[(pv >= low) & (pv <= high)]))


def straight(pv: Floats) -> Mask:
    """True where a moving trend is straight through three samples, shape (n,)."""
    out = np.zeros(pv.size, dtype=bool)
    rise = np.diff(pv)
    tiny = 2e-7 * max(float(np.abs(pv).max()), 1e-3)
    out[1:-1] = (np.abs(np.diff(rise)) < 3 * tiny) & (np.abs(rise[1:]) > 10 * tiny)
    return out


def on_grid(gaps: Floats) -> bool:
    """Whether differences of values are multiples of the smallest that is common."""
    if gaps.size < 5:
        return True
    unit = float(np.quantile(gaps, 0.1))
    return float(np.mean(np.abs(gaps / unit - np.round(gaps / unit)) < 0.05)) > 0.6


def grid_unit(pv: Floats) -> float:
    """The step of values [% PV]: their mean distance where PV dwells, so that none between is left out.

    A finer rounding over a converter's steps makes some longer and some shorter, and the mean is theirs.
    """
    levels, counts = np.unique(pv, return_counts=True)
    often = counts >= max(OFTEN * pv.size / levels.size, FEWEST)
    gaps = np.diff(levels)
    dwelt = gaps[often[1:] & often[:-1]]
    return float(dwelt.mean() if dwelt.size >= FEWEST - 1 else np.median(gaps))


def straightened(x: Floats, share: float) -> bool:
    """Whether at least that share of a trend lies on straight lines that no grid makes."""
    return float(straight(x).mean()) >= share and not on_grid(level_gaps(x))


def compression(pv: Floats, limits: RecorderLimits = LIMITS.recorder) -> Finding | None:
    """Straight segments whose breaks stand on no grid (swinging door and the like)."""
    if not straightened(pv, limits.straight):
        return None
    found = straight(pv)
    return Finding({"straight_share": float(found.mean())}, found)


def quantization(pv: Floats, ranged: bool, limits: RecorderLimits = LIMITS.recorder) -> Finding | None:
    """Values on a grid coarser than a historian's; `ranged` is False where percent is of the recorded range."""
    gaps = level_gaps(pv)
    least = limits.grid_step if ranged else limits.grid_step_of_range
    if gaps.size == 0 or gaps.size * 20 > pv.size or float(gaps.mean()) < least:
        return None
    if float(gaps.max()) > 4.0 * float(gaps.mean()):
        return None
    return Finding({STEP: grid_unit(pv)}, np.ones(pv.size, dtype=bool))


def least_jump(pv: Floats, limits: RecorderLimits = LIMITS.recorder) -> float:
    """The least move [% PV] of a trend that stands and then jumps, far over its own resolution; 0 of any other.

    A sensor that sticks makes such a trend, or a historian that keeps changes of some size alone.
    """
    moves, gaps = np.abs(np.diff(pv)), np.diff(np.unique(pv))
    moves = moves[moves > 0.0]
    if moves.size < limits.jumps or moves.size > (1.0 - limits.stands) * pv.size:
        return 0.0
    jump = float(np.quantile(moves, 0.02))
    low, high = np.quantile(pv, [0.05, 0.95])
    coarse = jump > limits.jump_steps * float(np.quantile(gaps, 0.1)) and jump > limits.jump_share * (
        high - low
    )
    return jump if coarse else 0.0


def clipped(pv: Floats, limits: RecorderLimits = LIMITS.recorder) -> Finding | None:
    """PV standing at exactly its highest or lowest value far more often than at those next to it."""
    levels, counts = np.unique(pv, return_counts=True)
    if levels.size < 12:
        return None
    best = None
    for end, near in ((-1, counts[-7:-1]), (0, counts[1:7])):
        top = int(counts[end])
        enough = top >= limits.clip_samples and top > limits.clip_ratio * float(near.mean())
        if enough and (best is None or top > best.where.sum()):
            best = Finding({"clip_pct": float(levels[end])}, pv == levels[end])
    return best


def jitter(stamp_s: Floats, dt_s: float) -> float:
    """Scatter of the stamps about a uniform clock [samples], gaps left out."""
    spacing = np.diff(stamp_s) / dt_s
    spacing = spacing[(spacing > 0.02) & (spacing < 1.98)]
    return float(np.std(spacing)) / np.sqrt(2.0) if spacing.size > 10 else 0.0


def sampling(stamp_s: Floats, dt_s: float, limits: RecorderLimits = LIMITS.recorder) -> Finding | None:
    """Polling that scatters by more than logging does."""
    found = jitter(stamp_s, dt_s)
    if found < limits.jitter:
        return None
    return Finding({"jitter_samples": found}, np.ones(stamp_s.size, dtype=bool))


def unlogged(stamp_s: Floats, n: int, dt_s: float, limits: RecorderLimits = LIMITS.recorder) -> Mask:
    """True where a record of n samples holds a value over from before because none was logged, shape (n,).

    Nothing is marked where the record does not begin with the first stamp and end with the last.
    """
    out = np.zeros(n, dtype=bool)
    at = (stamp_s - stamp_s[0]) / dt_s if stamp_s.size else stamp_s
    if stamp_s.size < 2 or abs(float(at[-1]) - (n - 1)) > 1.5:
        return out
    for k in np.flatnonzero(np.diff(at) > limits.missed):
        out[int(np.ceil(at[k] + 0.5)) : int(np.floor(at[k + 1] + 0.5))] = True
    return out
