"""The groups of a night for list and pages: the source of each, the action there, and the improvement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from analyzer.columns import GROUPS, Row, names
from analyzer.loop.decisions import GroupRole
from analyzer.store.store import Store
from analyzer.store.table import no_column

OF_LOOPS = (
    *("loop", "cause", "valve_fault", "action", "kp_new", "ti_new", "kp", "ti", "form", "gain_unit"),
    *("ti_unit", "pv_unit", "op_unit", "description", "area", "master", "spectrum", "start_s"),
    "average_absolute_error_pct",
)
"""Columns of the night's rows that are read."""
ALWAYS = ("loop", "group", "role", "source_pct", "coherence", "group_period_s")
"""Columns of every table of groups."""


@dataclass(frozen=True, slots=True)
class GroupView:
    """One group: its number, its rows (the most likely source first), and the night's rows of its loops by name."""

    number: str
    rows: tuple[Row, ...]
    loops: Mapping[str, Row]

    @property
    def period_s(self) -> float:
        """Common period [s]."""
        return float(self.rows[0]["group_period_s"])

    @property
    def source(self) -> Row | None:
        """The row of the source; None if it is not clear."""
        first = self.rows[0]
        return first if first["role"] == GroupRole.SOURCE else None

    @property
    def candidates(self) -> tuple[Row, ...]:
        """The rows of the source and of the other candidates."""
        wanted = (GroupRole.SOURCE, GroupRole.CANDIDATE)
        return tuple(r for r in self.rows if r["role"] in wanted)

    @property
    def unseen_pct(self) -> float:
        """Probability that none of the loops is the source [%]."""
        return max(100.0 - sum(r["source_pct"] for r in self.rows), 0.0)

    @property
    def gain_pct(self) -> float:
        """Total average absolute error of the other loops that would disappear [% of span]."""
        return sum(r["gain_pct"] or 0.0 for r in self.rows if r is not self.source)

    @property
    def action(self) -> str:
        """The action at the source; empty if it is not clear."""
        source = self.source
        if source is None:
            return ""
        return str(self.loops[source["loop"]]["action"] or "")


def read_groups(store: Store, night: str) -> list[GroupView]:
    """The groups of a night, highest loss first; empty if the store has no such table."""
    if not store.file("groups", night).exists():
        return []
    rows = store.rows("groups", night, names(GROUPS))
    wanted = {r["loop"] for r in rows}
    loops = {r["loop"]: r for r in store.rows("nights", night, OF_LOOPS) if r["loop"] in wanted}
    by_number: dict[str, list[Row]] = {}
    for row in rows:
        if row["loop"] in loops:  # a manually combined store may lack some
            by_number.setdefault(row["group"], []).append(row)
    lacking = set(ALWAYS) - set(store.columns("groups", night))
    if by_number and lacking:
        raise no_column(store.file("groups", night), min(lacking))
    for own in by_number.values():
        own.sort(key=lambda r: (-r["source_pct"], -(r["wave_amplitude_pct"] or 0.0), r["loop"]))
    found = [GroupView(number, tuple(own), loops) for number, own in by_number.items()]
    return sorted(found, key=lambda g: (-g.gain_pct, int(g.number)))
