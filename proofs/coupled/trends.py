"""Set points, loads and noises of a plant, one value a scan [%]."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from proofs.coupled.kernel import Plant, Trends

DAY = 86_400.0
"""Period of the ambient temperature [s]."""
AMBIENT = 0.2
"""Share of loops that it affects."""
STEPPED = 0.25
"""Share of set points that change from time to time."""
ERROR = (0.08, 0.6)
"""Spread of the errors of loops without a fault, from their loads [%]."""
NOISE = (0.02, 0.2)
"""Spread of measurement noise [%]."""
LOAD_MOST = 4.0
"""Largest spread of a load [% OP]."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between those two, uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def coloured(rng: np.random.Generator, n: int, scans: float) -> np.ndarray:
    """First-order noise of unit variance and that correlation time, shape (n,)."""
    pole = np.exp(-1 / max(scans, 1e-3))
    drive = np.sqrt(1 - pole**2) * rng.standard_normal(n)
    drive[0] = rng.standard_normal()
    return lfilter([1.0], [1.0, -pole], drive)


def _load(rng: np.random.Generator, n: int, scale: float) -> np.ndarray:
    """Load of about unit variance with two correlation times relative to the loop's [scans], some with a few
    steps."""
    slow = rng.uniform(0.2, 0.8)
    out = np.sqrt(1 - slow) * coloured(rng, n, scale * log_uniform(rng, 0.3, 2))
    out += np.sqrt(slow) * coloured(rng, n, scale * log_uniform(rng, 2, 20))
    if rng.random() < 0.3:
        out += np.cumsum((rng.random(n) < rng.uniform(1, 4) / n) * rng.normal(0, 2, n))
    return out


def _noise(rng: np.random.Generator, n: int) -> np.ndarray:
    """Measurement noise of unit variance, white or partly coloured."""
    white = rng.standard_normal(n)
    if rng.random() < 0.5:
        return white
    return np.sqrt(0.5) * (white + coloured(rng, n, rng.uniform(1, 4)))


def _setpoint(rng: np.random.Generator, n: int) -> np.ndarray:
    if rng.random() > STEPPED:
        return np.zeros(n)
    moved = np.cumsum((rng.random(n) < rng.uniform(1, 4) / n) * rng.normal(0, 1.0, n))
    return np.clip(moved, -6, 6)


def drawn(rng: np.random.Generator, plant: Plant, natural: np.ndarray, n: int) -> Trends:
    """Trends of n scans for a plant; natural: periods [s] and heights of the responses to loads, (loops, 2)."""
    ambient = np.sin(2 * np.pi * (np.arange(n) * plant.step / DAY + rng.random()))
    ambient += 0.3 * coloured(rng, n, 0.1 * DAY / plant.step)
    sp, load, noise = (np.empty((plant.size, n)) for _ in range(3))
    for i in range(plant.size):
        period, height = natural[i]
        size = min(log_uniform(rng, *ERROR) / max(height, 1e-3), LOAD_MOST)
        sp[i] = plant.sp0[i] + _setpoint(rng, n)
        load[i] = size * _load(rng, n, period / (2 * np.pi * plant.step))
        if rng.random() < AMBIENT:
            load[i] += rng.choice([-1, 1]) * rng.uniform(0.5, 2) * size * ambient
        noise[i] = log_uniform(rng, *NOISE) * _noise(rng, n)
    return Trends(*(np.ascontiguousarray(x.T) for x in (sp, load, noise)), {})


def beat(rng: np.random.Generator, n: int, scans: float) -> np.ndarray:
    """A periodic load of about unit amplitude: a sine, a square signal or a pump's on and off; its phase varies."""
    pace = 1 + rng.uniform(0.01, 0.06) * coloured(rng, n, rng.uniform(2, 8) * scans)
    phase = np.cumsum(np.maximum(pace, 0.2) / scans) + rng.random()
    kind, part = rng.integers(3), phase % 1
    if kind == 0:
        return np.sin(2 * np.pi * phase)
    if kind == 1:
        return np.where(part < 0.5, 1.0, -1.0)
    duty = rng.uniform(0.2, 0.45)
    return np.where(part < duty, 1.0 - duty, -duty) / np.sqrt(duty * (1 - duty))
