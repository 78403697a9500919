"""A PI loop in plain Python that shares no code with the project's simulator."""

from __future__ import annotations

import numpy as np


def error(
    kp_gain: float, ti_s: float, lag_s: float, dead_s: int, load: np.ndarray, noise: np.ndarray
) -> np.ndarray:
    """SP - PV of a lag of gain one with dead time under PI control at 1 s, with the load at the process input."""
    n = load.size
    state, total = 0.0, 0.0
    late = np.zeros(dead_s + 1)
    out = np.empty(n)
    for k in range(n):
        e = -(state + noise[k])
        out[k] = e
        total += e / ti_s
        late[k % (dead_s + 1)] = kp_gain * (e + total)
        state += (late[(k + 1) % (dead_s + 1)] + load[k] - state) / lag_s
    return out
