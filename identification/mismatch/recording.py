"""One recording to be explained, what is found in it before any physics is fitted, and how its trends look."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from identification.controller.check import StatedSettings
from identification.controller.pi_regression import fed_back
from identification.estimation.search import plain_processes
from identification.limits import LIMITS, ExplainLimits, RecorderLimits
from identification.models import Backlash, Estimate, Fopdt, Stiction
from identification.record import Floats, Mask


@dataclass(frozen=True, slots=True)
class SeenInCycles:
    """A faulty valve that the loop's own cycles, or slips, show, with the process behind it.

    stretches : between two turns of OP, or in a loop that does not cycle between moves of the stem, each a trial by
    itself; agreeing : share of them in which PV goes as behind this valve and not as behind a free one [-]; cycle_s :
    mean length of two of them [s]; cycling : whether they lie between turns of OP; told : the valve's figures by
    name, with 90 % intervals, as the night tells them.
    """

    process: Fopdt
    valve: Backlash | Stiction
    stretches: int
    agreeing: float
    cycle_s: float
    cycling: bool = True
    told: Mapping[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Recording:
    """One recording to be explained.

    sp : shape (n,) [% PV], None where not recorded; pv, op : shape (n,) [% of span]; usable : bool, shape (n,);
    dt_s [s]; stamp_s : stamps as logged [s]; stated : the controller as the plant states it; ranged : whether PV's
    range is stated; neighbours : OPs of other loops on the same clock, each shape (n,);
    kind : the loop's type as stated, lower case; cycles : the faulty valve that its cycles show, None where they show
    none; free_valve : whether it cycles and its cycles convict no valve; period_s : of its cycle [s], 0 where it has
    none; limits : what decides about it.
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
        """Whether every scan of the controller is recorded; one that is not stated has the usual scan."""
        limits = self.limits.controller
        scans = self.dt_s / limits.typical_scan_s if self.stated is None else self.stated.scans
        return scans < limits.thinned

    @property
    def band(self) -> tuple[float, float] | None:
        """Shortest and longest period [samples] in which a model of the loop speaks and not its slow load: an eighth
        of its cycle and two of them, without a cycle all up to four integral times; None where neither is known."""
        if self.period_s > 0.0:
            cycle = self.period_s / self.dt_s
            return cycle / FINEST, CYCLES * cycle
        if self.stated is None or not 0.0 < self.stated.ti < self.pv.size / INTEGRALS:
            return None
        return 2.0, INTEGRALS * self.stated.ti


FINEST, CYCLES, INTEGRALS = 8.0, 2.0, 4.0
"""The loop's band: harmonics of a cycle up to the eighth, its second subharmonic, integral times; ours: play and
stick-slip show in the first seven harmonics, a load below half of the cycle's frequency."""
STEP = "step_pct"
"""Name of the number that says in which steps a finding leaves PV [% PV]."""


def straight(pv: Floats) -> Mask:
    """True where a moving trend is straight through three samples, shape (n,)."""
    out = np.zeros(pv.size, dtype=bool)
    rise = np.diff(pv)
    tiny = 2e-7 * max(float(np.abs(pv).max()), 1e-3)
    out[1:-1] = (np.abs(np.diff(rise)) < 3 * tiny) & (np.abs(rise[1:]) > 10 * tiny)
    return out


def level_gaps(pv: Floats) -> Floats:
    """Differences of neighbouring values that occur, in the middle nine tenths of the range; shape (levels - 1,)."""
    low, high = np.quantile(pv, [0.05, 0.95])
    return np.diff(np.unique(pv[(pv >= low) & (pv <= high)]))


def straightened(x: Floats, share: float, limits: RecorderLimits) -> bool:
    """Whether at least that share of a trend lies on straight lines that no grid makes; on one, differences of values
    are multiples of the smallest that is common."""
    gaps = level_gaps(x)
    if gaps.size < 5 or float(straight(x).mean()) < share:
        return False
    steps = gaps / float(np.quantile(gaps, 0.1))
    return float(np.mean(np.abs(steps - np.round(steps)) < 0.05)) <= limits.grid_multiples


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
    least = max(limits.jump_steps * float(np.quantile(gaps, 0.1)), limits.jump_share * float(high - low))
    return jump if jump > least else 0.0


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


def is_experiment(s: Recording) -> bool:
    """Whether OP was moved by hand or by a script: nothing is known of a controller, and OP does not answer PV.

    In a loop that cycles, so that PV tells OP's moves and is told by them, OP must stand still nearly always.
    """
    if s.sp is not None or s.stated is not None or fed_back(s.op, s.pv) >= s.limits.controller.feedback:
        return False
    cycles = s.cycles is not None or s.free_valve
    return not cycles or float(np.mean(np.diff(s.op) != 0.0)) < s.limits.controller.by_hand


def coarser_by(s: Recording) -> int:
    """Of how many samples of an experiment one tells all there is to tell of its process; 1 where each is needed."""
    limits = s.limits.search
    most = s.pv.size // limits.experiment_samples
    if most < 2:
        return 1
    fast = min(x.time_constant_s + x.dead_time_s for x in plain_processes(s.pv, s.op, s.usable, s.dt_s))
    return max(min(most, int(fast / (limits.samples_a_lag * s.dt_s))), 1)
