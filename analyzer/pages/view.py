"""One night as the pages see it: its rows, those of the night before, and words that several pages share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from analyzer.lanes.figures import FIGURE
from analyzer.loop.decisions import Cause, Status, counts
from analyzer.pages.rank import worst_first
from analyzer.pages.reading import Thinned, read_nights, read_trends
from analyzer.store import notes
from analyzer.store.notes import Note, is_hidden, last
from analyzer.store.store import Store
from analyzer.words.units import row_settings
from reports.pages import Cell
from reports.texts import slug

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
    *("kp_new", "ti_new", "action", "reason", "form", "gain_unit", "ti_unit", "pv_unit", "op_unit"),
    *("lanes", "loss", "close_first_s", "close_last_s", "group", "timezone", "backlash_pct", "stickband_pct"),
    *("advice", "due", "settings_changed", "judged_since_s", "percent_of", *FIGURE.values()),
)
REMEMBERED = ("loop", "status", "oscillation_significance", "oscillating_pct", "cause", "lanes")
"""What is read of nights before the last one."""
MEMORY = 14
"""Nights before the last one that tell what is usual for a loop; ours: two weeks."""


@dataclass(frozen=True, slots=True)
class Night:
    """The rows of a night, the worst first, those of the night before by loop, and trends of the worst.

    earlier : rows of the nights before that one by loop, oldest first, with what is remembered of them.
    """

    name: str
    rows: tuple[Row, ...]
    before: Mapping[str, Row]
    before_name: str
    worst: tuple[Row, ...]
    trends: Mapping[str, Thinned] = field(default_factory=dict)
    notes: Mapping[str, tuple[Note, ...]] = field(default_factory=dict)
    earlier: Mapping[str, Sequence[Row]] = field(default_factory=dict)

    @property
    def zone(self) -> str:
        """The plant's time zone."""
        return next((r["timezone"] for r in self.rows if r["timezone"]), "UTC")

    @property
    def hidden(self) -> frozenset[str]:
        """Loops that a note keeps out of the list."""
        return frozenset(loop for loop in self.notes if is_hidden(last(self.notes, loop), self.name))

    def note(self, loop: str) -> str:
        """The newest note of a loop, '' where there is none."""
        found = last(self.notes, loop)
        return "" if found is None else found.said(self.zone)

    @property
    def paged(self) -> frozenset[str]:
        """Loops that have a page of their own."""
        return frozenset(r["loop"] for r in self.worst)


def oscillates(row: Row | None) -> bool:
    """Whether a loop counts as oscillating."""
    return row is not None and counts(row["oscillating_pct"])


def needs_a_look(row: Row) -> bool:
    """Whether a loop oscillates, has a valve at fault all the same, or stands in another lane."""
    if row["status"] == Status.FAILED:
        return False
    return bool(row["lanes"]) or (
        row["status"] == Status.OK and (oscillates(row) or row["cause"] not in (Cause.NONE, None, ""))
    )


def followers_under(rows: Sequence[Row]) -> list[Row]:
    """Rows in their order, each loop that follows another one right under it."""
    present = {r["loop"] for r in rows}
    under: dict[str, list[Row]] = {}
    for row in rows:
        if row["source_loop"] in present:
            under.setdefault(row["source_loop"], []).append(row)
    tops = [r for r in rows if r["source_loop"] not in present]
    out: list[Row] = []
    for row in tops:
        out += [row, *under.pop(row["loop"], [])]
    return out + [r for rest in under.values() for r in rest]


def read_night(store: Store, name: str | None, top: int, drawn: bool = True) -> Night:
    """What the morning page of a night needs, with trends of the worst loops if they are to be drawn."""
    nights = store.nights()
    night = name or store.require()
    store.read("nights", night, ["loop"])
    earlier = [n for n in nights if n < night]
    rows = worst_first(read_nights(store, [night], COLUMNS))
    before = {r["loop"]: r for r in read_nights(store, earlier[-1:], COLUMNS)}
    remembered: dict[str, list[Row]] = {}
    for row in read_nights(store, earlier[-1 - MEMORY : -1], REMEMBERED):
        remembered.setdefault(row["loop"], []).append(row)
    known = notes.read(store.path)
    looked = [r for r in rows if needs_a_look(r) and not is_hidden(last(known, r["loop"]), night)]
    worst = tuple(followers_under(looked)[:top])
    trends = read_trends(store, {r["loop"] for r in worst}, [night]) if drawn else {}
    return Night(night, tuple(rows), before, earlier[-1] if earlier else "", worst, trends, known, remembered)


def linked(night: Night, loop: str) -> Cell:
    """The loop's name, leading to its page where there is one."""
    return Cell(loop, kind="strong", href=f"{slug(loop)}.html" if loop in night.paged else "")


def proposal(row: Row) -> str:
    """The action, with the settings to type in where there are any."""
    if row["kp_new"] is None and row["ti_new"] is None:
        return row["action"] or ""
    return f"{row['action']}: {row_settings(row, 'kp_new', 'ti_new')}"
