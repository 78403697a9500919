"""What settings are tried on: the loops that the data allow, each with a load, and the present figures beside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from identification.models import Backlash, Fopdt, Integrator, Loop, Pid, Process, Valve
from identification.record import Floats
from identification.simulation.closed_loop import scan_step
from identification.simulation.lag import discretize, respond
from tuning.describing import band, is_play
from tuning.limits import TuningLimits
from tuning.linear import slowest_s
from tuning.predict import run, settled

DIGITS = 6
"""Digits of a model's constants, and decimals of a load [% PV], that are simulated: a cycle behind a play or a
stem that sticks carries a rounding error on, and between settings as good as each other a thirteenth digit would
choose."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A pair of settings and what the model says of it.

    ms [-]; travel and error: stem travel and average absolute error over those of the present tuning [-],
    means over the loops simulated; worst_travel and worst_error the largest of these; score: lower is better.
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
    """What candidates are tried on: loops with the present controller, loads, and the present figures.

    Every other loop gets the load backwards: a second record of the same kind, for a sticking stem's fate
    hangs on the load's very course.

    travel [%/h] and error [% PV] of shape (number of loops,).
    """

    loops: tuple[Loop, ...]
    loads: tuple[Floats, ...]
    travel: Floats
    error: Floats
    limits: TuningLimits


def standard_load(loop: Loop, steps: int) -> Floats:
    """A load for when none is known, shape (steps,) [% PV]: steps at the valve, half the play high."""
    h = scan_step(loop)
    hold = max(int(15.0 * slowest_s(loop) / h), 50)
    height = 0.5 * max(band(loop.valve), 0.5)
    d = discretize(loop.process, h)
    at_valve = height * np.array([0.0, 1.0, -0.62, 0.31])[(np.arange(steps) // hold) % 4]
    load: Floats = respond(at_valve, d)
    return load


def assumed_uncertainty(loop: Loop, limits: TuningLimits) -> tuple[Loop, ...]:
    """Eight corners of slope, dead time and play around the loop, for want of samples from identification."""
    corners = product((-1.0, 1.0), repeat=3)
    return tuple(
        replace(
            loop,
            process=_scaled(loop.process, 1.0 + up * limits.spread_slope, 1.0 + late * limits.spread_delay),
            valve=scaled_valve(loop.valve, 1.0 + wide * limits.spread_band),
        )
        for up, late, wide in corners
    )


def _scaled(process: Process, slope: float, delay: float) -> Process:
    late = process.dead_time_s * delay
    if isinstance(process, Integrator):
        return Integrator(process.slope * slope, late)
    return Fopdt(process.gain * slope, process.time_constant_s, late)


def scaled_valve(valve: Valve, factor: float) -> Valve:
    """The valve with play, or stickband and slip jump, times a factor [-]."""
    if valve is None:
        return None
    if isinstance(valve, Backlash):
        return Backlash(valve.width * factor)
    return replace(valve, stickband=valve.stickband * factor, slip_jump=valve.slip_jump * factor)


def _upright(loop: Loop) -> Loop:
    """The loop with its controller's gain above 0: mirrored about OP's middle, it travels and errs alike."""
    if loop.controller.kp >= 0.0:
        return loop
    controller = replace(loop.controller, kp=-loop.controller.kp)
    return replace(loop, process=_scaled(loop.process, -1.0, 1.0), controller=controller)


def _to_digits(x: float) -> float:
    return float(f"{x:.{DIGITS}g}")


def _resolved(loop: Loop) -> Loop:
    """The loop with its constants to so many digits as they are ever known."""
    p, valve = loop.process, loop.valve
    first = _to_digits(p.slope) if isinstance(p, Integrator) else _to_digits(p.gain)
    process: Process = Integrator(first, _to_digits(p.dead_time_s))
    if isinstance(p, Fopdt):
        process = Fopdt(first, _to_digits(p.time_constant_s), _to_digits(p.dead_time_s))
    width = band(valve)
    return replace(
        loop, process=process, valve=scaled_valve(valve, _to_digits(width) / width) if width > 0.0 else valve
    )


def _figures(loop: Loop, load: Floats) -> tuple[float, float]:
    """Stem travel [%/h] and average absolute error [% PV] on the load."""
    r = settled(run(_upright(_resolved(loop)), np.round(load, DIGITS)))
    stem = r.op if r.position is None else r.position
    return float(np.abs(np.diff(stem)).sum()) / r.duration_s * 3600.0, float(np.mean(np.abs(r.pv)))


def mean_error(loops: Sequence[Loop], controller: Pid, load: Floats) -> float:
    """Average absolute error [% PV] on a load, shape (n,), mean over the loops with one controller."""
    return float(np.mean([_figures(replace(one, controller=controller), load)[1] for one in loops]))


def bench(loop: Loop, others: Sequence[Loop], load: Floats, limits: TuningLimits) -> Bench:
    """The present tuning on every loop, so that candidates can be compared with it."""
    cut = np.ascontiguousarray(load[-limits.most_steps :])
    loops = tuple(replace(one, controller=loop.controller) for one in (loop, *others))
    loads = tuple(cut if k % 2 == 0 else np.ascontiguousarray(cut[::-1]) for k in range(len(loops)))
    figures = np.array([_figures(*case) for case in zip(loops, loads, strict=True)])
    return Bench(loops, loads, figures[:, 0], figures[:, 1], limits)


def try_out(table: Bench, controller: Pid, ms: float, loops: int | None = None) -> Candidate:
    """Score a candidate on the first `loops` loops of the bench (None: all)."""
    some = table.loops[:loops]
    cases = zip(some, table.loads, strict=False)
    figures = np.array([_figures(replace(one, controller=controller), load) for one, load in cases])
    travel = figures[:, 0] / np.maximum(table.travel[: len(some)], 1e-9)
    error = figures[:, 1] / np.maximum(table.error[: len(some)], 1e-9)
    limits = table.limits
    aim = limits.error_aim if is_play(table.loops[0].valve) else limits.error_aim_stick
    score = _score(travel, error, aim, limits)
    worst = float(travel.max()), float(error.max())
    return Candidate(controller, ms, float(travel.mean()), float(error.mean()), *worst, score)


def _score(travel: Floats, error: Floats, aim: float, limits: TuningLimits) -> float:
    """Log of the mean travel, and of the error, which weighs more once above its aim; lower is better."""
    mean_error = max(float(error.mean()), float(error[0]), 1e-9)
    above = max(math.log(mean_error / aim), 0.0)
    mean_travel = float(travel.mean()) + limits.travel_floor
    return math.log(mean_travel) + limits.error_weight * math.log(mean_error) + limits.error_beyond * above


def is_harmless(c: Candidate, table: Bench) -> bool:
    """Whether a candidate is worse on none of the loops that the data allow."""
    limits = table.limits
    most = limits.error_growth_play if is_play(table.loops[0].valve) else limits.error_growth_sample
    return (
        c.worst_error <= most
        and c.worst_travel <= limits.travel_growth_sample
        and c.error <= limits.error_growth
    )
