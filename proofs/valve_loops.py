"""Random loops with a faulty valve, a load and noise, for the tests of the advice; and the limit-cycle condition of
the source study for a loop with backlash."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.signal import lfilter

from identification.models import Backlash, Fopdt, Integrator, Loop, Pid, Process, Stiction
from identification.record import Floats
from tuning.describing import scaled_valve
from tuning.harmonic_balance import travel_map
from tuning.rules import simc

SLOPE, DELAY, BAND = 0.15, 0.25, 0.15
"""Relative half widths of the uncertainty of slope, dead time and backlash of a loop [-]."""
BISECTIONS = 24
"""Bisections of Ti/T in the search for the largest that cycles: far below the two digits of the study's table."""


@dataclass(frozen=True)
class Case:
    """A loop and the load that acts on it."""

    loop: Loop
    load: Floats


def load(rng: np.random.Generator, steps: int, swing: float, time_s: float, noise: float) -> Floats:
    """A wandering load of standard deviation `swing` and time constant `time_s`, with white noise [% PV]."""
    pole = np.exp(-1.0 / time_s)
    wander = lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.normal(size=steps))
    return swing * wander + noise * rng.normal(size=steps)


def backlash_case(seed: int, steps: int = 12_000) -> Case:
    """A lag with T/L of 15 to 200 at SIMC's integral time, which cycles with a backlash of 0.5 to 3 %."""
    rng = np.random.default_rng(seed)
    delay = rng.uniform(1, 5)
    lag = delay * 10 ** rng.uniform(1.2, 2.3)
    gain = rng.uniform(0.01, 0.2) * lag / delay
    kp = lag / (gain * 2.5 * (delay + 0.5)) * rng.uniform(0.7, 1.3)
    width = rng.uniform(0.5, 3)
    swing = 0.1 * width / kp
    sign = rng.choice([-1.0, 1.0])
    loop = Loop(Fopdt(sign * gain, lag, delay), Pid(sign * kp, 10 * delay), Backlash(width))
    return Case(loop, load(rng, steps, swing, 2 * lag, 0.02 * width / kp))


def stick_case(seed: int, steps: int = 12_000) -> Case:
    """A flow or temperature loop with stick-slip."""
    case = backlash_case(seed, steps)
    rng = np.random.default_rng(seed + 1000)
    band = case.loop.valve.width
    return replace(case, loop=replace(case.loop, valve=Stiction(band, band * rng.uniform(0.3, 1.0))))


def level_case(seed: int, steps: int = 12_000) -> Case:
    """The same on an integrating process."""
    case = backlash_case(seed, steps)
    process = Integrator(case.loop.process.slope, case.loop.process.dead_time_s)
    return replace(case, loop=replace(case.loop, process=process))


def corners(loop: Loop) -> tuple[Loop, ...]:
    """Eight corners of slope, dead time and backlash around a loop: the range of possible loops."""
    return tuple(
        replace(
            loop,
            process=_scaled(loop.process, 1.0 + up * SLOPE, 1.0 + late * DELAY),
            valve=scaled_valve(loop.valve, 1.0 + wide * BAND),
        )
        for up, late, wide in product((-1.0, 1.0), repeat=3)
    )


def _scaled(process: Process, slope: float, delay: float) -> Process:
    late = process.dead_time_s * delay
    if isinstance(process, Integrator):
        return Integrator(process.slope * slope, late)
    return Fopdt(process.gain * slope, process.time_constant_s, late)


def largest_cycling_ratio(process: Fopdt, gain_share: float = 1.0) -> float:
    """Largest Ti/T at which backlash still cycles by harmonic balance under a continuous controller (Figure 6).

    gain_share is Kp over that of the nominal tuning (SIMC with tau_c = 1.5 L). The result is 0 where the loop
    does not cycle between 0.02 and 5, and inf where it still cycles at 5.
    """
    loop = Loop(process, replace(simc(process), scan_s=0.0), Backlash(1.0))
    kp = np.array([loop.controller.kp * gain_share])

    def cycles(ratio: float) -> bool:
        return bool(travel_map(loop, kp, np.array([ratio * process.time_constant_s])).travel[0, 0] > 0.0)

    tried = np.geomspace(0.02, 5.0, 40)
    at = [r for r in tried if cycles(float(r))]
    if not at or at[-1] == tried[-1]:
        return math.inf if at else 0.0
    low, high = float(at[-1]), float(at[-1] * (tried[1] / tried[0]))
    for _ in range(BISECTIONS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if cycles(middle) else (low, middle)
    return low
