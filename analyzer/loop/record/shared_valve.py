"""Which of two controllers has the valve, and which half of a split range works: a loop is judged only meanwhile.

A select gives the valve to the lower, or higher, output; the loop at its set point while it has the valve shows
which. A half of a split range is idle at an end of its valve while the other half works.
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
    """A loop's part of a valve, or of a process, that it shares.

    idle : True where the other one has it, shape (n,); valve_pct, share of good time in which the loop has it [%];
    changeovers_per_h, frequency of change-overs between the two; winds_up_pct, share of the idle time with OP at the
    far end, None for a half of a split range; takeover_s, median time from the error's change of sign to the
    take-over of the valve [s], None if that never happens; split_at_pct, split_slope, output of the split range's
    controller from which on the half works [%], and the half's move per move of it [-]; valve, OP that a select gives
    the valve, shape (n,) [%], None for a half.
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
    """A loop and the output of the controller with which it shares a valve by a select, shape (n,) [% of the valve];
    None if none is found."""
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
    """Time shares of the two controllers, and number of change-overs in an hour of good time."""
    passed = int(np.count_nonzero(np.diff(idle[good].astype(np.int8))))
    hours = max(float(good.sum()) * dt_s / 3600.0, 1e-9)
    return Shared(idle, 100.0 * float(1.0 - idle[good].mean()), passed / hours)


def _takeover_s(record: LoopRecord, idle: Mask, good: Mask) -> float | None:
    """Median time before a take-over for which the error has the opposite sign to that while the loop is idle [s];
    None without a take-over."""
    side, waits = np.sign(record.error) * np.sign(np.median(record.error[idle])), []
    for first, last in runs(idle):
        if last < idle.size and good[last]:
            before = np.flatnonzero(side[first:last] >= 0)
            waits.append(last - first - (int(before[-1]) + 1 if before.size else 0))
    return float(np.median(waits)) * record.dt_s if waits else None


def half(record: LoopRecord, whole: Floats, whole_bad: Mask, limits: QualityLimits) -> Shared | None:
    """A half of a split range, OP its own, and the output of the controller of both halves, shape (n,) [%]; None if
    it is never idle."""
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
    """The half's move per move of its controller's output [-], and the output at which it leaves its end [%]; None if
    too few samples are at work."""
    if int(working.sum()) < least:
        return None, None
    x, y = whole[working], op[working]
    spread = float(np.var(x))
    slope = float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread > 0 else 0.0
    return (slope, float(x.mean() + (end - y.mean()) / slope)) if slope else (None, None)
