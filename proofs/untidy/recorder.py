"""The values of a trend that a historian keeps, and the values that it returns."""

from __future__ import annotations

import numpy as np


def rounded(x: np.ndarray, grid: float) -> np.ndarray:
    """Rounded to a grid [%]; 0: not rounded."""
    return np.round(x / grid) * grid if grid > 0 else x


def swinging_door(x: np.ndarray, deviation: float, longest: int) -> np.ndarray:
    """Archived by a swinging door with that deviation and read by linear interpolation, shape (n,).

    From the last archived point, two lines limit the slope: the steepest and the flattest that pass every later
        sample within the deviation. Where they cross, the sample before is archived.
    """
    kept = [0]
    steep, flat = np.inf, -np.inf
    for k in range(1, x.size):
        run = k - kept[-1]
        high, low = (x[k] + deviation - x[kept[-1]]) / run, (x[k] - deviation - x[kept[-1]]) / run
        steep, flat = min(steep, high), max(flat, low)
        if flat > steep or run > longest:
            kept.append(k - 1 if k - 1 > kept[-1] else k)
            run = max(k - kept[-1], 1)
            rise = x[k] - x[kept[-1]]
            steep, flat = (rise + deviation) / run, (rise - deviation) / run
    kept.append(x.size - 1)
    at = np.unique(kept)
    return np.interp(np.arange(x.size), at, x[at])
