"""Settings for a calm loop whose response is far slower than its process allows.

Set point moves identify its process, at a finer clock than its own slow settings require. If SIMC's settings for
every process that the record allows reject loads several times faster, and reduce the error considerably in
simulation, they are advised.
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
"""Factors by which the process is identified on a finer clock than the present settings require: SIMC's integral
times of sluggish loops are that much shorter."""


@dataclass(frozen=True, slots=True)
class FasterSettings:
    """New settings [%, s] of a sluggish loop, the factor by which they reject a load faster (Kp/Ti over the present
    one) [-], and the change of the average absolute error in simulation [-]."""

    new: Pid
    times: float
    change: float


def faster_settings(
    record: LoopRecord, controller: Pid | None, kind: str, config: Config
) -> FasterSettings | None:
    """Settings for a loop without a cycle; None if it is not sluggish, is slow on purpose as levels are, or its
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
    """The fits with an ideal valve on the clocks on which slope and dead time are precise, the coarsest first."""
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
    """The process, and those at the limits of slope and dead time in the record."""
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
    except ValueError:  # no significant delay
        return None
    most = limits.sluggish_most * abs(present.kp)
    kp = math.copysign(min(abs(found.robust.kp), most), present.kp)
    new = replace(present, kp=rounded(kp), ti_s=rounded(found.robust.ti_s))
    plain = [simc(p, scan_s=present.scan_s) for p in allowed]
    if min(abs(pid.ki) for pid in (new, *plain)) < limits.sluggish_times * abs(present.ki):
        return None
    times = new.kp / new.ti_s / present.ki
    load = in_digits(detrend(load_of(fit, present)))  # a working loop has compensated offset and drift
    loop = Loop(between_samples(fit.process, fit.window, present), present)  # the loop with this load
    change = mean_error((loop,), new, load) / max(mean_error((loop,), present, load), 1e-9) - 1.0
    return FasterSettings(new, times, change) if change <= -limits.sluggish_gain else None
