"""The search over the Kp-Ti plane: candidates that keep robustness and load rejection, scored on a load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.models import Fopdt, Integrator, Loop, Pid, Process
from identification.record import Floats
from identification.simulation.closed_loop import closed_loop, scan_step
from identification.simulation.lag import discretize, respond
from tuning.bench import Bench, Candidate, is_harmless, try_out
from tuning.describing import is_play
from tuning.limits import TuningLimits
from tuning.linear import integral_s, margins
from tuning.rules import effective_delay, simc

GAINS, TIMES = 11, 13
"""Points of the coarse grid in Kp and Ti."""
FINE = 5
"""Points of the fine grid in each direction, over one coarse step to either side of the best."""


@dataclass(frozen=True, slots=True)
class Rejection:
    """Answer of the linear loop to a unit step of load at the valve.

    peak [% PV / % OP]: largest deviation; integral [s % PV / % OP]: Ti/abs(Kp), the integral of the error.
    """

    peak: float
    integral: float


def rejection(process: Process, controller: Pid) -> Rejection:
    """Peak and integral of the error after a unit load step at the process's input, valve left out."""
    loop = Loop(process, replace(controller, op_lo=-1e9, op_hi=1e9))
    h = scan_step(loop)
    ti = integral_s(controller)
    horizon = 20.0 * effective_delay(process, h) + (2.0 * ti if math.isfinite(ti) else 0.0)
    steps = int(min(max(horizon / h, 100), 20_000))
    d = discretize(process, h)
    load = respond(np.r_[0.0, np.ones(steps)], d)
    pv = closed_loop(loop, np.zeros(load.size), load, op_start=0.0).pv
    return Rejection(float(np.abs(pv).max()), ti / abs(controller.kp))


def allowed(loop: Loop, limits: TuningLimits) -> Rejection:
    """The slowest rejection that a proposal may have: stated factors of the nominal, or the present one's.

    The integral's reference is nominal gain with Ti of at least T, for that is what play asks for. Beyond
    `integral_factor_ramp` times SIMC's own integral a longer Ti hardly slows the cycle further, so there only the
    rule itself, Ti = T at the present gain, goes on.
    """
    nominal = simc(loop.process, scan_s=scan_step(loop))
    best = rejection(loop.process, nominal)
    now = rejection(loop.process, loop.controller)
    lag = loop.process.time_constant_s if isinstance(loop.process, Fopdt) else 0.0
    longest = max(lag, nominal.ti_s)
    most = limits.integral_factor * longest / abs(nominal.kp)
    ramp = limits.integral_factor_ramp * nominal.ti_s / abs(nominal.kp)
    rule = longest / min(abs(nominal.kp), abs(loop.controller.kp))
    integral = ramp if isinstance(loop.process, Integrator) else max(min(most, ramp), min(1.5 * rule, most))
    present = now.integral if math.isfinite(now.integral) else 0.0
    return Rejection(max(limits.peak_factor * best.peak, now.peak), max(integral, present))


def rounded(x: float) -> float:
    """Three significant digits: what one types into a controller."""
    return float(f"{x:.3g}")


def _pairs(loop: Loop, gains: Floats, times: Floats) -> list[Pid]:
    sign = math.copysign(1.0, loop.controller.kp)
    return [
        replace(loop.controller, kp=rounded(sign * float(k)), ti_s=rounded(float(t)))
        for k in gains
        for t in times
    ]


def robust(loop: Loop, others: Sequence[Loop], controller: Pid, limits: TuningLimits) -> float | None:
    """Ms on the loop where it and those of all samples keep the limits, else None."""
    bounds = Bounds(limits.ms_most, (limits.ms_most_sample,) * len(others))
    return _within(loop, others, controller, bounds)


@dataclass(frozen=True, slots=True)
class Bounds:
    """Largest Ms [-] on the loop, and on each of its samples."""

    loop: float
    samples: tuple[float, ...]


def bounds_now(loop: Loop, others: Sequence[Loop], limits: TuningLimits) -> Bounds:
    """The limits, or the present tuning's own Ms where that is larger, the loop's up to the samples' limit.

    A loop that has run for years at its present Ms is not made less robust by settings with no more; a valve model
    that takes a jump for play asks for twice the gain of the process, and its Ms is then too high by as much.
    """
    most = limits.ms_most_sample
    own = max(limits.ms_most, min(margins(loop).ms, most))
    finite = (margins(one).ms for one in others)
    return Bounds(own, tuple(max(most, ms if math.isfinite(ms) else most) for ms in finite))


def _within(loop: Loop, others: Sequence[Loop], controller: Pid, bounds: Bounds) -> float | None:
    ms = margins(replace(loop, controller=controller)).ms
    if ms > bounds.loop:
        return None
    pairs = zip(others, bounds.samples, strict=True)
    fits = all(margins(replace(one, controller=controller)).ms <= most for one, most in pairs)
    return ms if fits else None


def _kept(table: Bench, most: Rejection, pairs: list[Pid]) -> list[Candidate]:
    """Those of the pairs that keep robustness, load rejection and error, tried on every loop."""
    loop, others = table.loops[0], table.loops[1:]
    bounds = bounds_now(loop, others, table.limits)
    found = []
    for pid in pairs:
        if pid.ti_s / abs(pid.kp) > most.integral:
            continue
        ms = _within(loop, others, pid, bounds)
        if ms is None or rejection(loop.process, pid).peak > most.peak:
            continue
        if try_out(table, pid, ms, 1).error <= table.limits.error_growth:
            found.append(try_out(table, pid, ms))
    return [c for c in found if is_harmless(c, table)]


def _grid(loop: Loop, most: Rejection, limits: TuningLimits) -> tuple[Floats, Floats]:
    """Gains [% OP / % PV] and integral times [s] of the coarse grid.

    With play before a lag no integral time is shorter than the time constant (the source study's Eq. 6).
    """
    nominal, now = simc(loop.process, scan_s=scan_step(loop)), loop.controller
    high = min(limits.gain_up * abs(now.kp), 2.0 * abs(nominal.kp))
    down = limits.gain_down_play if is_play(loop.valve) else limits.gain_down_stick
    low = min(limits.gain_down * abs(now.kp), down * abs(nominal.kp))
    shortest = 0.5 * min(integral_s(now), nominal.ti_s)
    if is_play(loop.valve) and isinstance(loop.process, Fopdt):
        shortest = loop.process.time_constant_s
    longest = max(most.integral * high, 2.0 * shortest)
    return np.geomspace(low, high, GAINS), np.geomspace(shortest, longest, TIMES)


def search(table: Bench) -> tuple[Candidate, ...]:
    """Candidates from best to worst, tried on all loops of the bench; empty where none keeps the limits.

    A logarithmic grid over Kp and Ti, then a finer one around its best.
    """
    loop = table.loops[0]
    most = allowed(loop, table.limits)
    gains, times = _grid(loop, most, table.limits)
    coarse = _kept(table, most, _pairs(loop, gains, times))
    if not coarse:
        return ()
    best = min(coarse, key=lambda c: c.score).controller
    step = np.linspace(-1.0, 1.0, FINE)
    longer = np.maximum(best.ti_s * (times[1] / times[0]) ** step, times[0])
    fine = _pairs(loop, abs(best.kp) * (gains[1] / gains[0]) ** step, np.unique(longer))
    return tuple(sorted(coarse + _kept(table, most, fine), key=lambda c: c.score))
