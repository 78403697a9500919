"""Where simulation and recording differ: signals, time spans, operating range, direction, period."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.mismatch.noise import whitened
from identification.mismatch.simulation import simulate
from identification.record import Floats, Mask

if TYPE_CHECKING:
    from identification.mismatch.explain import Explanation, Subject

PARTS = 40
"""Parts of the record that spans are made of."""
CARRIES = 0.5
"""Share of the gain that the named spans carry together."""
SIGNALS = {"recorder": ["PV", "OP"], "sensor": ["PV"], "controller": ["SP", "PV", "OP"], "load": ["PV"]}


def carrying(won: Floats) -> list[tuple[int, int]]:
    """Parts that together carry CARRIES of a gain, neighbours joined: first and last (excluded) sample of each."""
    edges = np.linspace(0, won.size, PARTS + 1).astype(int)
    parts = np.maximum([won[a:b].sum() for a, b in pairwise(edges)], 0.0)
    order = np.argsort(-parts)
    count = int(np.searchsorted(np.cumsum(parts[order]), CARRIES * parts.sum())) + 1
    chosen = np.zeros(PARTS, dtype=np.int8)
    chosen[order[:count]] = 1
    turn = np.diff(np.concatenate(([0], chosen, [0])))
    firsts, lasts = np.flatnonzero(turn == 1), np.flatnonzero(turn == -1)
    return [(int(edges[a]), int(edges[b])) for a, b in zip(firsts, lasts, strict=True)]


def masked_spans(where: Mask) -> list[tuple[int, int]]:
    """Spans of a mask, by the parts that hold most of it."""
    return carrying(where.astype(float))


def ranges(x: Floats, weight: Floats) -> list[float]:
    """Range of a signal that carries nine tenths of a weight."""
    order = np.argsort(x)
    total = np.cumsum(np.maximum(weight[order], 0.0))
    if total[-1] <= 0:
        return [float(x.min()), float(x.max())]
    low, high = np.searchsorted(total, [0.05 * total[-1], 0.95 * total[-1]])
    return [float(x[order[low]]), float(x[order[min(high, x.size - 1)]])]


def direction(op: Floats, won: Floats) -> str:
    """Whether the gain lives in OP's moves up, down, or both."""
    way = np.sign(np.diff(op, prepend=op[0]))
    up, down = float(won[way > 0].sum()), float(won[way < 0].sum())
    if up > 3 * max(down, 0.0):
        return "up"
    return "down" if down > 3 * max(up, 0.0) else "both"


def band(difference: Floats, dt_s: float) -> list[float]:
    """Periods [s] between which half of a difference's power lies."""
    power = np.abs(np.fft.rfft(difference - difference.mean())) ** 2
    total = np.cumsum(power)
    if total[-1] <= 0:
        return []
    low, high = (max(int(np.searchsorted(total, q * total[-1])), 1) for q in (0.25, 0.75))
    length = difference.size * dt_s
    return [length / high, length / low]


def where_of(found: Explanation, s: Subject, block: str) -> dict[str, Any]:
    """Where the misfit is: signals, spans [s], ranges, direction of OP and periods [s].

    Of an effect of the physics it is where the plain model loses to the better one; of recorder and controller, where
    the finding is.
    """
    marked = found.trace or found.ruling
    if marked is None and not found.accepted:
        return {}
    out: dict[str, Any] = {"signals": SIGNALS.get(block, ["OP", "PV"])}
    if marked is not None:
        mask = marked.where[: s.pv.size]
        out["spans"] = [[a * s.dt_s, b * s.dt_s] for a, b in masked_spans(mask)]
        return out
    p = found.p
    before, after = simulate(p.scene, found.plain.model.c), simulate(p.scene, found.best.model.c)
    e0, e1 = (whitened(p.y - x, found.best.ar, p.edges) for x in (before, after))
    won = p.weight * (e0**2 - e1**2)
    return out | {
        "spans": [[a * s.dt_s, b * s.dt_s] for a, b in carrying(won)],
        "pv_range": ranges(s.pv, won),
        "op_range": ranges(s.op, won),
        "direction": direction(s.op, won),
        "band_s": band(after - before, s.dt_s),
    }
