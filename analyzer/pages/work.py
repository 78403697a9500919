"""The hand-over sheet for maintenance, and the work list, with the state of work in users' notes and the results of
the nights since."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.history.plant_clock import stamp
from analyzer.loop.decisions import Action, Cause, Fault, Status
from analyzer.pages.reading import ShownNight, by_loop, oscillates, read_nights
from analyzer.pages.words import ALL_LOOPS, CellContent, Row, cause_cell, with_noun
from analyzer.store.notes import FINISHED, Work, work_on
from analyzer.store.store import Store
from analyzer.words.belief import wear_text
from analyzer.words.orders import fault_width, stroke
from reports.pages import Cell, Page, Section, Table, Text, Tiles, section, without_none

TRAVELLED = 20  # Valves that the page of maintenance lists for their travel alone [loops]
WORK_NIGHTS = 62  # Nights that the list of work looks at [nights]: a month, and the month before it
BEFORE_WORK = 7  # Nights before a piece of work that are compared with those since [nights]: a week

MAINTENANCE, WORK = "maintenance", "work"
"""Names of the two pages."""
FIGURES = {
    "average_absolute_error_pct": "average absolute error",
    "valve_travel_pct_per_h": "valve travel",
    "loss": "loss",
}
"""Improvements, and their names."""
READ = ("loop", "status", "oscillating_pct", *FIGURES)


def valve_test(row: Row) -> str:
    """The stroke test of a faulty valve in a few words; its order gives the procedure."""
    step, answer = stroke(row)
    return f"steps of {step} %: {answer}" if answer else "steps of 5 %: PV, or the stem, does not respond"


def wearing(night: ShownNight) -> Table:
    """Valves with growing backlash or stickband, fastest first: for the next shutdown."""
    rows = [r for r in night.rows if r["wear_pct_per_month"] is not None]
    rows.sort(key=lambda r: -r["wear_pct_per_month"])
    return night.table("wear", rows, lambda row: {"forecast": wear_text(row)})


def faulty(night: ShownNight) -> Table:
    """Faulty valves, by a cycle or by all nights: those to be repaired first, then by width."""
    assessed = [r for r in night.rows if r["status"] == Status.OK]
    faults = (Fault.BACKLASH, Fault.STICTION)
    rows = [r for r in assessed if r["cause"] == Cause.VALVE or r["valve_fault"] in faults]
    rows.sort(key=lambda r: (r["action"] != Action.REPAIR_VALVE, -(fault_width(r) or 0.0)))
    return night.table("valves", rows, _of_valve)


def _of_valve(row: Row) -> dict[str, CellContent]:
    """Columns of a valve that are not in the store, and space for findings."""
    fault = "" if row["valve_fault"] in (None, Fault.NONE) else row["valve_fault"]
    known = {"width": fault_width(row), "test": valve_test(row), "found": ""}
    return {"valve_fault": Cell(fault, kind="valve"), **known}


def worn(night: ShownNight) -> Table:
    """The valves with the most travel."""
    rows = [r for r in night.rows if r["valve_travel_pct_per_h"] is not None]
    rows.sort(key=lambda r: -r["valve_travel_pct_per_h"])
    return night.table("travel", rows[:TRAVELLED])


def maintenance_page(night: ShownNight) -> Page:
    """The sheet of a night."""
    first, growing = faulty(night), wearing(night)
    sections = without_none(
        Section(f"Valves at fault ({len(first.rows)})", (first,)),
        section(f"Valves that wear ({len(growing.rows)})", growing if growing.rows else None),
        Section("Valves that travel most", (worn(night),)),
    )
    valves = with_noun(len(first.rows), "valve")
    subtitle = f"{valves} at fault in the night of {night.name}, for the valve shop."
    return Page(MAINTENANCE, "Hand-over to maintenance", subtitle, sections, (ALL_LOOPS,))


@dataclass(frozen=True, slots=True)
class Sides:
    """A loop's nights before and after a piece of work."""

    before: Sequence[Row]
    since: Sequence[Row]

    def means(self, column: str) -> tuple[float, float] | None:
        """Mean figure before and after; None if it is unknown on one side."""
        known = [[r[column] for r in side if r[column] is not None] for side in (self.before, self.since)]
        return (float(np.mean(known[0])), float(np.mean(known[1]))) if all(known) else None


def sides(rows: Sequence[Row], day: str) -> Sides:
    """A loop's assessed nights, oldest first, split by the day of the work, which is in neither part."""
    assessed = [r for r in rows if r["status"] == Status.OK]
    before = [r for r in assessed if r["night"] < day][-BEFORE_WORK:]
    return Sides(before, [r for r in assessed if r["night"] > day])


def result_since(work: Work, both: Sides) -> str:
    """Result of a piece of work from the nights after it; empty for unfinished work."""
    if work.state not in FINISHED:
        return ""
    if not both.since:
        return "no night since"
    still, was = (sum(oscillates(r) for r in side) for side in (both.since, both.before))
    text = with_noun(len(both.since), "night")
    if was and not still:
        text += ": no longer oscillates"
    elif was or still:
        text += f": oscillates in {still}, before in {was} of {len(both.before)}"
    changes = [(both.means(column), name) for column, name in FIGURES.items() if column != "loss"]
    return ", ".join([text, *(f"{name} {_change(*m)}" for m, name in changes if m is not None and m[0] > 0)])


def _change(before: float, since: float) -> str:
    return f"{100.0 * (since / before - 1.0):+.0f} %".replace("-", "\u2212")


def improvements(night: ShownNight, works: Mapping[str, Work], parted: Mapping[str, Sides]) -> Tiles | None:
    """Improvements by work finished since the start of the month; None without any."""
    month = night.name[:7]
    finished = [loop for loop, w in works.items() if w.state in FINISHED]
    done = [parted[loop] for loop in finished if stamp(works[loop].since_s, night.zone)[:7] == month]
    items = []
    for column, name in FIGURES.items():
        known = [m for m in (x.means(column) for x in done) if m is not None]
        before, since = (sum(m[k] for m in known) for k in (0, 1))
        if before > 0.0:
            tone = "better" if since < before else "worse"
            items.append((_change(before, since), f"{name} of {with_noun(len(known), 'loop')}", tone))
    return Tiles(tuple(items)) if items else None


def work_page(store: Store, night: ShownNight) -> Page:
    """The work list after a night."""
    works = {loop: work_on(notes) for loop, notes in night.notes.items() if notes}
    names = [n for n in store.nights() if n <= night.name][-WORK_NIGHTS:]
    history = by_loop(read_nights(store, names, READ, works))
    parted = {k: sides(history.get(k, ()), stamp(w.since_s, night.zone)[:10]) for k, w in works.items()}

    def own(row: Row) -> dict[str, CellContent]:
        """A piece of work in the list, and its result from the nights after it."""
        work, finished = works[row["loop"]], works[row["loop"]].state in FINISHED
        late = bool(work.due) and work.due < night.name and not finished
        return {
            "state": Cell(work.state, kind="better" if finished else ""),
            "owner": work.owner,
            "due": Cell(work.due, kind="worse" if late else ""),
            "note": f"{work.note.text} ({stamp(work.note.time_s, night.zone)[:10]})",
            "cause": cause_cell(row["cause"]),
            "since": result_since(work, parted[row["loop"]]),
        }

    def urgency(row: Row) -> tuple[bool, str, float, str]:
        """Sort key: unfinished work first, by its date; then the most recently finished."""
        work = works[row["loop"]]
        return work.state in FINISHED, work.due or "9999", -work.since_s, row["loop"]

    rows = sorted((r for r in night.rows if r["loop"] in works), key=urgency)
    note = f"Since: nights after the day of the note, compared with the {BEFORE_WORK} nights before it."
    empty = Text(('Nothing is noted: triage note STORE LOOP "..." --state open --due DATE.',))
    sections = without_none(
        section(f"Improvement since {night.name[:7]}-01", improvements(night, works, parted)),
        Section("Work", (night.table("work", rows, own, note=note) if rows else empty,)),
    )
    links = (ALL_LOOPS, ("As CSV", f"csv/{WORK}-work-list.csv"))
    waiting = with_noun(sum(works[r["loop"]].state not in FINISHED for r in rows), "loop")
    return Page(WORK, "Work list", f"{waiting} waiting after the night of {night.name}", sections, links)
