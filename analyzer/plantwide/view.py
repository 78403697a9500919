"""The groups of a night as the list and the pages show them: where each starts, what to do there, what that gains."""

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
"""What is read of the rows of the night."""
ALWAYS = ("loop", "group", "role", "source_pct", "coherence", "group_period_s")
"""Columns that every table of groups has."""


@dataclass(frozen=True, slots=True)
class GroupView:
    """One group: its number, its rows (the likeliest source first), and the night's rows of its loops by name."""

    number: str
    rows: tuple[Row, ...]
    loops: Mapping[str, Row]

    @property
    def period_s(self) -> float:
        """Period that is shared [s]."""
        return float(self.rows[0]["group_period_s"])

    @property
    def source(self) -> Row | None:
        """The row of the source; None where it is not clear."""
        first = self.rows[0]
        return first if first["role"] == GroupRole.SOURCE else None

    @property
    def candidates(self) -> tuple[Row, ...]:
        """The rows of the source and of what else it may be."""
        wanted = (GroupRole.SOURCE, GroupRole.CANDIDATE)
        return tuple(r for r in self.rows if r["role"] in wanted)

    @property
    def unseen_pct(self) -> float:
        """Probability that it starts at none of the loops [%]."""
        return max(100.0 - sum(r["source_pct"] for r in self.rows), 0.0)

    @property
    def gain_pct(self) -> float:
        """Average absolute error that would go in the other loops together [% of span]."""
        return sum(r["gain_pct"] or 0.0 for r in self.rows if r is not self.source)

    @property
    def action(self) -> str:
        """What to do at the source; empty where it is not clear."""
        source = self.source
        if source is None:
            return ""
        return str(self.loops[source["loop"]]["action"] or "")


def read_groups(store: Store, night: str) -> list[GroupView]:
    """The groups of a night, those that cost most first; none where the store has no such table."""
    if not store.file("groups", night).exists():
        return []
    rows = store.rows("groups", night, names(GROUPS))
    wanted = {r["loop"] for r in rows}
    loops = {r["loop"]: r for r in store.rows("nights", night, OF_LOOPS) if r["loop"] in wanted}
    by_number: dict[str, list[Row]] = {}
    for row in rows:
        if row["loop"] in loops:  # a store that was put together by hand may lack some
            by_number.setdefault(row["group"], []).append(row)
    lacking = set(ALWAYS) - set(store.columns("groups", night))
    if by_number and lacking:
        raise no_column(store.file("groups", night), min(lacking))
    for own in by_number.values():
        own.sort(key=lambda r: (-r["source_pct"], -(r["wave_amplitude_pct"] or 0.0), r["loop"]))
    found = [GroupView(number, tuple(own), loops) for number, own in by_number.items()]
    return sorted(found, key=lambda g: (-g.gain_pct, int(g.number)))
