"""A gain with two values, below and from an edge of OP, PV or SP on: the edge at which the moves of the stated law,
each times a factor of its side, give OP's moves best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.controller.law_variants import GIVES, gains_of, no_law, shape_of, shaped
from identification.models import Pid
from identification.record import Floats, LoopRecord
from identification.simulation.lag import first_order

SIDE = 0.1
"""Least share of the law's squared moves on either side of an edge; ours: fewer are one excursion."""
SAME = 1.1
"""Factor within which the gain of one side is the stated one; ours: the resolution of gains recovered from samples of
every scan (proofs/controllers.md: 9 % in nine of ten)."""
APART = 1.3
"""Least factor between both sides; ours: smaller ones are within the resolution of the settings check."""
BETTER = 0.7
"""Largest residual over that of the same gain on both sides; ours: noise that the recorder adds to PV leaves its
share on either."""


@dataclass(frozen=True, slots=True)
class ScheduledGain:
    """over : the signal, 'op', 'pv' or 'sp', that schedules a gain; edge : its value from which another gain holds
    [% of span], None if unknown; below, above : the gains over the stated one [-]."""

    over: str
    edge: float | None = None
    below: float = 1.0
    above: float = 1.0


def gain_pieces(record: LoopRecord, stated: Pid) -> ScheduledGain | None:
    """The edge and the gains on either side, one of which is the stated one; None if no edge explains OP that well,
    or if the samples do not show every scan."""
    error = shaped(record.sp - first_order(record.pv, stated.pv_filter_s / record.dt_s), shape_of(stated))
    kp, ki, _ = gains_of(stated)
    due = kp * np.diff(error) + ki * record.dt_s * error[1:]
    good = ~no_law(record, stated)
    use = good[1:] & good[:-1]
    moved, due = np.diff(record.op)[use], due[use]
    whole = float(moved @ moved)
    if not whole > 0.0 or not float(due @ due) > 0.0:
        return None
    deciding = {"op": record.op[:-1], "pv": record.pv[1:], "sp": record.sp[1:]}
    found = [(*_best_edge(x[use], due, moved), name) for name, x in deciding.items()]
    residual, edge, below, above, over = min(found, key=lambda f: f[0])
    alone = whole - float(due @ moved) ** 2 / float(due @ due)
    same = any(1.0 / SAME <= factor <= SAME for factor in (below, above))
    if not same or min(below, above) <= 0.0 or max(below, above) < APART * min(below, above):
        return None
    return ScheduledGain(over, edge, below, above) if residual < min(GIVES * whole, BETTER * alone) else None


def _best_edge(x: Floats, due: Floats, moved: Floats) -> tuple[float, float, float, float]:
    """Least residual, its edge of x, and the factors below and from it on; inf for a signal without an edge."""
    order = np.argsort(x, kind="stable")
    values, m, d = x[order], due[order], moved[order]
    size, both = np.cumsum(m * m), np.cumsum(m * d)
    ends = np.flatnonzero(np.diff(values) > 0.0)  # an edge lies between two different values
    ends = ends[(size[ends] >= SIDE * size[-1]) & (size[-1] - size[ends] >= SIDE * size[-1])]
    if not ends.size:
        return np.inf, 0.0, 1.0, 1.0
    below, above = both[ends] / size[ends], (both[-1] - both[ends]) / (size[-1] - size[ends])
    residuals = float(d @ d) - below * both[ends] - above * (both[-1] - both[ends])
    k = int(np.argmin(residuals))
    edge = 0.5 * float(values[ends[k]] + values[ends[k] + 1])
    return float(residuals[k]), edge, float(below[k]), float(above[k])
