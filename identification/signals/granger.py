"""Whether the past of one signal helps to foresee another, for all pairs of some signals at once (Granger 1969).

statsmodels' test does the same for one pair; its import alone takes longer than a night takes for a loop, and the
products of all signals' pasts are needed once here, not once a pair. tests hold the two against each other.
"""

from __future__ import annotations

import numpy as np

from identification.record import Floats
from identification.signals.cross_spectrum import Whole

RIDGE = 1e-9
"""Share of a column's power that is added to it: rounded trends have pasts that depend on each other."""


def granger_f(signals: Floats, lags: int) -> Floats:
    """F statistics of every signal's past in foreseeing every other beside that one's own past.

    Parameters
    ----------
    signals : ndarray of shape (k, n)
        Samples of one clock.
    lags : int
        Samples of the past that are used.

    Returns
    -------
    ndarray of shape (k, k)
        F[i, j]: signal i foresees signal j; 0 on the diagonal, and everywhere where n is under four times the
        constants of a model.
    """
    k, n = signals.shape
    rows = n - lags
    out = np.zeros((k, k))
    if rows < 4 * (2 * lags + 1):
        return out
    past = np.stack([signals[:, lags - 1 - i : n - 1 - i] for i in range(lags)], axis=1).reshape(
        k * lags, rows
    )
    now = signals[:, lags:]
    past = past - past.mean(axis=1, keepdims=True)
    now = now - now.mean(axis=1, keepdims=True)
    gram, cross = past @ past.T, past @ now.T
    gram[np.diag_indices_from(gram)] *= 1.0 + RIDGE
    gram[np.diag_indices_from(gram)] += 1e-300
    power = np.einsum("ij,ij->i", now, now)

    def left(j: int, columns: Whole) -> float:
        own = cross[columns, j]
        return float(power[j] - own @ np.linalg.solve(gram[np.ix_(columns, columns)], own))

    each = [np.arange(i * lags, (i + 1) * lags) for i in range(k)]
    for j in range(k):
        alone = left(j, each[j])
        for i in range(k):
            both = left(j, np.concatenate((each[j], each[i]))) if i != j else alone
            if i != j and both > 1e-12 * power[j]:
                out[i, j] = max(alone - both, 0.0) / lags / (both / (rows - 2 * lags - 1))
    return out
