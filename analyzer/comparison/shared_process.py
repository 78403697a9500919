"""Process identification of one loop from the spectra of its error in two weeks with different settings.

Without a cycle, one pair of settings hardly separates process and load. Two pairs do: the sensitivity changes with
the settings, and the load is smooth, a lag of white noise before the process and white noise at PV.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from analyzer.comparison.block_bootstrap import Floats
from identification.models import Fopdt, Loop, Pid
from tuning.frequency_response import controller_response, maximum_sensitivity, process_response

ROUGHNESS_DB = 1.0
"""Difference of a real load from a smooth one per frequency [dB]; ours: the scatter of seven nights is half."""
STARTS = tuple(product((0.15, 0.5), (0.7, 3.0)))
"""Start values of dead time and time constant, over the integral time; ours."""


@dataclass(frozen=True, slots=True)
class Spectra:
    """Mean levels of the error [dB], shape (f,), at frequencies [Hz] of one side, with its settings."""

    frequency: Floats
    level: Floats
    controller: Pid


@dataclass(frozen=True, slots=True)
class SharedProcess:
    """Logs of slope, time constant and dead time, shape (3,), their covariance, shape (3, 3), the slope's sign, and
    the deviation of the spectra from a smooth load [dB]."""

    mean: Floats
    covariance: Floats
    sign: float
    misfit_db: float


def _predicted(theta: Floats, sides: Sequence[Spectra], sign: float) -> Iterator[Floats]:
    """Levels of the error [dB] of each side, shape (f,)."""
    slope, lag, dead = np.exp(theta[:3])
    process = Fopdt(sign * slope * lag, lag, dead)
    for k, side in enumerate(sides):
        size, corner, noise = theta[3 + 3 * k : 6 + 3 * k]
        omega = 2.0 * math.pi * side.frequency
        g = process_response(process, side.controller.scan_s, omega)
        before = np.abs(g) ** 2 * math.exp(size) / (1.0 + (omega * math.exp(corner)) ** 2)
        returned = np.abs(1.0 + g * controller_response(side.controller, omega)) ** 2
        yield 10.0 * np.log10((before + math.exp(noise)) / returned)


def shared_process(sides: Sequence[Spectra]) -> SharedProcess | None:
    """The process whose loops with both settings reproduce the recorded spectra under smooth loads; None if no stable
    one does."""
    c = sides[0].controller
    if not math.isfinite(c.ti_s) or c.ti_s <= 0.0 or c.kp == 0.0:
        return None
    sign = math.copysign(1.0, c.kp)

    def residuals(theta: Floats) -> Floats:
        predicted = _predicted(theta, sides, sign)
        return np.concatenate([(x - s.level) / ROUGHNESS_DB for x, s in zip(predicted, sides, strict=True)])

    best = None
    for dead, lag in STARTS:
        dead_s = max(dead * c.ti_s, c.scan_s)
        first = [math.log(1.0 / (2.5 * abs(c.kp) * dead_s)), math.log(lag * c.ti_s), math.log(dead_s)]
        low = [first[0] - 5.0, math.log(c.scan_s), math.log(0.1 * c.scan_s)]
        high = [first[0] + 5.0, math.log(1000.0 * c.ti_s), math.log(20.0 * c.ti_s)]
        for side in sides:
            noise = 0.23 * float(side.level[-3:].mean())
            first += [noise + 5.0, math.log(c.ti_s), noise]
            low += [noise - 15.0, math.log(c.scan_s), noise - 10.0]
            high += [noise + 40.0, math.log(1e6), noise + 5.0]
        found = least_squares(
            residuals, np.clip(first, low, high), bounds=(low, high), loss="soft_l1", max_nfev=60
        )
        slope, lag_s, dead_s = np.exp(found.x[:3])
        process = Fopdt(sign * slope * lag_s, lag_s, dead_s)
        stable = all(math.isfinite(maximum_sensitivity(Loop(process, s.controller))) for s in sides)
        if stable and (best is None or found.cost < best.cost):
            best = found
    if best is None:
        return None
    misfit = math.sqrt(2.0 * best.cost / max(best.fun.size - best.x.size, 1))
    information = best.jac.T @ best.jac + 1e-6 * np.eye(best.x.size)
    covariance = np.linalg.inv(information)[:3, :3] * max(misfit, 0.5) ** 2
    return SharedProcess(best.x[:3], covariance, sign, misfit * ROUGHNESS_DB)
