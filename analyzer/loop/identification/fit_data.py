"""Data of the fit: the stretch of a record, in blocks; times of set point responses; OP between the rows."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from analyzer.config import CauseLimits
from analyzer.loop.oscillation.figures import noise_band
from identification.estimation.between_samples import Rows, Scans, scans_per_row
from identification.estimation.problem import Problem, block_means, in_blocks
from identification.models import Pid
from identification.record import Floats, LoopRecord, Mask

BRIDGED = 0.05
"""Holes of a record up to this long are bridged by a straight line before a model is fitted [periods]: a sine
leaves 1 % of its amplitude over them; single missing rows left no worn valve assessed."""
FEW_MORE = 0.1  # Further share of unusable samples in a stretch with more set point moves

LIVELIER = 2.0
"""Least ratio of the cycle's energy in a stretch to that in the latest one, for the former to be fitted;
ours. A cycle of constant size varies less."""


def fit_stretch(record: LoopRecord, n: int, period: float, calm: bool = False) -> int:
    """First sample of the latest stretch of n samples with the fewest unusable ones, or of one with few more.

    In a calm loop the one in which the set point moves farthest: its moves separate the process from load and valve.
    In a cycle with a period [samples] that comes in bursts, the liveliest one: a loop that rings after moves of the
    set point is quiet at other times, and noise alone does not identify it.
    """
    firsts = np.arange(len(record) - n, -1, -max(n // 4, 1))

    def within(x: Floats) -> Floats:
        total = np.concatenate(([0.0], np.cumsum(x)))
        return np.asarray(total[firsts + n] - total[firsts])

    out = within((~record.usable).astype(np.float64))
    least, few = out <= out.min(), out <= out.min() + FEW_MORE * n
    latest = int(np.argmin(out))
    if not calm:
        energy = within(np.where(record.usable, _of_cycle(record.error, period) ** 2, 0.0))
        best = int(np.flatnonzero(few)[np.argmax(energy[few])])
        return int(firsts[best if energy[best] > LIVELIER * energy[latest] else latest])
    moved = np.abs(np.diff(record.sp, prepend=record.sp[:1]))
    far = within(np.where(record.usable, moved, 0.0))
    farther = few & (far > far[least].max())
    among = np.flatnonzero(farther if farther.any() else least)
    return int(firsts[among[far[among] >= far[among].max() - 1e-9][0]])


def _of_cycle(x: Floats, period: float) -> Floats:
    """A signal, shape (n,), less its moving mean over a period [samples]."""
    width = min(max(round(period), 2), x.size)
    return np.asarray(x - uniform_filter1d(x, width))


def bridged(usable: Mask, period: float) -> Mask:
    """Usable samples, shape (n,), and those in gaps shorter than a share of a period [samples]."""
    most = int(BRIDGED * period)
    out = usable.copy()
    edges = np.flatnonzero(np.diff(np.concatenate(([1], usable.astype(np.int8), [1]))))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first <= most:
            out[first:last] = True
    return out


def across(x: Floats, hole: Mask) -> Floats:
    """A signal, shape (n,), with a straight line from end to end of each gap."""
    if not hole.any() or hole.all():
        return x
    at = np.flatnonzero(~hole)
    return np.where(hole, np.interp(np.arange(x.size), at, x[at]), x)


def problem_of(
    record: LoopRecord, scale_s: float, limits: CauseLimits, kind: str = "", calm: bool = False
) -> Problem:
    """The stretch that is fitted, in blocks of a fraction of the period."""
    factor = max(round(scale_s / limits.blocks_per_period / record.dt_s), 1)
    n = min(len(record) // factor, limits.window) * factor
    first = fit_stretch(record, n, scale_s / record.dt_s, calm)
    known = {name: (t, dead) for name, t, dead in limits.fast_process}
    most = known.get(kind.lower(), (math.inf, math.inf))
    turn = 0 if calm else max(round(2 * scale_s / record.dt_s), 2)
    return _cut(record, first, n, factor, scale_s, most, turn)


def _cut(
    record: LoopRecord,
    first: int,
    n: int,
    factor: int,
    scale_s: float,
    most: tuple[float, float],
    turn: int,
) -> Problem:
    """The problem of n samples that begins at `first`."""
    part = record.span(first, first + n)
    whole = bridged(part.usable, scale_s / record.dt_s)
    usable = block_means(whole.astype(np.float64), factor) > 0.99
    stem = None if part.position is None else np.ascontiguousarray(part.position)
    return in_blocks(
        block_means(across(part.pv, whole & ~part.usable), factor),
        np.ascontiguousarray(part.op),
        usable,
        record.dt_s * factor,
        factor,
        most_time_constant_s=most[0],
        most_dead_time_s=most[1],
        position=stem,
        first=first,
        sp=None if part.sp_estimated or not np.ptp(part.sp) else block_means(part.sp, factor),
        turn=turn,
    )


def whole_problem(record: LoopRecord, problem: Problem, most: int, scale_s: float) -> Problem:
    """The whole record in at most so many blocks, none shorter than those of a problem of it; its cycles, of a period
    [s], are not distinguished from slower moves of OP."""
    factor = max(math.ceil(len(record) / most), problem.blocks.factor)
    longest = problem.blocks.most_time_constant_s, problem.blocks.most_dead_time_s
    return _cut(record, 0, len(record) // factor * factor, factor, scale_s, longest, 0)


def scans_of(record: LoopRecord, problem: Problem, law: Pid | None) -> Scans | None:
    """The controller's scans within the rows of a problem; None if they are no faster than the rows, or the signal
    that it acts on is not known."""
    count = scans_per_row(law, record.dt_s)
    if law is None or count == 1 or record.sp_estimated:
        return None
    part = record.span(problem.blocks.first, problem.blocks.first + problem.y.size * problem.blocks.factor)
    pv, sp, op = across(part.pv, ~part.usable), np.ascontiguousarray(part.sp), np.ascontiguousarray(part.op)
    return Scans(Rows(pv, sp, op), law, count)


def due_to_answer(record: LoopRecord, problem: Problem, scale_s: float) -> Mask:
    """True while a response of PV to a set point move is expected, shape of the problem.

    From a move for scale_s [s], and on until PV has reached the set point, regardless of the valve's delay.
    """
    sp = record.sp[problem.blocks.first :: problem.blocks.factor][: problem.y.size]
    moves = np.flatnonzero(np.abs(np.diff(sp)) > 1e-6) + 1
    out = np.zeros(problem.y.size, dtype=bool)
    if record.sp_estimated or not 0 < moves.size <= problem.y.size / 10:
        return out
    reach = max(round(scale_s / problem.dt_s), 1)
    error = np.abs(sp - problem.pv)
    near = error <= 3 * noise_band(problem.y)
    for at, end in zip(moves, [*moves[1:], problem.y.size], strict=True):
        there = np.flatnonzero(near[at + 1 : end])
        out[at : max(at + reach, at + 2 + int(there[0]) if there.size else end)] = True
    return out
