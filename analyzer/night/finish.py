"""A night put together: the plant-wide pass over its pieces, lanes, then one table, joined with what the store has.

A second export of the same night adds its loops. Of a loop that stands in both the fuller record is kept, and the
newer of two that are alike, so that the same night twice replaces and a good night is never lost to an empty one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pyarrow as pa

from analyzer.belief.nights import settle
from analyzer.columns import GROUPS, NIGHTS, Column, Row
from analyzer.config import Config, NightLimits
from analyzer.lanes.lanes import in_lanes
from analyzer.loop.decisions import Status
from analyzer.plantwide.cascade import led_anew, linked
from analyzer.plantwide.night import traced_night
from analyzer.plantwide.structure import links_of, moves_in
from analyzer.plantwide.wave import waves_in
from analyzer.store.rows import finding_of, night_row
from analyzer.store.store import Store
from analyzer.store.table import KEPT, rows_of_loops, rows_table

JOINED = tuple(t.name for t in KEPT if t.in_pieces and t.name != "nights")
"""Tables whose pieces are taken as they are; the table of nights and that of groups are made of theirs."""
WORTH = {Status.OK: 2, Status.NOT_ASSESSED: 1}
"""What a status is worth when two records of one loop meet; a failure is worth nothing."""


def fuller(old: Row, new: Row, limits: NightLimits) -> bool:
    """Whether the record that the store has of a loop is worth more than the new one."""
    before, after = (WORTH.get(r["status"], 0) for r in (old, new))
    if before != after:
        return before > after
    return _good_h(old) > limits.fuller_share * _good_h(new) + limits.fuller_h


def _good_h(row: Row) -> float:
    return float(row.get("good_h") or 0.0)


def is_empty(store: Store, night: str, keys: Sequence[str]) -> bool:
    """Whether no loop of a night has a good sample, and none failed, so that there is nothing to keep."""
    table = store.read_parts(night, "nights", keys)
    if table is None:
        return False
    rows = table.select(["status", "good_h"]).to_pylist()
    return all(r["status"] == Status.NOT_ASSESSED and not r["good_h"] for r in rows)


def finish_night(
    store: Store, night: str, order: Sequence[str], config: Config, keys: Sequence[str], replace: bool = False
) -> tuple[str, ...]:
    """Put one night together from its pieces and keep it; nothing where it has none.

    order : the loops of the run, in the order in which they are kept; keys : the chunks whose pieces count; replace :
    forget what the store has of the night. Returns sentences on what was joined, and on loops whose earlier record
    was kept.
    """
    table = store.read_parts(night, "nights", keys)
    if table is None:
        return ()
    fresh = {r["loop"]: finding_of(r) for r in table.to_pylist()}
    other = [] if replace else _rows_held(store, "groups", night, GROUPS)
    gone = {r["group"] for r in other if r["loop"] in fresh}  # a group of any of these loops is told anew
    other = [r for r in other if r["group"] not in gone]
    first = 1 + max((int(r["group"]) for r in other), default=0)
    waves = waves_in(store.read_parts(night, "waves", keys))
    traced, found = traced_night(fresh, waves, config.plant, first)
    links = links_of(moves_in(store.read_parts(night, "moves", keys)), config.plant)
    loops = linked(traced, links, config.plant)
    rows = {loop: night_row(in_lanes(found, config.lanes)) for loop, found in loops.items()}
    old = {} if replace else {r["loop"]: r for r in _rows_held(store, "nights", night, NIGHTS)}
    kept = {loop for loop, row in rows.items() if loop in old and fuller(old[loop], row, config.nights)}
    beside = [loop for loop in old if loop not in rows]
    joined = [old[k] if k in kept else rows[k] for k in order if k in rows] + [old[k] for k in beside]
    mine = [loop for loop in rows if loop not in kept]
    for name in JOINED:  # one at a time: trends are most of a night
        before = None if replace else store.read_if_there(name, night)
        store.write(name, night, _joined_table(before, store.read_parts(night, name, keys), mine))
    groups = [*other, *led_anew(found, loops)]
    store.write("groups", night, rows_table(groups, GROUPS) if groups else None)
    store.write("nights", night, rows_table(joined, NIGHTS))
    store.forget_explained(night, None if replace else mine)
    store.forget_compared()
    return (*settle(store, night, config), *_joining_told(night, rows, old, kept, beside))


def _rows_held(store: Store, table: str, night: str, columns: Sequence[Column]) -> list[dict[str, Any]]:
    """The rows that the store has of a night, none where it has no such table."""
    held = store.read_if_there(table, night)
    return [] if held is None else [{c.name: row.get(c.name) for c in columns} for row in held.to_pylist()]


def _joined_table(before: pa.Table | None, piece: pa.Table | None, mine: Sequence[str]) -> pa.Table | None:
    """Rows of a table of the store, those of some loops taken from a piece."""
    tables = [] if before is None else [rows_of_loops(before, mine, others=True)]
    tables += [] if piece is None else [rows_of_loops(piece, mine)]
    tables = [t for t in tables if t.num_rows] or tables[:1]
    return pa.concat_tables(tables, promote_options="default").unify_dictionaries() if tables else None


def _joining_told(
    night: str, rows: Mapping[str, Row], old: Mapping[str, Row], kept: set[str], beside: Sequence[str]
) -> tuple[str, ...]:
    """What is worth saying of a night that was there already."""
    said = []
    if beside:
        said.append(f"night {night}: {len(beside)} loops of an earlier run are kept beside these")
    for loop in sorted(kept):
        said.append(
            f"{loop}: the store has {_good_h(old[loop]):.1f} good hours of night {night}, this export "
            f"{_good_h(rows[loop]):.1f}; the fuller record is kept (--replace takes this one)"
        )
    return tuple(said)
