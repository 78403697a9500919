"""Does a cycle keep its phase over a record? A clock does; a cycle that a loop makes by itself does not.

A limit cycle has no reference for its phase: noise shifts it, and the shifts add up to a random walk (Demir,
Mehrotra, Roychowdhury 2000). The frequency of a machine has one. Over some hundred cycles the two are far apart.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.record import Floats, Mask

PERIODS = 8
"""Periods in a block: ours, enough to average noise, and few against a record of a hundred cycles."""
OUTLIER = 2.0
"""Largest amplitude of a block over the median one, so that a set point move does not decide."""
FINER = 16
"""Zero padding of the search for the frequency."""


class KeptPhase(NamedTuple):
    """Share of a cycle's amplitude that keeps one phase [-], and the number of periods from which it is known."""

    share: float
    periods: int


UNKNOWN = KeptPhase(0.0, 0)
"""Of a record without a cycle."""


def kept_phase(x: Floats, usable: Mask, period: float) -> KeptPhase:
    """How well the cycle of a period [samples] in x, shape (n,), keeps its phase; usable, bool, shape (n,).

    The cycle's amplitude and phase in each block are averaged at the frequency at which the blocks agree best. Blocks
    of which less than half is usable are left out.
    """
    size = max(round(PERIODS * period), PERIODS)
    count = x.size // size
    if count < 2:
        return KeptPhase(0.0, PERIODS * count)
    at = np.arange(count * size)
    phasor = np.exp(-2j * np.pi * at / period)
    good = usable[at].reshape(count, size)
    turned = (np.where(usable[at], x[at], 0.0) * phasor).reshape(count, size)
    kept = good.mean(axis=1) >= 0.5
    blocks = np.where(kept, turned.sum(axis=1) / np.maximum(good.sum(axis=1), 1), 0.0)
    height, periods = np.abs(blocks), PERIODS * int(kept.sum())
    if not kept.any() or not height.max() > 0.0:
        return KeptPhase(0.0, periods)
    blocks *= np.minimum(1.0, OUTLIER * np.median(height[kept]) / np.maximum(height, 1e-300))
    together = np.abs(np.fft.fft(blocks, FINER * count)).max()
    return KeptPhase(float(together / np.abs(blocks).sum()), periods)
