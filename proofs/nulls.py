"""Records in which nothing oscillates and no valve is at fault, in six families.

PV is the noise itself. OP is the output of a PI controller for this error, so OP moves as in a plant but does not act
on PV. Shares no code with detection.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

LENGTHS = (300, 700, 1500, 4000)

Noise = Callable[[np.random.Generator, int], np.ndarray]


def white(rng: np.random.Generator, n: int) -> np.ndarray:
    """White noise."""
    return rng.normal(size=n)


def coloured(rng: np.random.Generator, n: int) -> np.ndarray:
    """First- and second-order noise with real poles."""
    poles = [rng.choice([0.5, 0.8, 0.95, 0.99]), rng.choice([0.0, rng.uniform(0.3, 0.97)])]
    return lfilter([1.0], np.poly(poles), rng.normal(size=n))


def drift(rng: np.random.Generator, n: int) -> np.ndarray:
    """A random walk under measurement noise."""
    return np.cumsum(rng.normal(size=n)) + rng.uniform(0, 10) * rng.normal(size=n)


def ramp(rng: np.random.Generator, n: int) -> np.ndarray:
    """Ramps and a step under noise."""
    step = rng.uniform(-30, 30) * (np.arange(n) > rng.integers(n))
    return np.linspace(0, rng.uniform(-50, 50), n) + step + rng.normal(size=n)


def quantized(rng: np.random.Generator, n: int) -> np.ndarray:
    """White noise on a coarse grid."""
    return np.round(rng.normal(size=n) * rng.uniform(0.3, 3))


def compressed(rng: np.random.Generator, n: int) -> np.ndarray:
    """Coloured noise of which a recorder keeps only the break points."""
    x = lfilter([1.0], [1.0, -0.7], rng.normal(size=n))
    return swinging_door(x, rng.uniform(0.5, 2.0))


def swinging_door(x: np.ndarray, deviation: float) -> np.ndarray:
    """Straight segments within a deviation of the samples, each as long as possible."""
    kept, at = [0], 0
    while at < x.size - 1:
        end = at + 1
        while end + 1 < x.size and end - at < 200:
            line = np.interp(np.arange(at, end + 2), [at, end + 1], [x[at], x[end + 1]])
            if np.abs(line - x[at : end + 2]).max() > deviation:
                break
            end += 1
        kept.append(end)
        at = end
    return np.interp(np.arange(x.size), kept, x[kept])


FAMILIES: dict[str, Noise] = {
    "white noise": white,
    "coloured noise": coloured,
    "drift": drift,
    "ramps": ramp,
    "quantized noise": quantized,
    "compressed noise": compressed,
}


def controller_output(error: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """OP of a PI controller for this error, in the middle of its range [%]."""
    kp, ti = rng.uniform(0.2, 2.0), rng.uniform(10, 100)
    op = kp * (error + np.cumsum(error) / ti)
    spread = max(float(np.std(op)), 1e-9)
    return 50 + (op - op.mean()) * min(1.0, 10 / spread)


def record(family: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """PV and OP [%] of one null record, each of shape (n,), one sample a second."""
    rng = np.random.default_rng([seed, list(FAMILIES).index(family)])
    n = int(rng.choice(LENGTHS))
    noise = FAMILIES[family](rng, n)
    noise = noise / max(float(np.std(noise)), 1e-9) * rng.uniform(0.2, 3.0)
    return 50 + noise, controller_output(-noise, rng)
