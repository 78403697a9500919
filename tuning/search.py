"""Search over the Kp-Ti plane: candidates that keep robustness and load rejection, scored under a load.

They are tested on a bench: the loops consistent with the data, each with a load, and the present figures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from itertools import product

import numpy as np

from identification.models import Fopdt, Integrator, Loop, Pid, Process
from identification.record import Floats
from identification.simulation.closed_loop import closed_loop, scan_step
from identification.simulation.lag import discretize, respond
from tuning.describing import band, is_backlash
from tuning.forecast import in_digits, loop_in_digits, run, settled
from tuning.frequency_response import integral_s, maximum_sensitivity, rejects_s, slowest_s
from tuning.limits import TuningLimits
from tuning.rules import effective_delay, simc

GAINS, TIMES = 11, 13
"""Points of the coarse grid in Kp and Ti."""
ALONE = 4.0
"""Reach of the grid of a controller with integral action alone, to either side of its present integral time: ours."""
FINE = 5
"""Points of the fine grid in each direction, over one coarse step to either side of the best."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A pair of settings and its results in the model.

    ms [-]; travel and error: stem travel and average absolute error over those of the present tuning [-], means over
    the loops simulated; worst_travel and worst_error the largest of these; score: lower is better.
    """

    controller: Pid
    ms: float
    travel: float
    error: float
    worst_travel: float
    worst_error: float
    score: float


@dataclass(frozen=True, slots=True)
class Bench:
    """Test bench of candidates: loops with the present controller, loads, and the present figures.

    Every other loop gets the load in reverse: a second record of the same kind, because the motion of a sticking stem
    depends on the exact load.

    travel [%/h] and error [% PV] of shape (number of loops,); most_ms, the highest allowed Ms of each loop [-].
    """

    loops: tuple[Loop, ...]
    loads: tuple[Floats, ...]
    travel: Floats
    error: Floats
    most_ms: tuple[float, ...]
    limits: TuningLimits


def standard_load(loop: Loop, steps: int) -> Floats:
    """A load if none is known, shape (steps,) [% PV]: steps at the valve of half the backlash."""
    h = scan_step(loop)
    hold = max(int(15.0 * slowest_s(loop) / h), 50)
    height = 0.5 * max(band(loop.valve), 0.5)
    d = discretize(loop.process, h)
    at_valve = height * np.array([0.0, 1.0, -0.62, 0.31])[(np.arange(steps) // hold) % 4]
    load: Floats = respond(at_valve, d)
    return load


def _as_simulated(loop: Loop) -> Loop:
    """The rounded loop with positive controller gain: mirrored about OP's middle, travel and error are the same."""
    p, c = loop.process, loop.controller
    gain, *times = astuple(p)
    upright = replace(c, kp=abs(c.kp), ti_s=abs(c.ti_s))
    return loop_in_digits(replace(loop, process=type(p)(c.sign * gain, *times), controller=upright))


def figures(loop: Loop, load: Floats) -> tuple[float, float]:
    """Stem travel [%/h] and average absolute error [% PV] under a rounded load, without the warm-up."""
    r = settled(run(_as_simulated(loop), load))
    travel = float(np.abs(np.diff(r.stem)).sum())
    return travel / r.duration_s * 3600.0, float(np.mean(np.abs(r.pv)))


LoadedLoop = tuple[Loop, Floats]
"""A loop with the load [% PV] that the record leaves to it."""


def bench(
    loop: Loop,
    others: Sequence[Loop],
    load: Floats,
    limits: TuningLimits,
    indistinguishable: Sequence[LoadedLoop] = (),
) -> Bench:
    """The present tuning on every loop, as a reference for candidates; indistinguishable, other loops that
    the record cannot distinguish from the first, each with its own load."""
    cut = in_digits(load[-limits.most_steps :])
    loops = tuple(replace(one, controller=loop.controller) for one in (loop, *others))
    loads = tuple(cut if k % 2 == 0 else np.ascontiguousarray(cut[::-1]) for k in range(len(loops)))
    loops += tuple(one for one, _ in indistinguishable)
    loads += tuple(in_digits(own[-limits.most_steps :]) for _, own in indistinguishable)
    results = np.array([figures(*case) for case in zip(loops, loads, strict=True)])
    return Bench(loops, loads, results[:, 0], results[:, 1], most_ms(loops, limits), limits)


def _ratios(table: Bench, controller: Pid, k: int) -> tuple[float, float]:
    """Travel and error of a candidate on one loop, over the present ones [-]."""
    travel, error = figures(replace(table.loops[k], controller=controller), table.loads[k])
    return travel / max(float(table.travel[k]), 1e-9), error / max(float(table.error[k]), 1e-9)


def _scored(table: Bench, controller: Pid, ms: float, ratios: Sequence[tuple[float, float]]) -> Candidate:
    """A candidate from its results on the loops."""
    travel, error = np.array(ratios).T
    limits = table.limits
    aim = limits.error_aim if is_backlash(table.loops[0].valve) else limits.error_aim_stick
    score = _score(travel, error, aim, limits)
    worst = float(travel.max()), float(error.max())
    return Candidate(controller, ms, float(travel.mean()), float(error.mean()), *worst, score)


def try_out(table: Bench, controller: Pid, ms: float | None = None, loops: int | None = None) -> Candidate:
    """Score a candidate, with its Ms on the first loop if known, on the first `loops` of the bench (None: all)."""
    if ms is None:
        ms = maximum_sensitivity(replace(table.loops[0], controller=controller))
    count = len(table.loops[:loops])
    return _scored(table, controller, ms, [_ratios(table, controller, k) for k in range(count)])


def _score(travel: Floats, error: Floats, aim: float, limits: TuningLimits) -> float:
    """Log of the mean travel plus that of the error, weighted more above its aim; lower is better."""
    mean_error = max(float(error.mean()), float(error[0]), 1e-9)
    above = max(math.log(mean_error / aim), 0.0)
    mean_travel = float(travel.mean()) + limits.travel_floor
    return math.log(mean_travel) + limits.error_weight * math.log(mean_error) + limits.error_beyond * above


def _harmless(table: Bench, controller: Pid, ms: float) -> Candidate | None:
    """A candidate that raises the error neither on the first loop nor in the mean, and is worse on none of the loops
    consistent with the data; it is dropped at the first loop on which it is."""
    limits, ratios = table.limits, list[tuple[float, float]]()
    most = limits.error_growth_backlash if is_backlash(table.loops[0].valve) else limits.error_growth_sample
    for k in range(len(table.loops)):
        travel, error = _ratios(table, controller, k)
        if k == 0 and not error <= limits.error_growth:
            return None
        if not (travel <= limits.travel_growth_sample and error <= most):
            return None
        ratios.append((travel, error))
    found = _scored(table, controller, ms, ratios)
    return found if found.error <= limits.error_growth else None


@dataclass(frozen=True, slots=True)
class Rejection:
    """Response of the linear loop to a unit step of load at the valve.

    peak [% PV / % OP]: largest deviation; integral [s % PV / % OP]: Ti/abs(Kp), the integral of the error.
    """

    peak: float
    integral: float


def rejection(process: Process, controller: Pid) -> Rejection:
    """Peak and integral of the error after a unit load step at the process input, without the valve."""
    loop = Loop(process, replace(controller, op_lo=-1e9, op_hi=1e9))
    h = scan_step(loop)
    ti = integral_s(controller) if controller.kp else slowest_s(loop)
    horizon = 20.0 * effective_delay(process, h) + (2.0 * ti if math.isfinite(ti) else 0.0)
    steps = int(min(max(horizon / h, 100), 20_000))
    d = discretize(process, h)
    load = respond(np.r_[0.0, np.ones(steps)], d)
    pv = closed_loop(loop, np.zeros(load.size), load, op_start=0.0).pv
    return Rejection(float(np.abs(pv).max()), rejects_s(controller))


def allowed(loop: Loop, limits: TuningLimits) -> Rejection:
    """The slowest load rejection of a proposal: stated factors of the nominal, or the present one's.

    The integral's reference is nominal gain with Ti of at least T, as backlash requires. Above `integral_factor_ramp`
    times SIMC's own integral a longer Ti hardly slows the cycle further, so there only the rule itself, Ti = T at the
    present gain, is allowed.
    """
    nominal = simc(loop.process, scan_s=scan_step(loop))
    best = rejection(loop.process, nominal)
    now = rejection(loop.process, loop.controller)
    lag = loop.process.time_constant_s if isinstance(loop.process, Fopdt) else 0.0
    longest = max(lag, nominal.ti_s)
    most = limits.integral_factor * longest / abs(nominal.kp)
    ramp = limits.integral_factor_ramp * nominal.ti_s / abs(nominal.kp)
    gain = min(abs(nominal.kp), abs(loop.controller.kp))
    rule = min(1.5 * longest / gain, most) if gain else 0.0  # no rule is for an integral alone
    integral = ramp if isinstance(loop.process, Integrator) else max(min(most, ramp), rule)
    present = now.integral if math.isfinite(now.integral) else 0.0
    return Rejection(
        max(limits.peak_factor * best.peak, limits.peak_growth * now.peak), max(integral, present)
    )


def rounded(x: float) -> float:
    """Round to three significant digits for entry in a controller."""
    return float(f"{x:.3g}")


def pairs(loop: Loop, gains: Floats, times: Floats) -> list[Pid]:
    """Settings of every gain [% OP / % PV] with every integral time [s], with the loop's present sign; an integral
    alone has its sign in the time."""
    now, sign = loop.controller, loop.controller.sign
    time = 1.0 if now.kp else sign
    return [
        replace(now, kp=rounded(sign * float(k)), ti_s=rounded(time * float(t)))
        for k, t in product(gains, times)
    ]


def robust(loops: Sequence[Loop], controller: Pid, most: Sequence[float]) -> float | None:
    """Ms on the first loop if each loop's is at most its limit in `most`, else None."""
    first = None
    for one, bound in zip(loops, most, strict=True):
        ms = maximum_sensitivity(replace(one, controller=controller))
        if not ms <= bound:
            return None
        first = ms if first is None else first
    return first


def most_ms(loops: Sequence[Loop], limits: TuningLimits) -> tuple[float, ...]:
    """The limits of Ms, or the present tuning's own if larger, the first loop's up to the samples' limit.

    A loop that has run for years at its present Ms is not made less robust by settings with the same; a valve model
    that confuses a jump with backlash gives twice the process gain, and then too high an Ms.
    """
    most = limits.ms_most_sample
    now = [maximum_sensitivity(one) for one in loops]
    own = max(limits.ms_most, min(now[0], most))
    return (own, *(max(most, ms if math.isfinite(ms) else most) for ms in now[1:]))


def _kept(table: Bench, most: Rejection, settings: list[Pid]) -> list[Candidate]:
    """The settings that keep robustness, load rejection and error, tested on every loop."""
    process, found = table.loops[0].process, list[Candidate | None]()
    for pid in settings:
        if most.integral < rejects_s(pid) < math.inf:
            continue
        ms = robust(table.loops, pid, table.most_ms)
        if ms is None or rejection(process, pid).peak > most.peak:
            continue
        found.append(_harmless(table, pid, ms))
    return [c for c in found if c is not None]


def _grid(loop: Loop, most: Rejection, limits: TuningLimits) -> tuple[Floats, Floats]:
    """Gains [% OP / % PV] and integral times [s] of the coarse grid. With backlash before a lag the best is often at
    the time constant (the source study's Eq. 6), but not always: the simulation decides. Integral action that is off
    remains off, and an integral alone remains alone."""
    nominal, now = simc(loop.process, scan_s=scan_step(loop)), loop.controller
    if now.kp == 0.0:
        return np.zeros(1), abs(now.ti_s) * np.geomspace(1.0 / ALONE, ALONE, TIMES)
    high = min(limits.gain_up * abs(now.kp), 2.0 * abs(nominal.kp))
    down = limits.gain_down_backlash if is_backlash(loop.valve) else limits.gain_down_stick
    low = min(limits.gain_down * abs(now.kp), down * abs(nominal.kp))
    gains = np.geomspace(low, high, GAINS)
    if math.isinf(integral_s(now)):
        return gains, np.array([math.inf])
    shortest = 0.5 * min(integral_s(now), nominal.ti_s)
    longest = max(most.integral * high, 2.0 * shortest)
    return gains, np.geomspace(shortest, longest, TIMES)


def search(table: Bench) -> tuple[Candidate, ...]:
    """Candidates from best to worst, tested on all loops of the bench; empty if none is within the limits.

    A logarithmic grid over Kp and Ti, then a finer one around its best.
    """
    loop = table.loops[0]
    most = allowed(loop, table.limits)
    gains, times = _grid(loop, most, table.limits)
    coarse = _kept(table, most, pairs(loop, gains, times))
    if not coarse:
        return ()
    best = min(coarse, key=lambda c: c.score).controller
    step = np.linspace(-1.0, 1.0, FINE)
    longer, near = times, gains
    if times.size > 1:
        longer = np.maximum(abs(best.ti_s) * (times[1] / times[0]) ** step, times[0])
    if gains.size > 1:
        near = np.clip(abs(best.kp) * (gains[1] / gains[0]) ** step, gains[0], gains[-1])
    fine = pairs(loop, np.unique(near), np.unique(longer))
    return tuple(sorted(coarse + _kept(table, most, fine), key=lambda c: c.score))
