"""Present, recommended and textbook settings of one flagged loop on its night's residual load, and the alternatives
for an engineer's choice."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.models import Loop, Pid
from identification.record import Floats, LoopRecord
from reports.pages import as_held
from tuning.forecast import RECOMMENDED, REPAIRED, Tried, alternatives, loop_in_digits, tried
from tuning.frequency_response import integral_s
from tuning.harmonic_balance import TravelMap, travel_map
from tuning.limit_cycle import confirm
from tuning.limits import TuningLimits
from tuning.rules import simc
from tuning.search import Candidate, LoadedLoop, bench, rejection, try_out
from tuning.trade import Trade, trade

SAME_TRAVEL = 0.01  # Difference of travel over the present one that an engineer ignores
CYCLE_WITHIN = 1.5
"""Factor within which the simulated limit cycle has the recorded period for a report of a repair's effect: a
loop that cycled every 17 min and every 66 min by simulation was predicted eighty times the travel with a
repaired valve."""

MAP_POINTS, SPREAD = 24, 12.0
"""Points of the travel map along each axis, and its range about the present settings; ours."""
BEYOND = 1.5
"""Range of the map beyond the outermost settings [-]; ours."""
SHOWN_PERIODS, SHOWN_POINTS = 8.0, 240
"""Periods of each simulation in a picture, and its points at most; ours."""


@dataclass(frozen=True, slots=True)
class Shown:
    """Part of one simulation: seconds and error, shape (n,) each [s, % PV]."""

    time_s: Floats
    error: Floats


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of settings of one loop.

    loop, the identified one with its present controller; load [% PV] on the controller's clock, shape (n,); tried, in
    the order of the report; shown, a part of each simulation by name; travel, the map of the limit cycle's travel,
    None if the valve is free; pv_span, that of PV in its own unit; peaks, largest error after a unit step of load at
    the valve, over the present one, by name [-]; everywhere, each on all loops that the data allow, by name; curve,
    settings that no others improve in both travel and error, the calmest first; repaired, the present settings with a
    free valve, None if it is free or does not move, or the loop does not cycle as recorded.
    """

    loop: Loop
    load: Floats
    tried: tuple[Tried, ...]
    shown: Mapping[str, Shown]
    travel: TravelMap | None
    pv_span: float
    peaks: Mapping[str, float]
    everywhere: Mapping[str, Candidate]
    curve: tuple[Candidate, ...]
    repaired: Tried | None


def _piece(record: LoopRecord, period_s: float) -> Shown:
    """The end of a simulation, thinned."""
    count = min(len(record), max(round(SHOWN_PERIODS * period_s / record.dt_s), 20))
    every = max(count // SHOWN_POINTS, 1)
    part = record.span(len(record) - count, len(record))
    return Shown(part.time_s[::every] - part.time_s[0], part.error[::every])


def middle_ti(loop: Loop) -> float:
    """Integral time [s] at the centre of a map: the present one, SIMC's if the integral is off."""
    ti = integral_s(loop.controller)
    return ti if math.isfinite(ti) else simc(loop.process, scan_s=max(loop.controller.scan_s, 1.0)).ti_s


def _map_of_settings(loop: Loop, settings: Sequence[Pid]) -> TravelMap | None:
    """The travel map about the present settings, with range to the others."""
    if loop.valve is None:
        return None
    c, now_s = loop.controller, middle_ti(loop)
    gains = np.array([abs(pid.kp / c.kp) for pid in settings])
    times = np.array([pid.ti_s for pid in settings if math.isfinite(pid.ti_s)])
    low, high = min(1.0 / SPREAD, gains.min() / BEYOND), max(SPREAD, gains.max() * BEYOND)
    kp = c.kp * np.geomspace(low, high, MAP_POINTS)
    first, last = min(now_s / 4.0, times.min() / BEYOND), max(SPREAD * now_s, times.max() * BEYOND)
    return travel_map(loop, kp, np.geomspace(first, last, MAP_POINTS))


def _beaten(name: str, everywhere: Mapping[str, Candidate]) -> bool:
    """Whether the recommended settings have no more travel and error, on all loops that the data allow."""
    best, own = everywhere.get(RECOMMENDED), everywhere[name]
    if best is None:
        return False
    return best.worst_travel <= own.worst_travel + SAME_TRAVEL and best.worst_error <= own.worst_error


def cycles_as(loop: Loop, period_s: float) -> bool:
    """Whether simulation gives the recorded cycle at the present settings, so that its result for another valve is
    credible."""
    found = confirm(loop).cycle
    return found is not None and abs(math.log(found.period_s / period_s)) <= math.log(CYCLE_WITHIN)


def compared(
    loop: Loop,
    load: Floats,
    new: Pid | None,
    period_s: float,
    pv_span: float,
    limits: TuningLimits,
    others: Sequence[Loop] = (),
    indistinguishable: Sequence[LoadedLoop] = (),
) -> Comparison | None:
    """Present, recommended and textbook settings of an identified loop; None if its load is too short for that.

    load is load and noise on the controller's clock [% PV], shape (n,); period_s, of the recorded cycle [s]; pv_span,
    the span of PV in its own unit; others, other possible loops, on which each is tried too; indistinguishable as in
    tuning.search.bench.
    """
    if load.size < limits.least_steps or loop.process.slope * loop.controller.kp <= 0.0:
        return None
    loop, load = loop_in_digits(loop), as_held(load)
    table = bench(loop, others, load, limits, indistinguishable)
    moves = table.travel[0] > 0.0  # a constant stem cannot become calmer, and a ratio means nothing
    found = trade(table) if moves else Trade((), {})
    settings = alternatives(loop, new, {name: c.controller for name, c in found.chosen.items()})
    everywhere = {name: try_out(table, pid) for name, pid in settings.items()} if moves else {}
    settings = {k: pid for k, pid in settings.items() if k not in found.chosen or not _beaten(k, everywhere)}
    now, each = rejection(loop.process, loop.controller), tried(loop, load, settings)
    free = (
        replace(loop, valve=None) if loop.valve is not None and moves and cycles_as(loop, period_s) else None
    )
    return Comparison(
        loop,
        load,
        each,
        {t.name: _piece(t.record, period_s) for t in each},
        _map_of_settings(loop, tuple(settings.values())),
        pv_span,
        {name: rejection(loop.process, pid).peak / now.peak for name, pid in settings.items()},
        everywhere,
        found.curve,
        None if free is None else tried(free, load, {REPAIRED: loop.controller})[0],
    )
