"""Loops that the data allow beside the one identified: drawn from the covariance of its fit."""

from __future__ import annotations

import math

import numpy as np

from identification.estimation.gauss_newton import covariance
from identification.estimation.hammerstein import Fit
from identification.estimation.window import Window
from identification.models import Fopdt, Integrator, Loop, Process
from identification.record import Floats
from tuning.search import scaled_valve


def uncertain(window: Window, fit: Fit, loop: Loop, samples: int = 6, seed: int = 0) -> tuple[Loop, ...]:
    """Loops drawn from the fit's covariance, of the same controller and the same kind of process."""
    dead_time_s = fit.dead_time_s + window.half_block_s
    lag, gain = math.log(fit.time_constant_s), math.log(abs(fit.gain))
    mean = np.array([lag, dead_time_s, fit.valve.stickband, gain])
    relative = np.array([1.0, 1.0, 1.0, 1.0 / fit.gain])
    spread = covariance(window, fit, free_width=loop.valve is not None) * np.outer(relative, relative)
    scale = np.sqrt(np.maximum(np.diag(spread), 1e-24))
    unit = spread / np.outer(scale, scale) + 1e-9 * np.eye(mean.size)
    # not by singular vectors, whose signs are a matter of rounding
    root = scale[:, None] * np.linalg.cholesky(unit)
    draws = mean + np.random.default_rng(seed).normal(size=(samples, mean.size)) @ root.T
    return tuple(_drawn(draw, fit, loop) for draw in draws)


def _drawn(draw: Floats, fit: Fit, loop: Loop) -> Loop:
    """The loop at one draw of log time constant, dead time, stickband and log gain.

    The lag stays within a factor of ten, slope and dead time within three. Gain over time constant is drawn well
    where the two by themselves are not: their errors go together.
    """
    log_t = min(max(draw[0], math.log(fit.time_constant_s) - 2.3), math.log(fit.time_constant_s) + 2.3)
    off = draw[3] - draw[0] - math.log(abs(fit.slope))
    slope = fit.slope * math.exp(min(max(off, -math.log(3.0)), math.log(3.0)))
    longest = 3.0 * max(loop.process.dead_time_s, loop.controller.scan_s)
    dead, t = min(max(float(draw[1]), 0.0), longest), math.exp(log_t)
    is_ramp = isinstance(loop.process, Integrator)
    process: Process = Integrator(slope, dead) if is_ramp else Fopdt(slope * t, t, dead)
    factor = max(float(draw[2]), 0.2 * fit.valve.stickband) / max(fit.valve.stickband, 1e-9)
    return Loop(process, loop.controller, scaled_valve(loop.valve, factor))
