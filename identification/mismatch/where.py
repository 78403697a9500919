"""Where simulation and recording differ, as reported: signals, spans, ranges, direction, period, features."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from identification.controller.check import runs
from identification.estimation.model import Fitted
from identification.estimation.noise import whitened
from identification.estimation.problem import Problem
from identification.mismatch import words
from identification.mismatch.explanation import Explanation
from identification.mismatch.location import Located, located
from identification.mismatch.recording import Recording
from identification.record import Floats
from identification.simulation.open_loop import simulate
from identification.simulation.parameters import Slot

LEAST_MEMORY = 2  # Least memory assumed for a loop [samples]
SPAN_PARTS = 40  # Number of parts of the record from which spans are formed
CARRIED = 0.5  # Share of the gain that the named spans carry together
ONE_WAY = 3.0
"""Ratio of the residual in one direction of OP to that in the other, from which that direction is
reported."""

REPORTED = ("name", "p", "carries", "share", "by", "range")
"""Reported fields of a feature."""


def carrying(won: Floats, dt_s: float) -> list[list[float]]:
    """Parts that together have a share of a gain, neighbours joined: first and last (excluded) time of each [s]."""
    edges = np.linspace(0, won.size, SPAN_PARTS + 1).astype(int)
    parts = np.maximum([won[a:b].sum() for a, b in pairwise(edges)], 0.0)
    order = np.argsort(-parts)
    count = int(np.searchsorted(np.cumsum(parts[order]), CARRIED * parts.sum())) + 1
    chosen = np.zeros(SPAN_PARTS, dtype=bool)
    chosen[order[:count]] = True
    return [[int(edges[a]) * dt_s, int(edges[b]) * dt_s] for a, b in runs(chosen)]


def ranges(x: Floats, weight: Floats) -> list[float]:
    """Range of a signal with nine tenths of a weight."""
    order = np.argsort(x)
    total = np.cumsum(np.maximum(weight[order], 0.0))
    if total[-1] <= 0:
        return [float(x.min()), float(x.max())]
    low, high = np.searchsorted(total, [0.05 * total[-1], 0.95 * total[-1]])
    return [float(x[order[low]]), float(x[order[min(high, x.size - 1)]])]


def direction(op: Floats, won: Floats) -> str:
    """Whether the gain comes from OP moves up, down, or both."""
    sign = np.sign(np.diff(op, prepend=op[0]))
    up, down = float(won[sign > 0].sum()), float(won[sign < 0].sum())
    if up > ONE_WAY * max(down, 0.0):
        return "up"
    return "down" if down > ONE_WAY * max(up, 0.0) else "both"


def half_power_periods(difference: Floats, dt_s: float) -> list[float]:
    """Periods [s] that bound half of a difference's power."""
    power = np.abs(np.fft.rfft(difference - difference.mean())) ** 2
    total = np.cumsum(power)
    if total[-1] <= 0:
        return []
    low, high = (max(int(np.searchsorted(total, q * total[-1])), 1) for q in (0.25, 0.75))
    length = difference.size * dt_s
    return [length / high, length / low]


def located_in(p: Problem, fit: Fitted, s: Recording) -> Located:
    """Where a fit's innovations are large or keep one sign."""
    late_s, lag_s = float(fit.model.c[Slot.L]), float(fit.model.c[Slot.T])
    late = min(round(late_s / s.dt_s), s.pv.size // 4)
    memory = max(round((late_s + lag_s) / s.dt_s), LEAST_MEMORY)
    return located(fit.e, s.pv, s.op, p.weight > 0, s.dt_s, late, memory)


def won_over(p: Problem, plain: Fitted, best: Fitted) -> tuple[Floats, Floats]:
    """Reduction of squared innovations by the better model at each sample, and both simulations' difference, (n,)."""
    before, after = simulate(p.inputs, plain.model.c), simulate(p.inputs, best.model.c)
    e0, e1 = (whitened(p.y - x, best.ar, p.edges) for x in (before, after))
    return p.weight * (e0**2 - e1**2), after - before


def where_of(found: Explanation, s: Recording, block: str, at: Located) -> dict[str, Any]:
    """Location of the misfit: signals, spans [s], ranges, direction of OP, periods [s] and the significant features.

    For a physical effect: where the baseline model is worse than the better one; for recorder and controller: the
    place of the finding; for an unnamed residual: where the innovations are large.

    block : of the verdict; at : of the baseline model's innovations, of the last model's if a residual remains.
    """
    p, marked, signals = found.p, found.finding, words.TEXTS["signals"][block]
    features = [{key: getattr(f, key) for key in REPORTED} for f in at.features]
    after = any(f.name == "after_reversals" for f in at.carrying)
    reported: dict[str, Any] = {"features": features, "after_reversals": after}
    if marked is not None:
        here = marked.where[: s.pv.size]
        spans = [[0.0, here.size * s.dt_s]] if here.all() else carrying(here.astype(float), s.dt_s)
        return {"signals": signals, "spans": spans} | reported
    if found.accepted:
        won, difference = won_over(p, found.plain, found.best)
    elif found.residual_nat > 0:
        won = at.local if at.carrying else p.weight * found.best.e**2
        difference = np.where(p.weight > 0, found.best.e, 0.0)
    else:
        return {"signals": [], "spans": []} | reported
    return {
        "signals": signals,
        "spans": carrying(won, s.dt_s),
        "pv_range": ranges(s.pv, won),
        "op_range": ranges(s.op, won),
        "direction": direction(s.op, won),
        "band_s": half_power_periods(difference, s.dt_s),
    } | reported
