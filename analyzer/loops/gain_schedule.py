"""A gain scheduled over OP, PV or SP, as stated in loops.csv: `op 50:0.4 75:0.2` is 0.4 times Kp from an OP of 50 on,
0.2 times Kp from 75 on, and Kp below."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.errors import InputError
from identification.record import Floats, Mask

SIGNALS = ("op", "pv", "sp")
MOST_PIECES = 4
"""Pieces of a schedule; ours, as many as the blocks of the systems in docs/loops-csv.md offer."""
EXPECTED = (
    f"op, pv or sp, then up to {MOST_PIECES - 1} rising values with a factor of kp each: 'op 50:0.4 75:0.2'"
)


@dataclass(frozen=True, slots=True)
class GainSchedule:
    """over : the signal that decides, in its own unit; edges : its values from which a factor holds, rising;
    factors : of Kp [-], the first, 1, below all edges."""

    over: str
    edges: tuple[float, ...]
    factors: tuple[float, ...]

    def share(self, signal: Floats) -> Floats:
        """The factor of Kp at each sample [-], shape (n,); signal : the one that decides, shape (n,)."""
        return np.asarray(np.array(self.factors)[np.searchsorted(self.edges, signal, side="right")])


def gain_schedule(cell: str, where: str) -> GainSchedule:
    """The schedule that a cell states. Raises InputError if it states none; `where` is its location for messages."""
    over, *pieces = cell.replace(";", " ").split()
    try:
        pairs = [tuple(float(x.replace(",", ".")) for x in piece.split(":")) for piece in pieces]
        edges, factors = (tuple(column) for column in zip(*pairs, strict=True))
    except ValueError:
        edges, factors = (), ()
    good = over.lower() in SIGNALS and 0 < len(edges) < MOST_PIECES
    good = good and all(map(math.isfinite, (*edges, *factors))) and all(a < b for a, b in pairwise(edges))
    if not good or min(factors) <= 0.0:
        raise InputError(f"{where}: {cell[:60]!r}", EXPECTED, "correct the cell")
    return GainSchedule(over.lower(), edges, (1.0, *factors))


def in_force(share: Floats, good: Mask) -> float:
    """The factor of Kp in force at most of the good samples [-]."""
    factors, counts = np.unique(share[good], return_counts=True)
    return float(factors[np.argmax(counts)]) if factors.size else 1.0
