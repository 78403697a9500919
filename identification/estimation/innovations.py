"""The noise model: what makes the residual of a model white, so that models can be judged by innovations.

Judging by innovations and not by simulation error keeps answers free of the bias that feedback gives to
direct identification (Ljung 1999, ch. 13) and sees small effects under large loads.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identification.record import Floats, Mask


@njit(cache=True)
def whiten(x: Floats, ar: Floats) -> Floats:
    """A(q) x with A = 1 + a1 q^-1 + ...; shape (n,), the first p samples zero."""
    n = x.size
    p = ar.size
    out = np.zeros(n)
    for k in range(p, n):
        s = x[k]
        for i in range(p):
            s += ar[i] * x[k - 1 - i]
        out[k] = s
    return out


def judged_mask(usable: Mask, order: int) -> Mask:
    """True where a sample and the `order` samples before it are usable, shape (n,)."""
    run = np.cumsum(np.concatenate(([0], ~usable)))
    out = np.zeros(usable.size, dtype=bool)
    out[order:] = run[order + 1 :] == run[: usable.size - order]
    return out


@njit(cache=True)
def _lag_products(x: Floats, judged: Mask, order: int) -> tuple[Floats, Floats]:
    gram = np.zeros((order, order))
    cross = np.zeros(order)
    for k in range(order, x.size):
        if judged[k]:
            for i in range(order):
                cross[i] += x[k] * x[k - 1 - i]
                for j in range(i + 1):
                    gram[i, j] += x[k - 1 - i] * x[k - 1 - j]
    for i in range(order):
        for j in range(i):
            gram[j, i] = gram[i, j]
    return gram, cross


def autoregression(residual: Floats, usable: Mask, order: int) -> Floats:
    """Least-squares autoregression of a residual.

    Parameters
    ----------
    residual : ndarray of shape (n,)
    usable : ndarray of bool, shape (n,)
        False where a sample must not be used.
    order : int
        p.

    Returns
    -------
    ndarray of shape (p,)
        Coefficients a of A(q) = 1 + a1 q^-1 + ... + ap q^-p.
    """
    gram, cross = _lag_products(np.ascontiguousarray(residual), judged_mask(usable, order), order)
    ridge = 1e-9 * np.trace(gram) / order + 1e-300
    return -np.linalg.solve(gram + ridge * np.eye(order), cross)


def arx_noise(y: Floats, u: Floats, usable: Mask, order: int, lags: int) -> Floats:
    """The A(q) of an unstructured ARX model y = -a y[past] + b u[past] + c, a first noise model; shape (order,)."""
    top = max(order, lags)
    n = y.size
    past = [-y[top - 1 - i : n - 1 - i] for i in range(order)]
    past += [u[top - 1 - i : n - 1 - i] for i in range(lags)] + [np.ones(n - top)]
    x = np.stack(past)
    weighted = x * judged_mask(usable, top)[top:]
    gram = weighted @ x.T
    ridge = 1e-8 * np.diag(gram).mean() * np.eye(len(past))
    return np.linalg.solve(gram + ridge, weighted @ y[top:])[:order]


def notch(x: Floats, period: float, width: float) -> Floats:
    """The signal without a narrow band about one period.

    Parameters
    ----------
    x : ndarray of shape (n,)
    period : float
        Centre of the band in samples.
    width : float
        Full width of the band as a share of its frequency.

    Returns
    -------
    ndarray of shape (n,)
        Second-order notch, zeros on the unit circle; gain one far from the band.
    """
    w = 2 * math.pi / period
    radius = math.exp(-0.5 * w * width)
    level = (1 - 2 * radius * math.cos(w) + radius**2) / (2 - 2 * math.cos(w))
    return _second_order(np.ascontiguousarray(x), math.cos(w), radius, level)


@njit(cache=True)
def _second_order(x: Floats, cosine: float, radius: float, level: float) -> Floats:
    out = np.empty_like(x)
    base = x[0]
    x1, x2, y1, y2 = base, base, base, base
    for k in range(x.size):
        y = level * (x[k] - 2 * cosine * x1 + x2) + 2 * radius * cosine * y1 - radius * radius * y2
        x2, x1, y2, y1 = x1, x[k], y1, y
        out[k] = y
    return out
