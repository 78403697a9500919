"""The noise model: an autoregression that whitens the residual of a model. Models are compared by innovations.

Comparison by innovations, not by simulation error, avoids the bias of direct identification in closed loop (Ljung
1999, ch. 13) and detects small effects under large loads. Lags act in groups, by their mean, in two variants: single
lags (every_lag), whose few constants are fitted jointly with those of one valve, and widening groups (edges_for),
which fit both slow loads and fast noise and whose constants are solved for.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identification.record import Floats, Mask

GENERIC = 0.95
"""First coefficient of the generic noise model, which is nearly a difference. A noise model fitted with
one valve favours that valve, so candidates are ranked under both."""
FEWEST_EDGES = 4  # Fewest edges of the groups of lags
JUDGED = 0.5  # Share of the good samples that have to be judged
LONGEST_LAG = 12  # Least length of a record, in its longest lag
AR_ORDER = 8
"""Order of the noise model of single lags: on the simulated plants 12 gives innovations less than 1 %
smaller."""
LAG_EDGES = (0, 1, 2, 3, 4, 5, 6, 8, 10, 13, 17, 22, 29, 38, 50, 66, 88, 117)
"""Edges of the lags of a wide noise model, which act together by their mean between two of them [samples]:
single lags where noise is, a third of an octave where load is, reaching as far as a loop of 100 samples of
time constant needs."""

Edges = NDArray[np.int64]
EDGES = np.array(LAG_EDGES, dtype=np.int64)
"""Edges of a wide noise model: the lags between consecutive edges act together, by their mean."""
NO_NOISE = np.zeros(1, dtype=np.int64)
"""Edges without any lag: the innovations are the simulation errors themselves."""
TILE = 1024
"""Samples whitened at a time."""


def edges_for(usable: Mask) -> Edges:
    """Edges of the lag groups for a record, as far back as half of its good samples have good predecessors.

    If single samples are missing throughout a record, a longer noise model would judge no sample.
    """
    count = max(int(np.searchsorted(EDGES, usable.size / LONGEST_LAG, side="right")), FEWEST_EDGES)
    while count > FEWEST_EDGES and judged(usable, int(EDGES[count - 1])).sum() < JUDGED * usable.sum():
        count -= 1
    return EDGES[:count]


@njit(cache=True)
def every_lag(order: int) -> Edges:
    """Edges of single lags up to an order."""
    return np.arange(order + 1)


@njit(cache=True)
def lag_means(r: Floats, edges: Edges) -> Floats:
    """Means of the residual over each group of lags, shape (groups, n); zero where they reach before the start."""
    n, groups = r.size, edges.size - 1
    total = np.zeros(n + 1)
    for k in range(n):
        total[k + 1] = total[k] + r[k]
    out = np.zeros((groups, n))
    for j in range(groups):
        near, far = edges[j], edges[j + 1]
        scale = 1.0 / (far - near)
        part, newer, older = out[j, far:], total[far - near : n - near], total[: n - far]
        for k in range(part.size):
            part[k] = (newer[k] - older[k]) * scale
    return out


@njit(cache=True)
def whitened(x: Floats, ar: Floats, edges: Edges) -> Floats:
    """Innovations of x under a noise model, shape (n,); complete from the longest lag on."""
    n, groups = x.size, edges.size - 1
    single = 0
    while single < groups and edges[single + 1] == single + 1:
        single += 1
    total = np.zeros(n + 1)
    if single < groups:
        for k in range(n):
            total[k + 1] = total[k] + x[k]
    out = x.copy()
    for first in range(0, n, TILE):  # one stretch at a time, lag by lag, so that the vectors stay in cache
        last = min(first + TILE, n)
        for i in range(single):
            if ar[i] == 0.0:
                continue
            begin = max(first, i + 1)
            factor, part, past = ar[i], out[begin:last], x[begin - 1 - i : last - 1 - i]
            for k in range(part.size):
                part[k] -= factor * past[k]
        for j in range(single, groups):
            near, far = edges[j], edges[j + 1]
            begin = max(first, far)
            factor, part = ar[j] / (far - near), out[begin:last]
            newer, older = total[begin - near : last - near], total[begin - far : last - far]
            for k in range(part.size):
                part[k] -= (newer[k] - older[k]) * factor
    return out


def judged(usable: Mask, reach: int) -> Mask:
    """True where a sample and the `reach` samples before it may be used, shape (n,)."""
    seen = np.concatenate(([0], np.cumsum(~usable)))
    out = np.zeros(usable.size, dtype=bool)
    out[reach:] = seen[reach + 1 :] == seen[: usable.size - reach]
    return out


def fitted(columns: Floats, r: Floats) -> tuple[Floats, Floats]:
    """Noise model of least innovations, shape (groups,), and the products of the columns, shape (groups, groups).

    `columns` from lag_means, shape (groups, n), and `r`, shape (n,), are both multiplied by the root of the weights.
    """
    gram = columns @ columns.T
    if gram.size == 0:
        return np.empty(0), gram
    ridge = 1e-10 * np.trace(gram) / gram.shape[0] + 1e-300
    return np.linalg.lstsq(gram + ridge * np.eye(gram.shape[0]), columns @ r, rcond=1e-13)[0], gram


def arx_noise(y: Floats, u: Floats, usable: Mask, order: int, lags: int) -> Floats:
    """An initial noise model of single lags, (order,), from a free ARX model, y = ar y[past] + b u[past] + c."""
    top = max(order, lags)
    n = y.size
    past = [y[top - 1 - i : n - 1 - i] for i in range(order)]
    past += [u[top - 1 - i : n - 1 - i] for i in range(lags)] + [np.ones(n - top)]
    x = np.stack(past)
    weighted = x * judged(usable, top)[top:]
    gram = weighted @ x.T
    ridge = 1e-8 * np.diag(gram).mean() * np.eye(len(past))
    return np.linalg.solve(gram + ridge, weighted @ y[top:])[:order]


def generic_noise() -> Floats:
    """The generic noise model, used without knowledge of the record, shape (AR_ORDER,)."""
    out = np.zeros(AR_ORDER)
    out[0] = GENERIC
    return out
