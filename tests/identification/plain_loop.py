"""A loop simulated in plain Python, without code of the simulator, the valve or the estimator.

Euler steps of a fifth of a scan, a list for the dead time, a state machine for the stem. Slow and simple.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.controller.check import StatedSettings
from identification.mismatch.recording import Recording
from identification.record import Floats

SUBSTEPS = 5


@dataclass(frozen=True)
class Plant:
    """A loop: process, PI controller, and its possible faults.

    gain [% PV/% OP], lag_s, dead_s, second_lag_s [s]; kp [% OP/% PV], ti_s [s]; backlash [% OP], full width;
    stick, jump [% OP]: stickband and slip jump of a stem that rests after each slip; grid [% PV], step of the
    sensor.
    """

    gain: float = 1.4
    lag_s: float = 18.0
    dead_s: float = 3.4
    second_lag_s: float = 0.0
    kp: float = 1.6
    ti_s: float = 20.0
    backlash: float = 0.0
    stick: float = 0.0
    jump: float = 0.0
    grid: float = 0.0


class Stem:
    """The position of the stem, updated with each OP."""

    def __init__(self, plant: Plant, op: float) -> None:
        self.plant, self.at = plant, op

    def moved(self, op: float) -> float:
        """The stem position after OP has moved to a new value."""
        p = self.plant
        if p.backlash > 0:
            self.at = min(max(self.at, op - p.backlash / 2), op + p.backlash / 2)
        elif p.stick > 0:
            gap = op - self.at
            if abs(gap) > (p.stick + p.jump) / 2:
                self.at = op - (p.stick - p.jump) / 2 * (1 if gap > 0 else -1)
        else:
            self.at = op
        return self.at


def ran(plant: Plant, sp: Floats, load: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """PV and OP, each shape (n,), of a loop at rest at 50 % under set point, load (at the inlet) and noise."""
    h = 1.0 / SUBSTEPS
    pipe = [50.0] * (round(plant.dead_s / h) + 1)
    stem, x, z, total, op = Stem(plant, 50.0), 0.0, 0.0, 50.0, 50.0
    pv_out, op_out = [], []
    for k in range(sp.size):
        pv = 50.0 + x + noise[k]
        if plant.grid > 0:
            pv = round(pv / plant.grid) * plant.grid
        e = sp[k] - pv
        total += plant.kp * e / plant.ti_s
        op = min(max(total + plant.kp * e, 0.0), 100.0)
        pv_out.append(pv)
        op_out.append(op)
        at = stem.moved(op)
        for _ in range(SUBSTEPS):
            pipe.append(at)
            feed = plant.gain * (pipe.pop(0) - 50.0 + load[k])
            if plant.second_lag_s > 0:
                z += h * (feed - z) / plant.second_lag_s
                feed = z
            x += h * (feed - x) / plant.lag_s
    return np.array(pv_out), np.array(op_out)


def recording(
    plant: Plant, seed: int, n: int = 2400, load: Floats | None = None, kp_factor: float = 1.0
) -> Recording:
    """A recording under set-point moves, a slowly varying load and noise. The stated Kp is `kp_factor` times
    the true one."""
    rng = np.random.default_rng(seed)
    sp = 50.0 + np.cumsum(np.where(np.arange(n) % 150 == 0, rng.choice((-4.0, 4.0), n), 0.0))
    sp = 50.0 + np.clip(sp - 50.0, -12.0, 12.0)
    wander = np.zeros(n)
    for k in range(1, n):
        wander[k] = 0.995 * wander[k - 1] + rng.normal(0, 0.03)
    pv, op = ran(plant, sp, wander + (0.0 if load is None else load), rng.normal(0, 0.04, n))
    stated = StatedSettings(plant.kp * kp_factor, plant.ti_s)
    return Recording(
        sp, np.round(pv, 3), np.round(op, 3), np.ones(n, dtype=bool), 1.0, np.arange(n) * 1.0, stated
    )
