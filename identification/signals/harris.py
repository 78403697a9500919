"""How near a loop is to minimum variance."""

from __future__ import annotations

import numpy as np

from identification.record import Floats, Mask

ORDER = 15
"""Lags of the predictor; ours."""
SAMPLES = 6
"""Samples per dead time that the error is thinned to, so that the lags span a few dead times."""
MOST = 4000
"""Samples used at most, the latest."""


def harris_index(error: Floats, usable: Mask, dt_s: float, dead_time_s: float) -> float | None:
    """Minimum variance over variance of the error: 1 is minimum variance, 0 is far from it.

    The minimum variance is what a predictor one dead time ahead leaves unexplained (Harris 1989; estimated by
    regression as in Desborough, Harris 1992).

    Parameters
    ----------
    error : ndarray of shape (n,)
    usable : ndarray of bool, shape (n,)
    dt_s, dead_time_s : float
        Sample interval and dead time [s].

    Returns
    -------
    float or None
        None where fewer than 200 samples are usable or the error is constant.
    """
    step = max(int(dead_time_s / SAMPLES / dt_s), 1)
    e, use = error[::step][-MOST:], usable[::step][-MOST:]
    ahead = max(round(dead_time_s / (step * dt_s)), 1) + 1
    reach = ahead + ORDER
    n = e.size - reach
    if n < 200:
        return None
    e = e - e[use].mean() if use.any() else e
    rows = np.stack([e[reach - ahead - k : reach - ahead - k + n] for k in range(ORDER)])
    seen = np.concatenate(([0], np.cumsum(~use)))
    whole = seen[reach + 1 : reach + 1 + n] == seen[:n]
    y = e[reach : reach + n][whole]
    power = float(y @ y)
    if y.size < 200 or power <= 0:
        return None
    x = rows[:, whole]
    gram = x @ x.T
    beta = np.linalg.solve(gram + 1e-9 * np.trace(gram) * np.eye(ORDER), x @ y)
    left = y - beta @ x
    return float(np.clip(left @ left / power, 0.0, 1.0))
