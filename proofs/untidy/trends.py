"""Set points, loads and noises of a busy plant, one value a scan [%]."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter


def _smooth(rng: np.random.Generator, n: int, scans: float) -> np.ndarray:
    """First-order noise of unit variance and that correlation time."""
    pole = np.exp(-1 / max(scans, 1e-3))
    begun = lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal(n + min(int(5 * scans), n)))
    return begun[-n:]


def noise(rng: np.random.Generator, n: int, size: float) -> np.ndarray:
    """Measurement noise of one of four colours: white, first order, flicker, white with bursts."""
    kind = rng.integers(4)
    white = rng.standard_normal(n)
    if kind == 1:
        return size * _smooth(rng, n, rng.uniform(1, 6))
    if kind == 2:
        return size * sum(_smooth(rng, n, 4.0**k) for k in range(5)) / np.sqrt(5)
    if kind == 3:
        return size * white * (1 + 2 * (_smooth(rng, n, 200) > 1.5))
    return size * white


def load(rng: np.random.Generator, n: int, size: float, scale: float) -> np.ndarray:
    """Load at the process input: wander at several rates, steps, ramps, busy hours; `scale` [scans] of the loop."""
    out = size * 0.6 * _smooth(rng, n, scale * 10 ** rng.uniform(-0.3, 1.5))
    out += size * rng.uniform(0, 1.5) * _smooth(rng, n, scale * 10 ** rng.uniform(1, 2.2))
    if rng.random() < 0.5:
        hits = rng.random(n) < rng.uniform(0.5, 8) / n
        out += np.cumsum(hits * rng.normal(0, 3 * size, n))
    if rng.random() < 0.3:
        knots = np.sort(rng.integers(0, n, 4))
        out += np.interp(np.arange(n), knots, np.cumsum(rng.normal(0, 3 * size, 4)))
    if rng.random() < 0.3:
        out *= 1 + 2 * (_smooth(rng, n, n / 10) > 0.8)
    return out


def setpoint(rng: np.random.Generator, n: int, size: float, scale: float) -> tuple[np.ndarray, str]:
    """A set point about zero that is constant, steps, ramps or is moved by a master, and which of these."""
    kind = str(rng.choice(["stands", "stands", "steps", "ramps", "master"]))
    if kind == "steps":
        return np.cumsum((rng.random(n) < rng.uniform(1, 10) / n) * rng.normal(0, 4 * size, n)), kind
    if kind == "ramps":
        knots = np.sort(rng.integers(0, n, 6))
        return np.interp(np.arange(n), knots, np.cumsum(rng.normal(0, 3 * size, 6))), kind
    if kind == "master":
        every = int(rng.choice([1, 2, 5]))
        moved = size * _smooth(rng, n, scale * rng.uniform(2, 15))
        return np.repeat(moved[::every], every)[:n], kind
    return np.zeros(n), kind


def periodic(rng: np.random.Generator, n: int, period: float) -> np.ndarray:
    """A periodic load of unit amplitude: sine, square, triangle or pulses; its period may vary."""
    drift = rng.choice([0.0, 0.03, 0.1]) * _smooth(rng, n, 4 * period)
    phase = np.cumsum((1 + drift) / period) + rng.random()
    kind, part = rng.integers(4), phase % 1
    if kind == 0:
        return np.sin(2 * np.pi * phase)
    if kind == 1:
        return np.where(part < 0.5, 1.0, -1.0)
    if kind == 2:
        return 4 * np.abs(part - 0.5) - 1
    return np.where(part < rng.uniform(0.2, 0.4), 1.5, -0.5)
