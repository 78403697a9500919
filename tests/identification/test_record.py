"""The record of a loop at a coarser step."""

from __future__ import annotations

import numpy as np

from identification.record import LoopRecord


def test_a_coarser_record_gives_the_same_response() -> None:
    """A lag driven by the means of OP over four samples agrees with the lag driven by OP, at each fourth
    sample, within 1 % of the range."""
    n, lag = 400, 60.0
    op = np.repeat(np.random.default_rng(1).uniform(40.0, 60.0, n // 25), 25)

    def moved(u: np.ndarray, dt: float) -> np.ndarray:
        x, out, pole = 0.0, np.empty(u.size), np.exp(-dt / lag)
        for k in range(u.size):
            out[k] = x
            x = u[k] + (x - u[k]) * pole
        return out

    pv = moved(op, 1.0)
    gap = np.zeros(n, bool)
    gap[11] = True
    r = LoopRecord("x", 0.0, 1.0, pv, pv, op, gap, masks={"gap": gap}).thinned(4)
    assert (len(r), r.dt_s) == (100, 4.0)
    assert np.array_equal(r.pv, pv[::4])
    assert np.abs(moved(r.op, 4.0) - r.pv).max() < 0.01 * np.ptp(pv)
    assert np.flatnonzero(r.bad).tolist() == [2] == np.flatnonzero(r.mask("gap")).tolist()
