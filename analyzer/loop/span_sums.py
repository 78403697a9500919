"""Sums of one span of a loop's trends, each in one pass: what its figures are made of."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.record import Floats, Mask

ROUNDING = 1e-9
"""Moves under this [% of OP] are rounding and turn nothing: a signal may stand exactly at the edge of the band."""


class Trends(NamedTuple):
    """Set point, PV and OP of a span [% of span], shape (n,) each, and where OP is at a limit (bool, shape (n,))."""

    sp: Floats
    pv: Floats
    op: Floats
    saturated: Mask


class Sums(NamedTuple):
    """Over the samples that are good and in automatic: means of |e|, SP, PV and OP, standard deviations of e and PV
    [% of span], shares of time at limits and in good service [-], and how often e crosses the noise band; the set
    point's travel over the whole span."""

    absolute_error: float
    sp: float
    pv: float
    op: float
    error_deviation: float
    pv_deviation: float
    at_limits: float
    service: float
    crossings: int
    sp_travel: float


@njit(cache=True)
def crossings_of(e: Floats, use: Mask, band: float) -> int:
    """How often an error, where it may be used, goes from beyond one side of a band to beyond the other."""
    side, count = 0, 0
    for k in range(e.size):
        if not use[k] or abs(e[k]) <= band:
            continue
        now = 1 if e[k] > 0 else -1
        count += side == -now
        side = now
    return count


@njit(cache=True)
def travel_of(signal: Floats, use: Mask, step: int, deadband: float) -> tuple[float, int]:
    """Travel and reversals of every `step`-th sample of a signal beyond a deadband, shape (n,).

    Moves between usable neighbours make one path: what a signal moved during a gap is not known.
    """
    half, x, stem = 0.5 * deadband, 0.0, 0.0
    path, way, turns = 0.0, 0.0, 0
    for k in range(step, signal.size, step):
        if use[k] and use[k - step]:
            x += signal[k] - signal[k - step]
        if abs(x - stem) <= half:
            continue
        new = x - half if x > stem else x + half
        moved = new - stem
        stem = new
        path += abs(moved)
        if abs(moved) > ROUNDING:
            now = 1.0 if moved > 0 else -1.0
            turns += way == -now
            way = now
    return path, turns


@njit(cache=True)
def sums_of(x: Trends, use: Mask, small_error: float, band: float) -> Sums:
    """Sums over the samples that may be used, at least one.

    Parameters
    ----------
    x : Trends
    use : ndarray of bool, shape (n,)
    small_error : float
        Error under which a loop is in good service [% of span].
    band : float
        Band beyond which the error has a side [% of span].
    """
    count, size, e, pv, op, sp, limits, service = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0
    for k in range(x.pv.size):
        if use[k]:
            error = x.sp[k] - x.pv[k]
            count += 1
            size, e, pv = size + abs(error), e + error, pv + x.pv[k]
            op, sp = op + x.op[k], sp + x.sp[k]
            limits += x.saturated[k]
            service += abs(error) < small_error and not x.saturated[k]
    e, pv, ee, vv = e / count, pv / count, 0.0, 0.0
    for k in range(x.pv.size):
        if use[k]:
            ee += (x.sp[k] - x.pv[k] - e) ** 2
            vv += (x.pv[k] - pv) ** 2
    sides = crossings_of(x.sp - x.pv, use, band)
    moved = np.abs(np.diff(x.sp)).sum()
    spread = math.sqrt(ee / count), math.sqrt(vv / count)
    shares = limits / count, service / count
    return Sums(
        size / count, sp / count, pv, op / count, spread[0], spread[1], shares[0], shares[1], sides, moved
    )
