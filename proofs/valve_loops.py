"""Random loops with a faulty valve, a load and noise, for the tests of the advice."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from identification.models import Backlash, Fopdt, Integrator, Loop, Pid, Stiction
from identification.record import Floats


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
    """A lag with T/L of 15 to 200 at SIMC's integral time, which play of 0.5 to 3 % makes cycle."""
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
