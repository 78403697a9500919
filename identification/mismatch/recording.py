"""One recording to be explained, the findings before any physics is fitted, and properties of its trends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from identification.controller.check import StatedSettings
from identification.controller.pi_regression import feedback_share
from identification.estimation.problem import in_blocks
from identification.estimation.search import plain_processes
from identification.limits import LIMITS, ExplainLimits, RecorderLimits
from identification.models import Backlash, Estimate, Fopdt, Stiction
from identification.record import Floats, Mask

EXPERIMENT_SAMPLES = 4000
"""Samples of an experiment beyond which it is judged at a coarser step, if its time constant allows it:
bounds the time."""
SAMPLES_A_LAG = 5.0
"""Samples that a time constant and dead time keep at the coarser step: OP's mean drives a step exactly, and a
move is placed to a tenth of the lag."""


@dataclass(frozen=True, slots=True)
class SeenInCycles:
    """A faulty valve shown by the loop's own cycles or slips, with the process behind it.

    stretches : number of independent trials, each between two OP reversals, or without a cycle between stem moves;
    agreeing : share of them in which PV fits this valve better than a free one [-]; cycle_s : mean length of two of
    them [s]; cycling : whether they are between OP reversals; estimates : the valve's figures by name, with 90 %
    intervals, as in the batch run.
    """

    process: Fopdt
    valve: Backlash | Stiction
    stretches: int
    agreeing: float
    cycle_s: float
    cycling: bool = True
    estimates: Mapping[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Recording:
    """One recording to be explained.

    sp : shape (n,) [% PV], None where not recorded; pv, op : shape (n,) [% of span]; usable : bool, shape (n,); dt_s
    [s]; stamp_s : stamps as logged [s]; stated : the controller as stated by the plant; ranged : whether PV's range
    is stated; neighbours : OPs of other loops on the same clock, each shape (n,); kind : the loop's type as stated,
    lower case; cycles : the faulty valve that its cycles show, None if none; free_valve : whether it cycles and its
    cycles show no faulty valve; period_s : of its cycle [s], 0 without one; limits : its thresholds.
    """

    sp: Floats | None
    pv: Floats
    op: Floats
    usable: Mask
    dt_s: float
    stamp_s: Floats
    stated: StatedSettings | None = None
    ranged: bool = True
    neighbours: tuple[Floats, ...] = ()
    kind: str = ""
    cycles: SeenInCycles | None = None
    free_valve: bool = False
    period_s: float = 0.0
    limits: ExplainLimits = LIMITS

    @property
    def every_scan(self) -> bool:
        """Whether every scan of the controller is recorded; without a stated scan the usual one is assumed."""
        limits = self.limits.controller
        scans = self.dt_s / limits.typical_scan_s if self.stated is None else self.stated.scans
        return scans < limits.thinned

    @property
    def band(self) -> tuple[float, float] | None:
        """Shortest and longest period [samples] at which the model, not the slow load, determines PV: an eighth of
        its cycle and two of them; without a cycle all up to four integral times; None where neither is known."""
        if self.period_s > 0.0:
            cycle = self.period_s / self.dt_s
            return cycle / FINEST, CYCLES * cycle
        if self.stated is None or not 0.0 < self.stated.ti < self.pv.size / INTEGRALS:
            return None
        return 2.0, INTEGRALS * self.stated.ti


FINEST, CYCLES, INTEGRALS = 8.0, 2.0, 4.0
"""The loop's band: harmonics of a cycle up to the eighth, its second subharmonic, integral times; ours: backlash and
stick-slip appear in the first seven harmonics, a load below half of the cycle's frequency."""
STEP = "step_pct"
"""Name of the number that gives the resolution of PV after a finding [% PV]."""


def straight(pv: Floats) -> Mask:
    """True where a moving trend is linear through three samples, shape (n,)."""
    out = np.zeros(pv.size, dtype=bool)
    rise = np.diff(pv)
    tiny = 2e-7 * max(float(np.abs(pv).max()), 1e-3)
    out[1:-1] = (np.abs(np.diff(rise)) < 3 * tiny) & (np.abs(rise[1:]) > 10 * tiny)
    return out


def level_gaps(pv: Floats) -> Floats:
    """Differences between neighbouring values of PV, in the middle nine tenths of the range; shape (levels - 1,)."""
    low, high = np.quantile(pv, [0.05, 0.95])
    return np.diff(np.unique(pv[(pv >= low) & (pv <= high)]))


def straightened(x: Floats, share: float, limits: RecorderLimits) -> bool:
    """Whether at least that share of a trend lies on straight lines not caused by a grid; on a grid, differences of
    values are multiples of the smallest common one."""
    gaps = level_gaps(x)
    if gaps.size < 5 or float(straight(x).mean()) < share:
        return False
    steps = gaps / float(np.quantile(gaps, 0.1))
    return float(np.mean(np.abs(steps - np.round(steps)) < 0.05)) <= limits.grid_multiples


def least_jump(pv: Floats, limits: RecorderLimits = LIMITS.recorder) -> float:
    """The smallest move [% PV] of a trend that is held, if it is also large relative to the trend's range;
    otherwise 0."""
    jump = held_move(pv, limits)
    low, high = np.quantile(pv, [0.05, 0.95]) if jump else (0.0, 0.0)
    return jump if jump > limits.jump_share * float(high - low) else 0.0


def held_move(pv: Floats, limits: RecorderLimits = LIMITS.recorder) -> float:
    """The smallest move [% PV] of a trend that stays constant and then jumps, far above its resolution; otherwise 0.

    A sticking sensor makes such a trend, or a historian that records only changes of some size.
    """
    moves, gaps = np.abs(np.diff(pv)), np.diff(np.unique(pv))
    moves = moves[moves > 0.0]
    if moves.size < limits.jumps or moves.size > (1.0 - limits.constant_share) * pv.size:
        return 0.0
    jump = float(np.quantile(moves, 0.02))
    return jump if jump > limits.jump_steps * float(np.quantile(gaps, 0.1)) else 0.0


def unlogged(stamp_s: Floats, n: int, dt_s: float, limits: RecorderLimits = LIMITS.recorder) -> Mask:
    """True where a record of n samples holds an earlier value because none was logged, shape (n,).

    Nothing is marked unless the record begins with the first stamp and ends with the last.
    """
    out = np.zeros(n, dtype=bool)
    at = (stamp_s - stamp_s[0]) / dt_s if stamp_s.size else stamp_s
    if stamp_s.size < 2 or abs(float(at[-1]) - (n - 1)) > 1.5:
        return out
    for k in np.flatnonzero(np.diff(at) > limits.missed):
        out[int(np.ceil(at[k] + 0.5)) : int(np.floor(at[k + 1] + 0.5))] = True
    return out


def is_experiment(s: Recording) -> bool:
    """Whether OP was moved by hand or by a script: no controller is known, and OP does not respond to PV.

    In a cycling loop, in which OP and PV predict each other, OP must be constant nearly always.
    """
    if s.sp is not None or s.stated is not None or feedback_share(s.op, s.pv) >= s.limits.controller.feedback:
        return False
    cycles = s.cycles is not None or s.free_valve
    return not cycles or float(np.mean(np.diff(s.op) != 0.0)) < s.limits.controller.by_hand


def coarser_by(s: Recording) -> int:
    """Downsampling factor of an experiment that keeps the information on its process; 1 if every sample is needed."""
    most = s.pv.size // EXPERIMENT_SAMPLES
    if most < 2:
        return 1
    fast = min(
        x.time_constant_s + x.dead_time_s for x in plain_processes(in_blocks(s.pv, s.op, s.usable, s.dt_s))
    )
    return max(min(most, int(fast / (SAMPLES_A_LAG * s.dt_s))), 1)
