"""Dependences between loops are found from the moves of set points, outputs and PVs, and not from random moves."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.plantwide.structure import Link, Moves, Tie, links_of, moves_in, moves_of, moves_table
from identification.record import Floats, LoopRecord
from proofs.plant import START_S

LIMITS = Config().plant
N, DT_S = 9000, 4.0


def wander(seed: int) -> Floats:
    """A signal that always moves."""
    x = np.cumsum(np.random.default_rng(seed).standard_normal(N))
    return 50.0 + 10.0 * (x - x.mean()) / np.ptp(x)


def by_exception(x: Floats, band: float) -> Floats:
    """A signal recorded by exception: changes smaller than a band are not recorded."""
    out, last = x.copy(), x[0]
    for k in range(x.size):
        last = x[k] if abs(x[k] - last) >= band else last
        out[k] = last
    return out


def moves(loop: str, sp: Floats, pv: Floats, op: Floats, late: int = 0) -> Moves:
    """The stored moves of trends whose record begins some samples late."""
    start = START_S + late * DT_S
    record = LoopRecord(loop, start, DT_S, sp[late:], pv[late:], op[late:], np.zeros(N - late, dtype=bool))
    found = moves_of(record)
    assert found is not None
    return found


def test_a_set_point_that_is_an_output_names_the_master() -> None:
    """The set point in another unit, recorded by exception and from a later time, is still found as the master's
    output.

    The PV that the master moves is not its leader.
    """
    out = wander(1)
    master = moves("TIC1", np.full(N, 50.0), 50.0 + 0.4 * (out - 50.0), out)
    slave = moves("FIC1", by_exception(3.0 * out - 20.0, 0.3), 3.0 * out - 20.0, wander(2), late=777)
    found = links_of([master, slave, moves("X", wander(3), wander(4), wander(5))], LIMITS)
    assert set(found) == {"FIC1"}
    assert (found["FIC1"].loop, found["FIC1"].tie) == ("TIC1", Tie.MASTER)
    assert found["FIC1"].agreement > 0.9


def test_a_set_point_in_a_ratio_names_its_leader() -> None:
    """A set point that follows a PV and no output has a ratio to that PV."""
    leading = wander(1)
    leader = moves("FIC1", np.full(N, 50.0), leading, wander(2))
    found = links_of([leader, moves("FIC2", 0.4 * leading + 5.0, wander(3), wander(4))], LIMITS)
    assert found == {"FIC2": Link("FIC1", Tie.RATIO, pytest.approx(1.0, abs=0.01))}


def test_two_hundred_loops_that_move_randomly_have_no_links() -> None:
    """Of 39,800 pairs of unrelated loops none is reported."""
    loops = [moves(f"L{k}", wander(3 * k), wander(3 * k + 1), wander(3 * k + 2)) for k in range(200)]
    assert links_of(loops, LIMITS) == {}


def test_steps_at_one_time_are_no_link() -> None:
    """Two set points that an operator moves at the same time are no cascade, and a constant set point has no
    moves.
    """
    rng, step = np.random.default_rng(1), np.where(np.arange(N) > 4000, 20.0, 0.0)
    one = moves("A", 50.0 + step, 50.0 + step, wander(1) + step)
    still = moves("B", 30.0 + step, 30.0 + step + 0.1 * rng.standard_normal(N), wander(2))
    assert still.sp.size == 0
    always_moving = moves("C", wander(3) + step, wander(4), wander(5))
    assert links_of([one, still, always_moving], LIMITS) == {}


def test_moves_are_kept_as_they_are() -> None:
    """Moves read from the store equal the moves written; a record of an hour stores none."""
    put = moves("A", wander(1), wander(2), np.full(N, 50.0))
    (got,) = moves_in(moves_table([put]))
    assert (got.loop, got.first, got.op.size) == ("A", put.first, 0)
    assert (got.sp == put.sp).all()
    assert (got.pv == put.pv).all()
    short = LoopRecord("A", START_S, DT_S, *(wander(k)[:800] for k in range(3)), np.zeros(800, dtype=bool))
    assert moves_of(short) is None
