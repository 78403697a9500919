"""Properties of an identified loop: its process for settings, its load, other possible loops."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np
from scipy.special import binom

from analyzer.config import AdviceLimits
from analyzer.loop.identification.candidates import SEARCHED
from analyzer.loop.identification.fit_data import across, scans_of, whole_problem
from analyzer.loop.identification.intervals import lag_factor
from analyzer.loop.identification.measure import Measured
from identification.controller.check import op_step
from identification.estimation.between_samples import scans_per_row, with_scans, without_noise
from identification.estimation.gauss_newton import covariance, residual
from identification.estimation.model import Fitted
from identification.estimation.problem import Problem
from identification.models import Fopdt, Integrator, Loop, Pid, Process
from identification.record import Floats, LoopRecord, Mask
from identification.signals.robust import robust_deviation
from identification.simulation.pi import from_noise
from tuning.describing import describe, scaled_valve
from tuning.forecast import SEED
from tuning.frequency_response import integral_s
from tuning.rules import simc
from tuning.search import LoadedLoop

LOAD_SCANS = 20000  # Largest number of scans of reconstructed load for the simulation of settings [scans]

INTEGRATING = 10.0
"""Time constant over a cycle's period [-] from which a lag acts on it as an integrator: its phase is within a degree
of -90 degrees."""
WIDER = 1.4
"""Assumed ratio of a valve's true width to the width fitted to a record of one row in several scans [-];
ours. In two loops of benchmarks/world (seeds 97, 99, every 10 s), whose settings raised the error, it was
1.15 and 1.43."""
MOST_OF_SWING = 0.8
"""Largest width over OP's range in a cycle that is tried [-]; ours: the stem does not move at 1, and near it noise
decides whether it does."""
NIGHT_BLOCKS, NIGHT_SCANS = 30_000, 200_000
"""Blocks in which the load of a night is reconstructed, and its latest scans that are simulated, at most; ours: two
days at one scan a second, a day in blocks of 3 s."""
HIGHEST = 4
"""Highest order of the differences of OP from which the noise of PV is measured: ours."""
COARSE = 2.0
"""Digits of OP within which the median of its jumps is that of whole digits."""


def tuned(fit: Fitted, valve: bool, limits: AdviceLimits) -> Process:
    """The process for the search of settings: an integrator if the time constant is unknown."""
    process = fit.process
    if lag_factor(fit, valve, limits) is None:
        return Integrator(process.slope, process.dead_time_s)
    return process


def cautious(process: Fopdt, period_s: float | None) -> Fopdt:
    """A process with its time constant raised to two periods at the same slope.

    A cycle gives gain over time constant; a time constant much beyond the period cannot be separated from it, and an
    integral time based on too short a one makes a loop oscillate that should become calm.
    """
    t = max(process.time_constant_s, 2.0 * (period_s or 0.0))
    return Fopdt(process.slope * t, t, process.dead_time_s)


def gain_room(m: Measured) -> float | None:
    """SIMC's gain for the identified process over the present one [-]; None if no settings are known, or they act the
    wrong way, or the set point did not move: a load alone does not determine the delay of PV."""
    process, controller = m.linear.process, m.controller
    if not m.excited or controller is None or process.gain * controller.kp <= 0.0:
        return None
    return abs(simc(process, scan_s=controller.scan_s).kp / controller.kp)


def load_of(fit: Fitted, controller: Pid) -> Floats:
    """Residual load and noise of the model [% PV], on the scan's clock, the latest scans, shape (m,).

    Moves of the set point are subtracted: a PI at a constant set point responds to such a load as to the moves.

    Blocks do not contain the noise from scan to scan, rows contain it at their own interval only. OP still contains
    it, times the gain, and it dithers the stem; white noise of that size is added.
    """
    _, load = _on_scans(_load_left(fit), fit.p, controller)
    return _with_noise(load[-LOAD_SCANS:], fit.p, controller)


def load_of_night(
    fit: Fitted, controller: Pid, record: LoopRecord, period_s: float, moved: bool = True
) -> Floats:
    """As `load_of`, of the whole record [% PV] instead of the stretch that is fitted, shape (m,); its unusable parts
    are left out. moved, whether moves of the set point are in it."""
    problem = whole_problem(record, fit.p, NIGHT_BLOCKS, period_s)
    dead_s = max(fit.process.dead_time_s - problem.half_block_s, 0.0)
    whole = replace(fit, p=problem).moved(dead_time_s=dead_s)
    scans = None if fit.p.blocks.steps == 1 else scans_of(record, problem, controller)
    if scans is not None:
        whole = with_scans(whole, scans, SEARCHED)
    problem = whole.p if moved else whole.p.with_blocks(sp=None)
    clock, load = _on_scans(across(_load_left(whole), ~problem.usable), problem, controller)
    usable = problem.usable[np.minimum((clock / problem.dt_s).astype(int), problem.y.size - 1)]
    return _with_noise(joined(load, usable)[-NIGHT_SCANS:], problem, controller)


def _load_left(fit: Fitted) -> Floats:
    """PV less the response to the stem [% PV], shape (n,), less offset, drift and the decay of the model's start on
    the usable blocks: a working loop has compensated them. With a noise model that is nearly an integrator the fit
    does not determine its own offset, which can be far beyond what OP can compensate."""
    problem = fit.p
    t = np.linspace(-1.0, 1.0, problem.y.size)
    faded = np.exp(-0.5 * (1.0 + t) * problem.duration_s / fit.time_constant_s)
    return regressed(residual(fit), np.column_stack([np.ones(t.size), t, faded]), problem.usable)


def joined(load: Floats, usable: Mask) -> Floats:
    """The usable parts of a load, shape (m,), one after the other, each moved to where the one before ends."""
    at = np.flatnonzero(usable)
    kept, next_part = load[at], np.diff(at, prepend=at[:1]) > 1
    return np.asarray(kept - np.cumsum(np.where(next_part, np.diff(kept, prepend=kept[:1]), 0.0)))


def regressed(y: Floats, terms: Floats, usable: Mask) -> Floats:
    """y, shape (n,), less its least-squares fit of terms, shape (n, k), on the usable samples."""
    slope, *_ = np.linalg.lstsq(terms[usable], y[usable], rcond=None)
    return np.asarray(y - terms @ slope)


def _on_scans(residual_load: Floats, problem: Problem, controller: Pid) -> tuple[Floats, Floats]:
    """Clock of the controller's scans [s] and the smooth part of a load on it [% PV], the set point subtracted."""
    scan_s = controller.scan_s or problem.dt_s
    if problem.blocks.factor == 1 and _loses_noise(problem, controller):
        residual_load = without_noise(residual_load)
    if problem.blocks.sp is not None:
        residual_load = residual_load - (problem.blocks.sp - problem.blocks.sp.mean())
    clock: Floats = scan_s * np.arange(int(problem.duration_s / scan_s), dtype=np.float64)
    return clock, np.asarray(
        np.interp(clock, np.arange(residual_load.size) * problem.dt_s, residual_load), dtype=np.float64
    )


def _loses_noise(problem: Problem, controller: Pid) -> bool:
    """Whether blocks, or rows of several scans, hide the noise from scan to scan."""
    return problem.blocks.factor > 1 or scans_per_row(controller, problem.row_s) > 1


def _with_noise(load: Floats, problem: Problem, controller: Pid) -> Floats:
    """A load with the noise that its problem does not contain [% PV], shape (m,)."""
    if _loses_noise(problem, controller):
        load = load + scan_noise(problem, controller) * np.random.default_rng(SEED).normal(size=load.size)
    return np.asarray(load, dtype=np.float64)


def recorded_error(fit: Fitted, controller: Pid, last: int = 0) -> float:
    """Average absolute error of the data of a fit [% PV], of its last samples if a number is given; about PV's mean
    if the set point is constant. The noise missing in blocks is added as in `load_of`."""
    problem = fit.p
    sp = 0.0 if problem.blocks.sp is None else problem.blocks.sp - problem.inputs.level
    error, usable = (problem.centred - sp)[-last:], problem.usable[-last:]
    slow = float(np.mean(np.abs(error[usable]))) if usable.any() else math.nan
    fast = scan_noise(problem, controller) if problem.blocks.factor > 1 else 0.0
    return math.hypot(slow, math.sqrt(2.0 / math.pi) * fast)


def error_of_night(record: LoopRecord, controller: Pid) -> float:
    """Average absolute error of a record [% PV]; without integral action about its mean, for OP has a bias."""
    error = record.error[record.usable]
    if error.size == 0:
        return math.nan
    bias = error.mean() if math.isinf(integral_s(controller)) else 0.0
    return float(np.mean(np.abs(error - bias)))


def scan_noise(problem: Problem, controller: Pid) -> float:
    """Standard deviation of PV's noise from sample to sample [% PV], from OP's differences where OP is free: the
    smaller of second and fourth ones, because a fast cycle adds to both, to the fourth ones far less."""
    found = []
    for one in (problem, problem.of_rows):  # simulated between the rows, and recorded alone
        held = max(round(controller.scan_s / one.step_s), 1)  # OP is constant between two scans
        op, scan_s = one.blocks.op[::held], controller.scan_s or one.step_s
        shared = from_noise(controller, scan_s, HIGHEST + 1, max(round(one.step_s / scan_s), 1))
        free = (op > controller.op_lo) & (op < controller.op_hi)  # at a limit OP does not follow PV
        found += [_noise_of(op, free, order, shared) for order in (2, HIGHEST)]
    return min((x for x in found if x is not None), default=0.0)


def _noise_of(op: Floats, free: Mask, order: int, shared: Floats) -> float | None:
    """Standard deviation of white noise in PV [% PV] from OP's differences of an even order at free samples; None if
    OP, shape (n,), does not show it.

    Their variance follows from OP's autocovariance under such noise of variance 1, `shared`, shape (order + 1 or
    more,); that of OP's rounding is subtracted. The median ignores steps (Rousseeuw, Croux 1993). If it is within a
    few digits of OP it is a digit's: the mean square of jumps of that size is used then (Sheppard 1898), and higher
    orders have only the digit.
    """
    whole = np.convolve(free, np.ones(order + 1), "valid") == order + 1
    jumps, digit = np.abs(np.diff(op, order))[whole], op_step(op)
    if jumps.size == 0 or not shared[0] > 0.0:
        return None
    weights = binom(order, np.arange(order + 1)) * (-1.0) ** np.arange(order + 1)
    spread, rounding = robust_deviation(jumps), float(weights @ weights) / 12.0 * digit**2
    if spread < COARSE * digit:
        if order > 2:
            return None
        spread = math.sqrt(float(np.mean(jumps[jumps <= 2.0 * COARSE * digit] ** 2)))
    lags = np.abs(np.subtract.outer(np.arange(order + 1), np.arange(order + 1)))
    share = float(weights @ shared[lags] @ weights)
    return math.sqrt(max(spread**2 - rounding, 0.0) / share)


def uncertain(fit: Fitted, loop: Loop, samples: int = 6) -> tuple[Loop, ...]:
    """Loops drawn from the fit's covariance, of the same controller and the same kind of process."""
    lag, gain = math.log(fit.time_constant_s), math.log(abs(fit.gain))
    mean = np.array([lag, fit.process.dead_time_s, fit.valve.stickband, gain])
    relative = np.array([1.0, 1.0, 1.0, 1.0 / fit.gain])
    spread = covariance(fit, free_width=loop.valve is not None) * np.outer(relative, relative)
    scale = np.sqrt(np.maximum(np.diag(spread), 1e-24))
    unit = spread / np.outer(scale, scale) + 1e-9 * np.eye(mean.size)
    # not by singular vectors, whose signs depend on rounding
    root = scale[:, None] * np.linalg.cholesky(unit)
    draws = mean + np.random.default_rng(SEED).normal(size=(samples, mean.size)) @ root.T
    return tuple(_drawn(draw, fit, loop) for draw in draws)


def indistinguishable(
    fit: Fitted, loop: Loop, period_s: float, record: LoopRecord | None = None
) -> tuple[LoadedLoop, ...]:
    """Loops that the cycle of a period [s] cannot distinguish from the fitted one, each with its residual load [% PV]
    of the stretch, as `load_of`, or of a whole record.

    A limit cycle determines the product of the process and the valve's describing function at its own frequency alone
    (Astrom, Hagglund 1984). OP between two rows of a record, or within a digit, is unknown and biases the rest: the
    fitted time constant and width are too small, and with them the error under a slow load. These loops have the same
    product, an integrating process, and the valve as fitted or WIDER. A narrow stick-slip before a long dead time may
    also be the widest one that OP's cycle allows before a short one. A dead time that would be negative is 0; the
    product then differs in phase.
    """
    omega, lag_s = 2.0 * math.pi / period_s, fit.time_constant_s
    slow_s, swing = INTEGRATING * max(lag_s, period_s), 0.5 * fit.p.cycle_range
    found = []
    widest = MOST_OF_SWING * fit.p.cycle_range / max(fit.valve.stickband, 1e-9)
    widths = (1.0, min(WIDER, widest), widest if fit.valve.slip_jump > 0.0 else 1.0)
    for wider in dict.fromkeys(widths):
        valve = scaled_valve(loop.valve, wider)
        response, wide = describe(loop.valve, swing), describe(valve, swing)
        if wider < 1.0 or 0.0 in (response, wide):
            continue
        more = response / wide
        later_s = (math.atan(omega * slow_s) - math.atan(omega * lag_s) + cmath.phase(more)) / omega
        gain = fit.gain * abs(more) * math.hypot(1.0, omega * slow_s) / math.hypot(1.0, omega * lag_s)
        law = fit.valve._replace(breakaway=wider * fit.valve.breakaway, sliding=wider * fit.valve.sliding)
        dead_s = max(fit.dead_time_s - later_s, 0.0)
        other = fit.moved(gain=gain, time_constant_s=slow_s, dead_time_s=dead_s, valve=law)
        process = Fopdt(gain, slow_s, max(loop.process.dead_time_s - later_s, 0.0))
        pid = loop.controller
        load = load_of(other, pid) if record is None else load_of_night(other, pid, record, period_s)
        found.append((replace(loop, process=process, valve=valve), load))
    return tuple(found)


def _drawn(draw: Floats, fit: Fitted, loop: Loop) -> Loop:
    """The loop at one draw of log time constant, dead time, stickband and log gain.

    The lag stays within a factor of ten, slope and dead time within three. The draw of gain over time constant is
    precise even if both by themselves are not: their errors are correlated.
    """
    log_t = min(max(draw[0], math.log(fit.time_constant_s) - 2.3), math.log(fit.time_constant_s) + 2.3)
    off = draw[3] - draw[0] - math.log(abs(fit.slope))
    slope = fit.slope * math.exp(min(max(off, -math.log(3.0)), math.log(3.0)))
    longest = 3.0 * max(loop.process.dead_time_s, loop.controller.scan_s)
    between = loop.process.dead_time_s - fit.process.dead_time_s  # for a controller that acts between samples
    dead, t = min(max(float(draw[1]) + between, 0.0), longest), math.exp(log_t)
    is_ramp = isinstance(loop.process, Integrator)
    process: Process = Integrator(slope, dead) if is_ramp else Fopdt(slope * t, t, dead)
    factor = max(float(draw[2]), 0.2 * fit.valve.stickband) / max(fit.valve.stickband, 1e-9)
    return Loop(process, loop.controller, scaled_valve(loop.valve, factor))
