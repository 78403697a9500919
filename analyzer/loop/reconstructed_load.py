"""The load of a night, as an identified model leaves it, on which settings are tried."""

from __future__ import annotations

import math

import numpy as np

from identification.estimation.hammerstein import Fit, disturbance
from identification.estimation.window import Window
from identification.models import Pid
from identification.record import Floats
from identification.signals.robust import robust_deviation

MOST_SCANS = 20_000
"""Scans of reconstructed load that settings are tried on at most."""


def load_of(window: Window, fit: Fit, controller: Pid, seed: int = 0) -> Floats:
    """Load and noise [% PV] that the model leaves, on the scan's clock, the latest `MOST_SCANS`, shape (m,).

    The window's blocks have lost the noise from scan to scan. OP still has it, times the gain, and it dithers the
    stem; white noise of that size is added.
    """
    scan_s = controller.scan_s or window.dt_s
    left = disturbance(window, fit)
    clock = np.arange(int(window.duration_s / scan_s)) * scan_s
    load = np.interp(clock, np.arange(left.size) * window.dt_s, left)[-MOST_SCANS:]
    if window.factor > 1:
        load += scan_noise(window, controller) * np.random.default_rng(seed).normal(size=load.size)
    return np.asarray(load, dtype=np.float64)


def scan_noise(window: Window, controller: Pid) -> float:
    """Standard deviation of PV's noise from sample to sample [% PV], read from OP's second differences.

    Those of white noise have sqrt(6) times its deviation; the median leaves steps aside (Rousseeuw, Croux 1993).
    """
    jumps = np.abs(np.diff(window.op, 2))
    if jumps.size == 0 or controller.kp == 0:
        return 0.0
    return robust_deviation(jumps) / math.sqrt(6.0) / abs(controller.kp)
