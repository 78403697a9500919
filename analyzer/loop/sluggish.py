"""Settings for a calm loop that answers far more slowly than its process allows.

Moves of the set point make its process known, at a finer clock than its own slow settings ask for. Where SIMC's
settings for every process that the record allows reject loads several times faster, and take a fair part of the error
off by simulation, they are advised.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

from scipy.signal import detrend

from analyzer.config import Config
from analyzer.lanes.standing import AVERAGING
from analyzer.loop.fit_window import window_of
from analyzer.loop.identified import intervals, load_of, tuned
from analyzer.loop.measure import time_scale
from analyzer.loop.ringing import between_samples
from identification.errors import NotAssessedError
from identification.estimation.backlash_stiction import fit_linear
from identification.estimation.descent import reaching
from identification.estimation.window import Fit
from identification.models import Estimate, Integrator, Loop, Pid, Process
from identification.record import LoopRecord
from tuning.forecast import in_digits
from tuning.from_test import settings_from
from tuning.rules import simc
from tuning.search import mean_error, rounded

CLOCKS = (4.0, 16.0)
"""Times finer than the present settings ask for at which the process is identified: SIMC's integral times of sluggish
loops are that much shorter."""


@dataclass(frozen=True, slots=True)
class FasterSettings:
    """New settings [%, s] of a sluggish loop, how many times faster they reject a load (Kp/Ti over the present one)
    [-], and the change of the average absolute error that simulation finds [-]."""

    new: Pid
    times: float
    change: float


def faster_settings(
    record: LoopRecord, controller: Pid | None, kind: str, config: Config
) -> FasterSettings | None:
    """Settings for a loop without a cycle; None where it is not sluggish, is slow on purpose as levels are, or its
    process is not known well enough. controller, its present settings [%, s]; kind, its type."""
    if controller is None or kind.strip().lower() == AVERAGING or record.sp_estimated:
        return None
    if not math.isfinite(controller.ti_s) or controller.kp == 0.0 or controller.td_s > 0.0:
        return None
    fits = _known_fits(record, controller, kind, config)
    if not fits:
        return None
    fit, known = fits[0], intervals(fits[0], False, config.advice)
    known["dead_time_s"] = reaching(known["dead_time_s"], *(other.dead_time_s for other in fits[1:]))
    process = between_samples(tuned(fit, False, config.advice), fit.window, controller)
    return _proposed(fit, process, _allowed(process, known), controller, config)


def _known_fits(record: LoopRecord, controller: Pid, kind: str, config: Config) -> list[Fit]:
    """The fits behind an ideal valve on the clocks on which slope and dead time are sure, the coarsest first."""
    found: list[Fit] = []
    limits, scale_s = config.lanes, time_scale(record, None, controller)
    for finer in CLOCKS:
        try:
            window = window_of(record, scale_s / finer, config.cause, kind, calm=True)
            fit = fit_linear(window, scale_s / finer)
        except (NotAssessedError, ArithmeticError, ValueError):
            continue
        if window.sp is None or fit.slope * controller.kp <= 0.0:
            continue
        known = intervals(fit, False, config.advice)
        slope, dead = known["slope_pct_per_s"], known["dead_time_s"]
        sure = 0.5 * abs(slope.high - slope.low) <= limits.sluggish_unsure * abs(slope.value)
        late = dead.high <= dead.low * limits.sluggish_late + window.dt_s
        if sure and late:
            found.append(fit)
    return found


def _allowed(process: Process, known: dict[str, Estimate]) -> tuple[Process, ...]:
    """The process, and those at the ends of what the record leaves open of slope and dead time."""
    slope, dead = known["slope_pct_per_s"], known["dead_time_s"]
    late = [max(process.dead_time_s + end - dead.value, 0.0) for end in (dead.low, dead.high)]
    ends = product((slope.low, slope.high), late)
    if isinstance(process, Integrator):
        return process, *(Integrator(s, d) for s, d in ends)
    return process, *(replace(process, gain=process.gain * s / slope.value, dead_time_s=d) for s, d in ends)


def _proposed(
    fit: Fit, process: Process, allowed: tuple[Process, ...], present: Pid, config: Config
) -> FasterSettings | None:
    limits = config.lanes
    try:
        found = settings_from(process, allowed, present.scan_s)
    except ValueError:  # no delay to speak of
        return None
    most = limits.sluggish_most * abs(present.kp)
    kp = math.copysign(min(abs(found.robust.kp), most), present.kp)
    new = replace(present, kp=rounded(kp), ti_s=rounded(found.robust.ti_s))
    plain = [simc(p, scan_s=present.scan_s) for p in allowed]
    if min(abs(pid.ki) for pid in (new, *plain)) < limits.sluggish_times * abs(present.ki):
        return None
    times = new.kp / new.ti_s / present.ki
    load = in_digits(detrend(load_of(fit, present)))  # a loop at work has long answered what stays, or drifts
    loop = Loop(between_samples(fit.process, fit.window, present), present)  # the one that leaves this load
    change = mean_error((loop,), new, load) / max(mean_error((loop,), present, load), 1e-9) - 1.0
    return FasterSettings(new, times, change) if change <= -limits.sluggish_gain else None
