"""Derivative and filter of a controller found by data: a first look at all loops, and the whole law where it pays."""

from __future__ import annotations

import numpy as np

from analyzer.config import SettingsLimits
from analyzer.finder.law import TINY
from identification.controller.free_law import free_law
from identification.models import Pid
from identification.record import Floats, LoopRecord

SLOPES = 3
"""Latest differences of PV's moves in the first look: a filtered derivative acts on several."""
MORE = 0.25
"""Share of the residual of gain and integral that these explain, from which the whole law is fitted; ours.
It is .28 to 1 for controllers with a derivative or a filter of PV at 1 s. It is at most .10 for others at
1 and 10 s (proofs/controllers_plant.py, seed 51)."""
LEAST = 200
"""Samples from which the law is fitted; ours."""
LATEST = 8640
"""Samples of the whole law: ours, a third of a second for each such loop."""
SCALE = 60.0
"""Time scale of the moves that the law is fitted to [samples]; as of a loop without stated settings (measure.py)."""


def terms_of(sp: Floats, pv: Floats, op: Floats, dt_s: float) -> Pid | None:
    """The controller of SP, PV and OP [%], shape (n,) each, if it has a derivative or a filter of PV; else None."""
    sp, pv, op = sp[-LATEST:], pv[-LATEST:], op[-LATEST:]
    if pv.size < LEAST or _explained_by_slopes(sp, pv, op) < MORE:
        return None
    record = LoopRecord("", 0.0, dt_s, sp, pv, op, np.zeros(pv.size, dtype=bool))
    law, limits = free_law(record, SCALE * dt_s), SettingsLimits()
    known = limits.explained_alone, limits.ti_samples, limits.filter_of_ti
    if law is None or not law.is_clear(dt_s, *known):
        return None
    return law.found if law.found.td_s > 0.0 or law.found.pv_filter_s > 0.0 else None


def _explained_by_slopes(sp: Floats, pv: Floats, op: Floats) -> float:
    """Share that the latest slopes of PV explain of what gain and integral leave of OP's moves [-]; 0 of nothing."""
    error, slopes, moves = sp - pv, np.diff(pv, 2), np.diff(op)[SLOPES:]
    plain = np.column_stack([np.diff(error)[SLOPES:], error[SLOPES + 1 :]])
    more = [slopes[SLOPES - 1 - k : slopes.size - k] for k in range(SLOPES)]
    misfit = _misfit(plain, moves)
    if misfit <= TINY * float(moves @ moves):
        return 0.0
    return 1.0 - _misfit(np.column_stack([plain, *more]), moves) / misfit


def _misfit(x: Floats, y: Floats) -> float:
    """Sum of squares that a linear regression without a constant leaves."""
    slope, *_ = np.linalg.lstsq(x.T @ x, x.T @ y, rcond=None)
    residual = y - x @ slope
    return float(residual @ residual)
