"""Combination of a night: the plant-wide pass over its pieces, lanes, then one table, joined with that of the store.

A second export of the same night adds its loops. Of two records of a loop the fuller one is kept, and of equal ones
the newer, so that a repeated night replaces the first and an empty one never replaces a good one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from itertools import chain
from tempfile import TemporaryFile
from typing import Any

import pyarrow as pa

from analyzer.belief.nights import update_beliefs
from analyzer.columns import GROUPS, NIGHTS, Column, Row, names
from analyzer.config import Config, NightLimits
from analyzer.lanes.lanes import in_lanes
from analyzer.loop.decisions import Finding, Status
from analyzer.plantwide import cascade
from analyzer.plantwide import night as plantwide
from analyzer.plantwide.cascade import linked, reassign_sources
from analyzer.plantwide.night import traced_night
from analyzer.plantwide.oscillation_lines import oscillations_in
from analyzer.plantwide.structure import links_of, moves_in
from analyzer.store.rows import TYPED, finding_of, night_row
from analyzer.store.store import Store
from analyzer.store.table import KEPT, rows_of_loops, rows_table

JOINED = tuple(t.name for t in KEPT if t.in_pieces and t.name != "nights")
"""Tables whose pieces are used unchanged; the tables of nights and groups are computed from them."""
PRESENCE_COLUMNS = ("status", "good_h")
"""Columns that show whether there is anything to keep of a night."""
PLANT_WIDE = (*TYPED, *plantwide.READ, *cascade.READ, "good_h")
"""Columns of a loop for the plant-wide pass, and for comparing records."""
OF_ITS_OWN = tuple(name for name in names(NIGHTS) if name not in TYPED)
"""Columns that only a worker computes."""
CHUNKS_AT_ONCE, LOOPS_AT_ONCE = 8, 256
"""Part of the combined tables in memory at a time."""
WORTH = {Status.OK: 2, Status.NOT_ASSESSED: 1}
"""Rank of a status when two records of one loop are compared; a failure ranks lowest."""


def fuller(old: Row, new: Row, limits: NightLimits) -> bool:
    """Whether the loop's record in the store is better than the new one."""
    before, after = (WORTH.get(r["status"], 0) for r in (old, new))
    if before != after:
        return before > after
    return _good_h(old) > limits.fuller_share * _good_h(new) + limits.fuller_h


def _good_h(row: Row) -> float:
    return float(row.get("good_h") or 0.0)


def is_empty(rows: Sequence[Row]) -> bool:
    """Whether no loop of a night has a good sample or failed, so that there is nothing to keep."""
    return all(r["status"] == Status.NOT_ASSESSED and not r["good_h"] for r in rows)


def finish_night(
    store: Store, night: str, order: Sequence[str], config: Config, keys: Sequence[str], replace: bool = False
) -> tuple[str, ...]:
    """Combine one night from its pieces and store it; nothing without pieces.

    order : the loops of the run, in stored order; keys : the chunks whose pieces count; replace : delete what the
    store has of the night. Returns sentences on what was joined, and on loops whose earlier record was kept.
    """
    pieces = Pieces(store, night, keys)
    fresh = {r["loop"]: finding_of(r) for t in pieces.tables("nights", PLANT_WIDE) for r in t.to_pylist()}
    if not fresh:
        return ()
    other = [] if replace else _rows_held(store, "groups", night, GROUPS)
    gone = {r["group"] for r in other if r["loop"] in fresh}  # these loops' groups are computed again
    other = [r for r in other if r["group"] not in gone]
    first = 1 + max((int(r["group"]) for r in other), default=0)
    with TemporaryFile() as lines:
        oscillations = oscillations_in(pieces.tables("waves"), lines)
        traced, found = traced_night(fresh, oscillations, config.plant, first)
    links = links_of([m for t in pieces.tables("moves") for m in moves_in(t)], config.plant)
    loops = linked(traced, links, config.plant)
    old = {} if replace else _worth_held(store, night)
    fuller_loops = {
        loop for loop, own in loops.items() if loop in old and fuller(old[loop], _worth(own), config.nights)
    }
    others = [loop for loop in old if loop not in loops]
    new = [loop for loop in loops if loop not in fuller_loops]
    for name in JOINED:  # trends are most of a night's data
        before = () if replace else store.parts_if_there(name, night)
        store.write(name, night, _joined_tables(before, pieces.tables(name), new))
    groups = [*other, *reassign_sources(found, loops)]
    store.write("groups", night, rows_table(groups, GROUPS) if groups else None)
    joined = [*(k for k in order if k in loops), *others]
    store.write("nights", night, _joined_rows(pieces, joined, {k: loops[k] for k in new}, config))
    store.forget_explained(night, None if replace else new)
    store.forget_compared()
    return (*update_beliefs(store, night, config), *_joining_notes(night, loops, old, fuller_loops, others))


class Pieces:
    """The pieces of a night, with those of a few chunks in memory."""

    def __init__(self, store: Store, night: str, keys: Sequence[str]) -> None:
        self.store, self.night = store, night
        in_order = sorted(keys, key=lambda key: key.partition("-")[2])
        self._few = [in_order[k : k + CHUNKS_AT_ONCE] for k in range(0, len(keys), CHUNKS_AT_ONCE)]
        self._rows_of = lru_cache(maxsize=CHUNKS_AT_ONCE)(self._rows)

    def tables(self, table: str, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """One table in parts."""
        found = (self.store.read_parts(self.night, table, few, columns) for few in self._few)
        return (piece for piece in found if piece is not None)

    @cached_property
    def _place(self) -> dict[str, int]:
        """The few chunks with each loop."""
        names = enumerate(self.tables("nights", ["loop"]))
        return {loop: k for k, table in names for loop in table.column(0).to_pylist()}

    def _rows(self, few: int) -> dict[str, Row]:
        table = self.store.read_parts(self.night, "nights", self._few[few], ("loop", *OF_ITS_OWN))
        rows = [] if table is None else table.to_pylist()
        return {r.pop("loop"): r for r in rows}

    def known(self, loop: str) -> Row:
        """Columns of a loop that no plant-wide pass changes."""
        return self._rows_of(self._place[loop])[loop]


def _joined_rows(
    pieces: Pieces, order: Sequence[str], judged: Mapping[str, Finding], config: Config
) -> Iterator[pa.Table]:
    """The table of a night in parts: judged rows of loops, and rows of others from the store."""
    for k in range(0, len(order), LOOPS_AT_ONCE):
        part = order[k : k + LOOPS_AT_ONCE]
        old = _rows_held(pieces.store, "nights", pieces.night, NIGHTS, set(part) - judged.keys())
        rows = {r["loop"]: r for r in old}
        for loop in judged.keys() & set(part):
            whole = {**pieces.known(loop), **judged[loop].known}
            rows[loop] = night_row(in_lanes(dataclasses.replace(judged[loop], known=whole), config.lanes))
        yield rows_table([rows[loop] for loop in part], NIGHTS)


def _worth(own: Finding) -> Row:
    """Figures of a finding for the comparison with another record of its loop."""
    return {"loop": own.loop, "status": own.status, "good_h": own.known.get("good_h")}


def _worth_held(store: Store, night: str) -> dict[str, Row]:
    """The same for the loops of a night in the store."""
    if not store.file("nights", night).exists():
        return {}
    return {r["loop"]: r for r in store.own_rows("nights", night, ("loop", "status", "good_h"))}


def _rows_held(
    store: Store, table: str, night: str, columns: Sequence[Column], loops: Collection[str] | None = None
) -> list[dict[str, Any]]:
    """Rows of some loops of a night in the store, or of all; none if it has no such table."""
    if loops == set() or not store.file(table, night).exists():
        return []
    return store.own_rows(table, night, names(columns), loops)


def _joined_tables(
    before: Iterable[pa.Table], pieces: Iterable[pa.Table], loops: Sequence[str]
) -> Iterator[pa.Table]:
    """Rows of a table of the store in parts, with those of some loops taken from pieces; all of one schema."""
    parts = chain(
        (rows_of_loops(t, loops, others=True) for t in before), (rows_of_loops(t, loops) for t in pieces)
    )
    filled = (t.unify_dictionaries() for t in parts if t.num_rows)
    first = next(filled, None)
    if first is None:
        return
    second = next(filled, first.slice(0, 0))  # if those of the store are of an earlier version
    schema = pa.unify_schemas([first.schema, second.schema], promote_options="default")
    for part in chain((first, second), filled):
        yield pa.concat_tables([schema.empty_table(), part], promote_options="default").unify_dictionaries()


def _joining_notes(
    night: str,
    loops: Mapping[str, Finding],
    old: Mapping[str, Row],
    fuller_loops: set[str],
    others: Sequence[str],
) -> tuple[str, ...]:
    """Notes on a night that already existed."""
    notes = []
    if others:
        notes.append(f"night {night}: {len(others)} loops of an earlier run are also kept")
    for loop in sorted(fuller_loops):
        notes.append(
            f"{loop}: the store has {_good_h(old[loop]):.1f} good hours of night {night}, this export "
            f"{_good_h(loops[loop].known):.1f}; the fuller record is kept (--replace takes this one)"
        )
    return tuple(notes)
