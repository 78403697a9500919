"""Which of two controllers has the valve, and which half of a split range works: a loop is judged while it does.

A select hands the valve to the output that is lower, or higher; the one that holds its set point while it has the
valve tells which. A half of a split range rests at an end of its valve while the other half works.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from analyzer.config import QualityLimits
from identification.controller.check import runs
from identification.record import Floats, LoopRecord, Mask


@dataclass(frozen=True, slots=True)
class Shared:
    """What a loop has of a valve, or of a process, that it shares.

    idle : True where the other one has it, shape (n,); valve_pct, share of good time that the loop has it [%];
    changeovers_per_h, how often it passes from one to the other; winds_up_pct, share of the idle time in which OP
    stands at the far end, None for a half of a split range; takeover_s, median time from the error's asking for the
    valve to having it [s], None where that never happens; split_at_pct, split_slope, output of the split range's
    controller from which on the half works [%], and how much it moves for it [-]; valve, what a select gives the
    valve, shape (n,) [%], None for a half.
    """

    idle: Mask
    valve_pct: float
    changeovers_per_h: float
    winds_up_pct: float | None = None
    takeover_s: float | None = None
    split_at_pct: float | None = None
    split_slope: float | None = None
    valve: Floats | None = None

    def as_row(self) -> Mapping[str, float | None]:
        """The figures by column."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("idle", "valve")}


def selected(record: LoopRecord, other: Floats, other_bad: Mask, limits: QualityLimits) -> Shared | None:
    """A loop beside the output of the controller with which it shares a valve by a select, shape (n,) [% of the
    valve]; None where none is seen."""
    good = record.usable & ~other_bad
    lower = record.op < other
    share, least = float(lower[good].mean() if good.any() else 0.0), limits.shared_share
    if record.sp_estimated or not least <= share <= 1 - least:
        return None
    size = [float(np.mean(record.error[good & has] ** 2)) for has in (lower, ~lower)]
    low = size[0] < size[1]
    if min(size) > limits.shared_error * max(size):
        return None
    idle = good & (lower != low)
    far = record.op >= 100.0 - limits.limit_pct if low else record.op <= limits.limit_pct
    return replace(
        _in_turn(idle, good, record.dt_s),
        winds_up_pct=100.0 * float(far[idle].mean()),
        takeover_s=_takeover_s(record, idle, good),
        valve=np.where(idle, other, record.op),
    )


def _in_turn(idle: Mask, good: Mask, dt_s: float) -> Shared:
    """What the two have in turn: how long, and how often it passes in an hour of good time."""
    passed = int(np.count_nonzero(np.diff(idle[good].astype(np.int8))))
    hours = max(float(good.sum()) * dt_s / 3600.0, 1e-9)
    return Shared(idle, 100.0 * float(1.0 - idle[good].mean()), passed / hours)


def _takeover_s(record: LoopRecord, idle: Mask, good: Mask) -> float | None:
    """Median time before a take-over for which the error has had the other side than while the loop is idle [s]; None
    without a take-over."""
    side, waits = np.sign(record.error) * np.sign(np.median(record.error[idle])), []
    for first, last in runs(idle):
        if last < idle.size and good[last]:
            before = np.flatnonzero(side[first:last] >= 0)
            waits.append(last - first - (int(before[-1]) + 1 if before.size else 0))
    return float(np.median(waits)) * record.dt_s if waits else None


def half(record: LoopRecord, whole: Floats, whole_bad: Mask, limits: QualityLimits) -> Shared | None:
    """A half of a split range, OP its own, beside the output of the controller of both halves, shape (n,) [%]; None
    where it never rests."""
    good = record.usable & ~whole_bad
    ends = record.op <= limits.limit_pct, record.op >= 100.0 - limits.limit_pct
    rest = max(ends, key=lambda end: int((end & good).sum()))
    idle = rest & good
    if not good.any() or not limits.shared_share <= float(idle[good].mean()) <= 1 - limits.shared_share:
        return None
    working, end = good & ~ends[0] & ~ends[1], 0.0 if rest is ends[0] else 100.0
    slope, begin = _part_of(record.op, whole, working, end, limits.half_samples)
    return replace(_in_turn(idle, good, record.dt_s), split_at_pct=begin, split_slope=slope)


def _part_of(
    op: Floats, whole: Floats, working: Mask, end: float, least: int
) -> tuple[float | None, float | None]:
    """How much a half moves for its controller's output [-], and the output at which it leaves its end [%]; None
    where so few samples are at work."""
    if int(working.sum()) < least:
        return None, None
    x, y = whole[working], op[working]
    spread = float(np.var(x))
    slope = float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread > 0 else 0.0
    return (slope, float(x.mean() + (end - y.mean()) / slope)) if slope else (None, None)
