"""Who foresees whom: Granger's test on the trends that waves keep, where their steps lie on each other."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from analyzer.plantwide.wave import Wave
from identification.record import Floats
from identification.signals.cross_spectrum import granger_f

FORESEEN = 12
"""Steps of the past by which others are foreseen: half of a period to a whole one."""
LEAST_STEPS = 300
"""Steps that trends have in common at least where foresight is asked for; ours: 12 for each constant."""
LEAST_F, PLAIN = 3.0, 10.0
"""F from which foresight is more than chance (one in a thousand by chance), and ratio of both ways that is plain."""


def on_common_steps(waves: Sequence[Wave]) -> tuple[list[int], Floats]:
    """Which of some waves have trends whose steps lie on each other, and those trends, shape (k, n)."""
    step = max((w.step_s for w in waves if w.trend.size), default=0.0)
    found: list[tuple[int, int, Floats]] = []
    for i, w in enumerate(waves):
        few = round(step / w.step_s) if w.trend.size else 0
        if few < 1 or abs(few * w.step_s / step - 1.0) > 1e-6:
            continue
        skip = -w.trend_first % few
        count = (w.trend.size - skip) // few
        means = w.trend[skip : skip + count * few].reshape(count, few).mean(axis=1)
        found.append((i, (w.trend_first + skip) // few, means))
    if not found:
        return [], np.zeros((0, 0))
    begin = max(first for _, first, _ in found)
    end = min(first + x.size for _, first, x in found)
    if end - begin < LEAST_STEPS:
        return [], np.zeros((0, 0))
    return [i for i, *_ in found], np.array([x[begin - first : end - first] for _, first, x in found], float)


def foresees(waves: Sequence[Wave]) -> Floats:
    """Mean over the others of how much better each foresees them than they foresee it (-1 to 1), by Granger's F."""
    out = np.zeros(len(waves))
    known, trends = on_common_steps(waves)
    if len(known) < 2:
        return out
    f = granger_f(trends, FORESEEN)
    clear = np.maximum(f, f.T) >= LEAST_F
    ratio = np.log(np.maximum(f, 0.1) / np.maximum(f.T, 0.1)) / math.log(PLAIN)
    out[known] = np.where(clear, np.clip(ratio, -1.0, 1.0), 0.0).sum(axis=1) / (len(known) - 1)
    return out


def foresight(one: Wave, others: Sequence[Wave]) -> float:
    """F with which one wave's past foresees others, in the median; 0 where theirs foresees it as well or better."""
    known, trends = on_common_steps([one, *others])
    if len(known) < 2 or known[0] != 0:
        return 0.0
    f = granger_f(trends, FORESEEN)
    forth, back = float(np.median(f[0, 1:])), float(np.median(f[1:, 0]))
    return forth if forth > back else 0.0
