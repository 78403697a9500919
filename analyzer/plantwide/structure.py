"""Links between loops from the trends: a set point that is another loop's output, or proportional to its PV.

For each loop the moves of SP, PV and OP from block to block are stored, each limited to three usual ones, so that one
step by an operator does not dominate a night; a set point differs from its source output only by recording.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import StrEnum

import numpy as np
import pyarrow as pa

from analyzer.config import PlantLimits
from identification.record import Floats, LoopRecord

BLOCK_S = 120.0
"""Length of the blocks between which moves are compared [s]: longer than delays of recorders and scans, short
compared with a shift."""
LEAST_BLOCKS = 30  # Blocks from which moves are compared [blocks]
USUAL_MOVE = 0.6  # Quantile of moves that is a usual one
MOST_MOVE = 3.0  # Largest move that counts, in usual ones

STEPS = 40
"""Steps per usual move that are stored; ours: a fortieth is far below the errors of recorders."""
ROWS = 256
"""Set points compared at a time."""
Small = np.ndarray[tuple[int], np.dtype[np.int8]]


class Tie(StrEnum):
    """Link of a loop to another: its set point is the other's output, or has a ratio to its PV, or its output is half
    of the other's."""

    MASTER = "master"
    RATIO = "ratio"
    SPLIT = "split"


@dataclass(frozen=True, slots=True)
class Link:
    """The loop to which another one is linked, the kind of link, and the agreement of their moves [-]."""

    loop: str
    tie: Tie
    agreement: float


@dataclass(frozen=True, slots=True)
class Moves:
    """Moves of one loop's SP, PV and OP between blocks of the clock, the first with the number `first` since 1970, in
    STEPS of a usual move, shape (n,) each; of length 0 if a signal is mostly constant."""

    loop: str
    first: int
    sp: Small
    pv: Small
    op: Small


def moves_of(record: LoopRecord) -> Moves | None:
    """Stored moves of a record; None if it is too short."""
    at = np.floor((record.start_s + record.time_s) / BLOCK_S).astype(np.int64)
    block = at - at[0]
    count = int(block[-1]) + 1
    if count < LEAST_BLOCKS:
        return None
    good = ~record.bad
    kept = np.bincount(block, good.astype(np.float64), count).astype(np.float64)

    def moves(x: Floats) -> Small:
        return _in_steps(np.bincount(block, np.where(good, x, 0.0), count).astype(np.float64), kept)

    sp = np.empty(0, np.int8) if record.sp_estimated else moves(record.sp)
    return Moves(record.tag, int(at[0]), sp, moves(record.pv), moves(record.op))


def _in_steps(total: Floats, kept: Floats) -> Small:
    """Moves between means of blocks, zero if one of two has none."""
    there = kept > 0
    move = np.diff(total / np.maximum(kept, 1.0))
    move[~(there[1:] & there[:-1])] = 0.0
    usual = float(np.quantile(np.abs(move), USUAL_MOVE))
    if not usual > 1e-9 * max(float(np.abs(total).max()), 1.0):
        return np.empty(0, np.int8)
    return np.round(STEPS * np.clip(move / usual, -MOST_MOVE, MOST_MOVE)).astype(np.int8)


def links_of(moves: Sequence[Moves], limits: PlantLimits) -> dict[str, Link]:
    """The loop to which each one is linked, if one agrees clearly best.

    Outputs are compared first: the PV of a master's process, or of another slave, moves with the set point as well.
    """
    found = _best(moves, "op", Tie.MASTER, limits.linked)
    return _best(moves, "pv", Tie.RATIO, limits.in_ratio) | found


def _best(moves: Sequence[Moves], role: str, tie: Tie, least: float) -> dict[str, Link]:
    """The loop whose signal agrees best with each set point, by at least `least` [-]."""
    slaves = [m for m in moves if m.sp.size]
    given = [m for m in moves if getattr(m, role).size]
    if not slaves or not given:
        return {}
    begin = min(m.first for m in moves)
    size = max(m.first - begin + max(m.sp.size, m.pv.size, m.op.size) for m in moves)
    signals = _on_one_clock(given, role, begin, size)
    names = np.array([m.loop for m in given])
    out = {}
    for k in range(0, len(slaves), ROWS):
        part = slaves[k : k + ROWS]
        level = np.abs(_on_one_clock(part, "sp", begin, size) @ signals.T)
        level[np.array([m.loop for m in part])[:, None] == names[None]] = 0.0
        for m, row in zip(part, level, strict=True):
            best = int(np.argmax(row))
            if row[best] >= least:
                out[m.loop] = Link(str(names[best]), tie, float(row[best]))
    return out


def _on_one_clock(moves: Sequence[Moves], role: str, begin: int, size: int) -> np.ndarray:
    """Moves on one clock, each normalized to length one, shape (loops, size)."""
    out = np.zeros((len(moves), size), np.float32)
    for row, m in zip(out, moves, strict=True):
        x = getattr(m, role)
        row[m.first - begin : m.first - begin + x.size] = x
        row /= max(math.sqrt(float(row @ row)), 1e-9)
    return out


def moves_table(moves: Sequence[Moves]) -> pa.Table:
    """One row per loop."""
    return pa.table({f.name: [getattr(m, f.name) for m in moves] for f in fields(Moves)})


def moves_in(table: pa.Table | None) -> list[Moves]:
    """The moves of a table, none without one."""
    if table is None or not table.num_rows:
        return []
    columns = (table.column(f.name).to_numpy() for f in fields(Moves))
    return [Moves(*row) for row in zip(*columns, strict=True)]
