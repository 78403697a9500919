"""Which stretch of a record models are fitted to, in blocks of which length, and where PV answers a set point."""

from __future__ import annotations

import math

import numpy as np

from analyzer.config import CauseLimits
from analyzer.loop.assessments import noise_band
from analyzer.loop.oscillation import Oscillation
from identification.estimation.window import Window, block_means
from identification.models import Pid
from identification.record import LoopRecord, Mask


def time_scale(record: LoopRecord, oscillation: Oscillation | None, controller: Pid | None) -> float:
    """The period [s], or a guess of the loop's time scale where it does not oscillate.

    Four integral times where they are stated (the cycle of a PI loop with play is of that order), else sixty
    samples, so that blocks are samples.
    """
    if oscillation is not None:
        return oscillation.period_s
    top = len(record) * record.dt_s / 8
    if controller is not None and math.isfinite(controller.ti_s) and controller.ti_s > 0:
        return min(max(4 * controller.ti_s, 10 * record.dt_s), top)
    return min(60 * record.dt_s, top)


def latest_fit_stretch(record: LoopRecord, n: int) -> int:
    """First sample of the latest stretch of n samples with the fewest out of use."""
    out = ~record.usable
    seen = np.concatenate(([0], np.cumsum(out)))
    firsts = np.arange(len(record) - n, -1, -max(n // 4, 1))
    return int(firsts[int(np.argmin(seen[firsts + n] - seen[firsts]))])


def window_of(record: LoopRecord, scale_s: float, limits: CauseLimits, kind: str = "") -> Window:
    """The latest stretch with the fewest samples out of use, in blocks of a fraction of the period."""
    factor = max(round(scale_s / limits.blocks_per_period / record.dt_s), 1)
    n = min(len(record) // factor, limits.window) * factor
    first = latest_fit_stretch(record, n)
    part = record.span(first, first + n)
    usable = block_means(part.usable.astype(np.float64), factor) > 0.99
    known = {name: (t, dead) for name, t, dead in limits.fast_process}
    most = known.get(kind.lower(), (math.inf, math.inf))
    op = np.ascontiguousarray(part.op)
    stem = None if part.position is None else np.ascontiguousarray(part.position)
    return Window(
        block_means(part.pv, factor), op, usable, record.dt_s * factor, factor, *most, position=stem
    )


def answering(record: LoopRecord, window: Window, scale_s: float) -> Mask:
    """True where PV is due to answer a set point move, shape of the window.

    From a move for scale_s [s], and on until PV has come to the set point, however long the valve takes.
    """
    first = latest_fit_stretch(record, window.y.size * window.factor)
    sp = record.sp[first :: window.factor][: window.y.size]
    moves = np.flatnonzero(np.abs(np.diff(sp)) > 1e-6) + 1
    out = np.zeros(window.y.size, dtype=bool)
    if record.sp_estimated or not 0 < moves.size <= window.y.size / 10:
        return out
    reach = max(round(scale_s / window.dt_s), 1)
    error = np.abs(sp - window.y)
    near = error <= 3 * noise_band(window.y)
    for at, end in zip(moves, [*moves[1:], window.y.size], strict=True):
        there = np.flatnonzero(near[at + 1 : end])
        out[at : max(at + reach, at + 2 + int(there[0]) if there.size else end)] = True
    return out
