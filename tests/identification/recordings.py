"""Recordings with a known process and a known fault, made without the estimator's own model."""

from __future__ import annotations

import numpy as np

from identification.controller.check import StatedSettings
from identification.mismatch.recording import Recording
from identification.models import Backlash, Fopdt, Loop, Motion, Pid, Stiction, Valve
from identification.simulation.closed_loop import closed_loop

N = 5000


def setpoints(seed: int, n: int = N, wait: int = 150) -> np.ndarray:
    """SP that moves to a new value every `wait` samples [% PV], shape (n,)."""
    rng = np.random.default_rng(seed)
    return 50 + np.repeat(rng.uniform(-7, 7, n // wait + 1), wait)[:n]


def noise(seed: int, n: int = N, load: float = 0.3, white: float = 0.08) -> np.ndarray:
    """Coloured load and white noise at PV [% PV], shape (n,)."""
    rng = np.random.default_rng(seed + 100)
    slow = np.zeros(n)
    push = rng.normal(0, load * np.sqrt(2 / 60), n)
    for k in range(1, n):
        slow[k] = slow[k - 1] * (1 - 1 / 60) + push[k]
    return slow + rng.normal(0, white, n)


def recording(seed: int, valve: Valve = None, load: np.ndarray | None = None) -> Recording:
    """A closed loop with gain 1.2, time constant 20 s and dead time 3.4 s, recorded with a resolution of 0.01
    %."""
    law = Pid(1.8, 20.0)
    n = noise(seed)
    loop = Loop(Fopdt(1.2, 20.0, 3.4), law, valve)
    r = closed_loop(loop, setpoints(seed), n if load is None else n + load)
    pv, op = np.round(r.pv, 2), np.round(r.op, 2)
    return Recording(r.sp, pv, op, np.ones(N, dtype=bool), 1.0, r.time_s, StatedSettings(law.kp, law.ti_s))


BACKLASH, STICKING = Backlash(2.0), Stiction(2.0, 1.2, Motion.SLIDES)
