"""Many stick-slips at once under a given noise model: each stem's response at many dead times from one lag."""

from __future__ import annotations

import numpy as np
from numba import njit

from identification.estimation.hammerstein import stem_blocks
from identification.estimation.search import Dynamics, Products, variance_left, white_pv, whitened_stem
from identification.estimation.window import Stems, Window
from identification.record import Floats
from identification.simulation.lag import Lag, respond, unit_lag
from identification.simulation.valve import StemLaw


@njit(cache=True)
def _scan(
    stems: Stems,
    rows: Floats,
    sums: Floats,
    ar: Floats,
    dt_s: float,
    pairs: Floats,
    tolerance: float,
    begins: Floats,
) -> Floats:
    level, tries, n = max(1.0 - ar.sum(), 1e-6), begins.shape[0], rows.shape[1]
    out, x = np.empty(pairs.shape[0]), np.empty(n)
    for i in range(pairs.shape[0]):
        width, share = pairs[i, 0], pairs[i, 1]
        law = StemLaw(0.5 * width * (1 + share), 0.5 * width * (1 - share), tolerance)
        stem = stem_blocks(stems, law)
        white = whitened_stem(stem - stem.mean(), ar)
        out[i], whole, known = np.inf, white, 0.0
        for j in range(tries):
            lag = unit_lag(begins[j, 0], begins[j, 1], dt_s)
            if begins[j, 0] != known:
                whole, known = respond(white, Lag(lag.pole, 1.0, 0.0, 0)), begins[j, 0]
            products = _later(whole, lag, rows, x)
            left = variance_left(x, products, rows, sums, level, lag.pole, begins[j, 0] > 0.5 * n * dt_s)[0]
            out[i] = min(out[i], left)
    return out


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _later(whole: Floats, lag: Lag, rows: Floats, out: Floats) -> Products:
    """The response at one dead time into `out`, from that without any, and its products, summed in any order.

    The stem is taken to rest at first."""
    n, delay = out.size, lag.delay
    out[: min(delay, n)] = 0.0
    if delay >= n:
        return 0.0, 0.0, 0.0, 0.0
    x = lag.now * whole[0]
    out[delay], xv, x1, xt = x, x * rows[0, delay], x * rows[1, delay], x * rows[2, delay]
    xx = x * x1
    v, w, t = rows[0, delay + 1 :], rows[1, delay + 1 :], rows[2, delay + 1 :]
    late, earlier, later = whole[1 : n - delay], whole[: n - delay - 1], out[delay + 1 :]
    for k in range(v.size):
        x = lag.now * late[k] + lag.before * earlier[k]
        weighted = x * w[k]
        later[k] = x
        xv, x1, xt, xx = xv + x * v[k], x1 + weighted, xt + x * t[k], xx + x * weighted
    return xv, x1, xt, xx


def scan(window: Window, pairs: Floats, tolerance: float, ar: Floats, begins: list[Dynamics]) -> Floats:
    """Innovations variance of many stick-slips at once.

    pairs : shape (m, 2), stickband [% OP] and slip jump as a share of it; tolerance : how the stems behave in motion
    (valve.py); ar : shape (p,), noise model; begins : time constants and dead times tried [s]; the best counts.
    Returns shape (m,), least innovations variance of each pair [% PV squared].
    """
    pv, table = white_pv(window, ar), np.array(begins)
    return _scan(window.stems_in_blocks, pv.rows, pv.sums, ar, window.dt_s, pairs, tolerance, table)  # type: ignore[no-any-return]
