"""Evidence of each half-cycle for a valve fault; the loops of benchmarks/world share no code with the packages."""

from __future__ import annotations

from benchmarks.world.__main__ import night_rows
from benchmarks.world.draw import drawn, run
from benchmarks.world.recorder import recorded


def row_of(seed: int, kind: str, number: int) -> dict[str, object]:
    """The row of a night for one loop of the world, recorded at 1 s."""
    d = drawn(seed, number + 1, (kind,))[number]
    return night_rows([d], {d.name: recorded(run(d), "plain", d.seed)}, 1)[d.name]


def test_a_stem_that_jumps_by_its_whole_stickband_is_found() -> None:
    """The valve fault of a stem that jumps by 98 % of its stickband is named, although backlash explains no part of
    it.
    """
    row = row_of(573, "stiction", 1)
    assert (row["cause"], row["valve_fault"]) == ("valve", "stiction")


def test_a_few_half_cycles_after_set_point_moves_are_no_valve_fault() -> None:
    """A tight loop has no valve fault although 68 of 121 half-cycles fit backlash, mainly those after set point
    moves.
    """
    row = row_of(573, "tight", 4)
    assert (row["cause"], row["valve_fault"]) == ("tuning", "none")


def test_a_steady_load_is_steady_under_set_point_moves() -> None:
    """A sine load on a loop with eight set point moves has a constant size, and is named as the cause."""
    row = row_of(577, "load", 4)
    assert (row["cause"], row["valve_fault"]) == ("load", "none")
