"""Settings for a loop without a fault of its own, whose process set point moves identify: calm and far slower than
its process allows, or moved by an external cycle that it could reject.

The process is identified at a finer clock than slow settings require. A calm loop gets new settings if SIMC's for
every process that the record allows reject loads several times faster, and reduce the error considerably in
simulation. If not, but the likeliest process permits several times as much and every process that the record allows
twice the present gain, that is advised as a first step: the next set point moves then give more information.
Against an external
cycle those robust settings are advised that reduce the error considerably under the load of the night, on every
process that the record allows, with the least product of error and travel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from analyzer.config import Config
from analyzer.lanes.figures import AVERAGING
from analyzer.loop.identification.fit_data import problem_of
from analyzer.loop.identification.identified import error_of_night, load_of, load_of_night, tuned
from analyzer.loop.identification.intervals import intervals
from analyzer.loop.identification.measure import time_scale
from analyzer.loop.identification.ringing import between_samples
from identification.errors import NotAssessedError
from identification.estimation.backlash_stiction import fit_linear
from identification.estimation.descent import reaching
from identification.estimation.model import Fitted
from identification.models import Estimate, Integrator, Loop, Pid, Process
from identification.record import LoopRecord
from tuning.forecast import in_digits
from tuning.from_test import settings_from
from tuning.rules import simc
from tuning.search import figures, rounded

FIRST_STEP = 2.0
"""Factor of a first step of the gain: that of a careful engineer; SIMC's own gain margin is 3 (Skogestad 2003)."""
SHARES = (1.0, 0.85, 0.7, 0.5)
"""Shares of the largest robust gain that are tried against an external cycle: ours."""
BIASED = 1.5
"""Factor by which the slope may be larger than its interval in a loop with an external cycle, which looks like its
process: ours, benchmarks/world (seed 635, every 10 s) has 1.4."""
CLOCKS = (4.0, 16.0)
"""Factors by which the process is identified on a finer clock than the present settings require: SIMC's integral
times of sluggish loops are that much shorter."""
Known = tuple[Fitted, dict[str, Estimate]]
"""A fit with the intervals of its constants."""


@dataclass(frozen=True, slots=True)
class FasterSettings:
    """New settings [%, s], the factor by which they reject a load faster (Kp/Ti over the present one) [-], and the
    changes of the average absolute error and of the valve's travel in simulation [-], None of a first step; the loop
    on which they are based, its fit, and the loops at the limits that the record allows."""

    new: Pid
    times: float
    change: float | None
    travel: float | None
    loop: Loop
    fit: Fitted
    others: tuple[Loop, ...]


def faster_settings(
    record: LoopRecord, controller: Pid | None, kind: str, config: Config
) -> FasterSettings | None:
    """Settings for a loop without a cycle, or a first step to them; None if it is not sluggish, is slow on purpose as
    levels are, or its process is not known well enough. controller, its present settings [%, s]; kind, its type."""
    fits = _fits(record, controller, kind, config)
    if controller is None or not fits:
        return None
    precise = [x for x in fits if _is_precise(x, config)]
    first_step = _first_step(precise or fits, controller, config)
    if not precise:
        return first_step
    return _proposed(precise[0][0], _possible(precise, controller, config), controller, config) or first_step


def rejecting_settings(
    record: LoopRecord, controller: Pid | None, kind: str, config: Config
) -> FasterSettings | None:
    """Settings with which a loop rejects an external cycle considerably better; None if there are none, or if set
    point moves do not identify its process. Arguments as of `faster_settings`."""
    fits = [x for x in _fits(record, controller, kind, config) if _is_precise(x, config)]
    if controller is None or not fits:
        return None
    fit, possible = fits[0][0], _possible(fits, controller, config, BIASED)
    robust = _robust(possible, controller, config)
    if robust is None:
        return None
    night = load_of_night(fit, controller, record, time_scale(record, None, controller))
    load, loops = in_digits(night), [Loop(p, controller) for p in possible]
    now = np.array([figures(one, load) for one in loops])
    recorded = error_of_night(record, controller)
    if abs(math.log(max(now[0, 1], 1e-9) / max(recorded, 1e-9))) > math.log(config.advice.agree_error):
        return None
    best = None
    for share in SHARES:
        new = replace(robust, kp=rounded(share * robust.kp))
        ratio = np.array([figures(replace(one, controller=new), load) for one in loops]) / np.maximum(
            now, 1e-9
        )
        helps = ratio[:, 1].max() <= 1.0 - config.lanes.sluggish_gain and abs(new.kp) >= abs(controller.kp)
        if helps and (best is None or ratio[0].prod() < best[1].prod()):
            best = new, ratio[0]
    if best is None:
        return None
    new, (travel, error) = best
    times = new.ki / controller.ki
    return FasterSettings(new, times, error - 1.0, travel - 1.0, loops[0], fit, tuple(loops[1:]))


def _possible(
    precise: list[Known], controller: Pid, config: Config, biased: float = 1.0
) -> tuple[Process, ...]:
    """The process of the coarsest clock, and those at the limits of slope and of the dead time of all clocks; biased,
    factor by which the slope may be beyond its limit [-]."""
    fit, known = precise[0]
    slope = known["slope_pct_per_s"]
    if abs(slope.high) > abs(slope.low):
        slope = replace(slope, high=biased * slope.high)
    else:
        slope = replace(slope, low=biased * slope.low)
    dead = reaching(known["dead_time_s"], *(other.dead_time_s for other, _ in precise[1:]))
    process = between_samples(tuned(fit, False, config.advice), fit.p, controller)
    return _allowed(process, {"slope_pct_per_s": slope, "dead_time_s": dead})


def _fits(record: LoopRecord, controller: Pid | None, kind: str, config: Config) -> list[Known]:
    """The fits with an ideal valve on all clocks, the coarsest first, in which the set point moves; none for a loop
    that is slow on purpose, or whose controller is no PI, and none if the clocks contradict each other: one of them
    has then found another process, however precise it seems."""
    if controller is None or kind.strip().lower() == AVERAGING or record.sp_estimated:
        return []
    if not math.isfinite(controller.ti_s) or controller.kp == 0.0 or controller.td_s > 0.0:
        return []
    found: list[Known] = []
    scale_s = time_scale(record, None, controller)
    for finer in CLOCKS:
        try:
            problem = problem_of(record, scale_s / finer, config.cause, kind, calm=True)
            fit = fit_linear(problem, scale_s / finer)
        except (NotAssessedError, ArithmeticError, ValueError):
            continue
        if problem.blocks.sp is not None and fit.slope * controller.kp > 0.0:
            found.append((fit, intervals(fit, False, config.advice)))
    slopes = [known["slope_pct_per_s"] for _, known in found]
    agree = all(a.low <= b.high and b.low <= a.high for a, b in combinations(slopes, 2))
    return found if agree else []


def _is_precise(x: Known, config: Config) -> bool:
    """Whether slope and dead time are known well enough for settings."""
    fit, known = x
    slope, dead, limits = known["slope_pct_per_s"], known["dead_time_s"], config.lanes
    sure = 0.5 * abs(slope.high - slope.low) <= limits.sluggish_unsure * abs(slope.value)
    return sure and dead.high <= dead.low * limits.sluggish_late + fit.p.dt_s


def _first_step(fits: list[Known], present: Pid, config: Config) -> FasterSettings | None:
    """A first step of the gain, if the likeliest process of each fit is far from its settings and all that the fits
    allow permit it."""
    if not fits or min(known["slope_pct_per_s"].low * present.kp for _, known in fits) <= 0.0:
        return None
    likeliest = [between_samples(tuned(fit, False, config.advice), fit.p, present) for fit, _ in fits]
    allowed = [p for x, (_, known) in zip(likeliest, fits, strict=True) for p in _allowed(x, known)]
    try:
        slow = min(abs(simc(p, scan_s=present.scan_s).ki / present.ki) for p in likeliest)
        room = min(abs(simc(p, scan_s=present.scan_s).kp / present.kp) for p in allowed)
    except ValueError:  # no significant delay
        return None
    if room < FIRST_STEP or slow < config.lanes.sluggish_times:
        return None
    loops = [Loop(p, present) for p in (likeliest[0], *allowed)]
    new = replace(present, kp=rounded(FIRST_STEP * present.kp))
    return FasterSettings(new, FIRST_STEP, None, None, loops[0], fits[0][0], tuple(loops[1:]))


def _allowed(process: Process, known: dict[str, Estimate]) -> tuple[Process, ...]:
    """The process, and those at the limits of slope and dead time in the record."""
    slope, dead = known["slope_pct_per_s"], known["dead_time_s"]
    late = [max(process.dead_time_s + end - dead.value, 0.0) for end in (dead.low, dead.high)]
    ends = product((slope.low, slope.high), late)
    if isinstance(process, Integrator):
        return process, *(Integrator(s, d) for s, d in ends)
    return process, *(replace(process, gain=process.gain * s / slope.value, dead_time_s=d) for s, d in ends)


def _robust(possible: tuple[Process, ...], present: Pid, config: Config) -> Pid | None:
    """The fastest robust settings for all possible processes, of no more than some times the present gain."""
    try:
        found = settings_from(possible[0], possible, present.scan_s).robust
    except ValueError:  # no significant delay
        return None
    kp = math.copysign(min(abs(found.kp), config.lanes.sluggish_most * abs(present.kp)), present.kp)
    return replace(present, kp=rounded(kp), ti_s=rounded(found.ti_s))


def _proposed(
    fit: Fitted, allowed: tuple[Process, ...], present: Pid, config: Config
) -> FasterSettings | None:
    limits, new = config.lanes, _robust(allowed, present, config)
    if new is None:
        return None
    plain = [simc(p, scan_s=present.scan_s) for p in allowed]
    if min(abs(pid.ki) for pid in (new, *plain)) < limits.sluggish_times * abs(present.ki):
        return None
    times = new.kp / new.ti_s / present.ki
    load = in_digits(load_of(fit, present))
    loop = Loop(between_samples(fit.process, fit.p, present), present)  # the loop with this load
    after, before = (figures(replace(loop, controller=c), load) for c in (new, present))
    travel, change = (a / max(b, 1e-9) - 1.0 for a, b in zip(after, before, strict=True))
    if change > -limits.sluggish_gain:
        return None
    return FasterSettings(new, times, change, travel, loop, fit, tuple(Loop(p, present) for p in allowed))
