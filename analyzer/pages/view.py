"""One night as the pages see it: its rows, those of the night before, and words that several pages share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from analyzer.decisions import Cause, Status, counts
from analyzer.pages.reading import Thinned, read_nights, read_trends
from analyzer.store import Store
from analyzer.units import row_settings
from reports.names import slug
from reports.pages import Cell

Row = Mapping[str, Any]
COLUMNS = (
    *("loop", "type", "area", "description", "importance", "status", "oscillation_significance"),
    *(
        "oscillating_pct",
        "osc_valve_pct",
        "osc_tuning_pct",
        "osc_load_pct",
        "cause",
        "valve_fault",
        "period_s",
    ),
    *("source_loop", "average_absolute_error_pct", "valve_travel_pct_per_h", "variability_pct", "kp", "ti"),
    *("kp_new", "ti_new", "action", "reason", "form", "gain_unit", "ti_unit", "pv_unit"),
)


@dataclass(frozen=True, slots=True)
class Night:
    """The rows of a night, the worst first, those of the night before by loop, and trends of the worst."""

    name: str
    rows: tuple[Row, ...]
    before: Mapping[str, Row]
    before_name: str
    worst: tuple[Row, ...]
    trends: Mapping[str, Thinned] = field(default_factory=dict)

    @property
    def paged(self) -> frozenset[str]:
        """Loops that have a page of their own."""
        return frozenset(r["loop"] for r in self.worst)


def oscillates(row: Row | None) -> bool:
    """Whether a loop counts as oscillating."""
    return row is not None and counts(row["oscillating_pct"])


def needs_a_look(row: Row) -> bool:
    """Whether a loop oscillates or has a valve at fault all the same."""
    return row["status"] == Status.OK and (oscillates(row) or row["cause"] not in (Cause.NONE, None, ""))


def _worse_first(row: Row) -> tuple[bool, float, str]:
    return (not needs_a_look(row), -(row["oscillation_significance"] or 0.0), row["loop"])


def read_night(store: Store, name: str | None, top: int) -> Night:
    """What the morning page of a night needs."""
    known = store.nights()
    night = name or store.require()
    store.read("nights", night, ["loop"])
    earlier = [n for n in known if n < night]
    rows = sorted(read_nights(store, [night], COLUMNS), key=_worse_first)
    before = {r["loop"]: r for r in read_nights(store, earlier[-1:], COLUMNS)}
    worst = tuple(r for r in rows if needs_a_look(r))[:top]
    trends = read_trends(store, {r["loop"] for r in worst}, [night])
    return Night(night, tuple(rows), before, earlier[-1] if earlier else "", worst, trends)


def linked(night: Night, loop: str) -> Cell:
    """The loop's name, leading to its page where there is one."""
    return Cell(loop, kind="strong", href=f"{slug(loop)}.html" if loop in night.paged else "")


def proposal(row: Row) -> str:
    """The action, with the settings to type in where there are any."""
    if row["kp_new"] is None and row["ti_new"] is None:
        return row["action"] or ""
    return f"{row['action']}: {row_settings(row, 'kp_new', 'ti_new')}"
