"""Does the answer stay the same where the fault stays the same? Each loop as it is, and in everyday variations that
do not change its fault: python -m benchmarks.world.pairs --seed 1 --each 8 --kinds backlash tight --ways "rows
missing" "SP moves"."""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.world.__main__ import night_rows, right
from benchmarks.world.draw import HOURS, KINDS, Drawn, drawn, run, wander
from benchmarks.world.recorder import WAYS, Recording, recorded
from benchmarks.world.simulate import Floats, Trends, Valve
from proofs.common import command_line, table

DAYS = (
    *("another day", "SP moves", "PV filter", "manual spell", "ten hours of it"),
    *("SP ramps", "a master's SP", "load ramps", "bent valve curve"),
)
"""Variations of the day itself: another load; eight set point moves; a filter of 5 s on the controller's PV, which
loops.csv does not state; three hours in manual, which no mode states; fourteen hours of the same loop without the
fault, then ten hours with it; six set point ramps of 20 minutes; the set point of a master, a random walk; three
changes of throughput, each a load ramp of an hour and a half; a valve whose gain changes with its opening."""
RAMPS, RAMP_S, MASTER_S, MASTER = 6, 1200, 1800.0, 1.0
"""Set point ramps a day, their duration [s], corner time [s] and standard deviation [% PV] of a master's set
point."""
THROUGHPUT, BEND = 10.0, 1.0
"""Standard deviation of a change of throughput [% OP], and curvature of the valve characteristic [-]."""
DAY_S = HOURS * 3600
MANUAL = (0.4, 0.525)
"""The time in manual, as shares of the day."""
FITTING = 3.5
"""Factor of a process gain for which the settings of a loop that is too tight are right. Such loops are drawn with
2.2 to 3.6 times the gain, or a third to a fourteenth of the integral time."""
WITH_FAULT = 10.0
"""Hours with the fault at the end of a day without a fault."""
UNSTATED = "settings unstated"
"""The unchanged record of a loop for which loops.csv has no settings."""
SIZE, PERIOD = 0.2, 0.05
"""Changes of size and period from which an answer counts as changed."""


def varied(d: Drawn, way: str) -> Recording:
    """One loop's day in one of WAYS or DAYS."""
    if way == "another day":
        return recorded(run(d, day=1), "plain", d.seed)
    if way == "SP moves":
        return recorded(run(replace(d, moves=8.0)), "plain", d.seed)
    if way == "PV filter":
        return recorded(run(d, settings=replace(d.controller, pv_filter_s=5.0)), "plain", d.seed)
    if way == "manual spell":
        at = np.arange(run(d).pv.size) / run(d).pv.size
        return recorded(run(d, auto=(at < MANUAL[0]) | (at >= MANUAL[1])), "plain", d.seed)
    if way == "SP ramps":
        return recorded(run(d, sp=50.0 + ramps(d, RAMPS, RAMP_S, 3.0)), "plain", d.seed)
    if way == "a master's SP":
        master = MASTER * wander(np.random.default_rng([d.seed, 5]), DAY_S, MASTER_S, 1.0)
        return recorded(run(d, sp=50.0 + master), "plain", d.seed)
    if way == "load ramps":
        return recorded(run(d, more=ramps(d, 3, 5400, THROUGHPUT)), "plain", d.seed)
    if way == "bent valve curve":
        return recorded(run(replace(d, process=replace(d.process, bend=BEND))), "plain", d.seed)
    if way == "ten hours of it":
        return recorded(joined(before_fault(d), run(d)), "plain", d.seed)
    return recorded(run(d), way, d.seed)


def ramps(d: Drawn, count: int, duration_s: int, size: float) -> Floats:
    """`count` ramps a day to drawn levels about 0 with a standard deviation [% of span], one value a second."""
    rng = np.random.default_rng([d.seed, 6])
    begins = np.sort(rng.choice(DAY_S // duration_s - 1, count, replace=False)) * duration_s
    levels = np.concatenate(([0.0], size * rng.standard_normal(count)))
    at = np.stack((begins, begins + duration_s), axis=1).ravel()
    return np.interp(np.arange(DAY_S), at, np.repeat(levels, 2)[1:-1])


def before_fault(d: Drawn) -> Trends:
    """The hours before the fault: the loop with a new valve and without its periodic load. A loop that is too tight
    has a process gain for which its settings are right."""
    process = replace(d.process, gain=d.process.gain / FITTING) if d.cause == "tuning" else d.process
    good = replace(d, kind="healthy", valve=Valve(), process=process)
    return run(good, day=1, hours=HOURS - WITH_FAULT, alike=True)


def joined(first: Trends, day: Trends) -> Trends:
    """Hours of a loop, followed by the last hours of a day of it."""
    n = first.pv.size
    both = (np.concatenate((getattr(first, x), getattr(day, x)[n:])) for x in ("sp", "pv", "op", "stem"))
    return Trends(*both, first.scan_s)


def size(row: dict[str, Any]) -> float | None:
    """Width of the fault [% of OP's span], None where none is stated."""
    width = row["backlash_pct"] or row["stickband_pct"]
    return None if width is None else float(width)


def _off(a: float | None, b: float | None, most: float) -> bool:
    return a is not None and b is not None and abs(b / a - 1.0) > most


def changes(before: dict[str, Any], after: dict[str, Any], way: str) -> list[str]:
    """The changed parts of an answer: cause, fault, size, action, and the period where the day is the same."""
    found = [name for name in ("cause", "valve_fault", "action") if before[name] != after[name]]
    found += ["size"] if _off(size(before), size(after), SIZE) else []
    longer = way not in DAYS and _off(before["period_s"], after["period_s"], PERIOD)
    return found + (["period"] if longer else [])


def _compared(d: Drawn, way: str, before: dict[str, Any], after: dict[str, Any], show: bool) -> list[str]:
    """The changes of one loop, printed with --show."""
    found = changes(before, after, way)
    if show and (found or not right(d, after)):
        names = ("cause", "valve_fault", "action", "period_s", "reason")
        answer = ["/".join(str(row[n]) for n in names) for row in (before, after)]
        print(
            f"{d.seed} {d.name} {way} {found} right {right(d, after)}: {answer[0]} -> {answer[1]}",
            file=sys.stderr,
        )
    return found


def main() -> None:
    """Draw, vary, assess, compare."""
    options = command_line(
        __doc__, seed=[1], each=8, ways=[*WAYS[1:], *DAYS, UNSTATED], jobs=2, kinds=list(KINDS), show=False
    )
    counts: dict[str, Counter[str]] = {way: Counter() for way in ("plain", *options.ways)}
    for seed in options.seed:
        for kind in options.kinds:
            loops = drawn(seed, options.each, (kind,))
            plain = night_rows(loops, {d.name: varied(d, "plain") for d in loops}, options.jobs)
            counts["plain"].update(right=sum(right(d, plain[d.name]) for d in loops))
            for way in options.ways:
                records = {d.name: varied(d, "plain" if way == UNSTATED else way) for d in loops}
                rows = night_rows(loops, records, options.jobs, stated=way != UNSTATED)
                for d in loops:
                    found = _compared(d, way, plain[d.name], rows[d.name], options.show)
                    counts[way].update(found, changed=int(bool(found)), right=int(right(d, rows[d.name])))
    n = options.each * len(options.seed) * len(options.kinds)
    parts = ("right", "changed", "cause", "valve_fault", "size", "period", "action")
    print(
        table(
            "recording|" + "|".join(parts),
            [(f"{w} ({n})", *(c[p] for p in parts)) for w, c in counts.items()],
        )
    )


if __name__ == "__main__":
    main()
