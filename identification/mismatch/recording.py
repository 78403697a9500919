"""One recording to be explained, and what is found in it before any physics is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from identification.controller.check import StatedSettings
from identification.limits import LIMITS, ExplainLimits
from identification.models import Backlash, Estimate, Fopdt, Stiction
from identification.record import Floats, Mask

TYPICAL_SCAN_S = 1.0
"""Scan of a controller that is not stated [s]; most control systems execute loops at 0.25 to 1 s."""


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
class Circumstances:
    """What is known of a recording beside its trends, by which effects are asked about or not.

    kind : the loop's type, lower case; every_scan : whether every scan of the controller is recorded; free_valve :
    whether the loop cycles and its cycles do not convict the valve.
    """

    kind: str = ""
    every_scan: bool = True
    free_valve: bool = False


@dataclass(frozen=True, slots=True)
class Recording:
    """One recording to be explained.

    sp : shape (n,) [% PV], None where not recorded; pv, op : shape (n,) [% of span]; usable : bool, shape (n,);
    dt_s [s]; stamp_s : stamps as logged [s]; stated : the controller as the plant states it; ranged : whether PV's
    range is stated; neighbours : OPs of other loops on the same clock, each shape (n,);
    kind : the loop's type as stated, lower case; cycles : the faulty valve that its cycles show, None where they show
    none; free_valve : whether it cycles and its cycles convict no valve; limits : what decides about it.
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
    limits: ExplainLimits = LIMITS

    @property
    def circumstances(self) -> Circumstances:
        """By which effects are asked about or not; a controller that is not stated has TYPICAL_SCAN_S."""
        scans = self.dt_s / TYPICAL_SCAN_S if self.stated is None else self.stated.scans
        thinned = scans >= self.limits.controller.thinned
        return Circumstances(self.kind, not thinned, self.free_valve)


STEP = "step_pct"
"""Name of the number that says in which steps a finding leaves PV [% PV]."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What was found about recorder or controller: its numbers, where it is (bool, shape (n,)), the effect's name."""

    values: Mapping[str, float]
    where: Mask = field(repr=False)
    name: str = ""
