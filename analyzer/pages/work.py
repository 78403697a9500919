"""The work list: what people have noted of loops, how far it has come, and what the nights since say of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.history.plant_clock import stamp
from analyzer.limits import PAGES
from analyzer.loop.decisions import Status
from analyzer.pages.reading import ShownNight, by_loop, link_to, oscillates, read_nights
from analyzer.pages.words import ALL_LOOPS, Row, cause_cell, cells, page_table, with_noun
from analyzer.store.notes import FINISHED, Work, work_on
from analyzer.store.store import Store
from reports.pages import Cell, Page, Section, Text, Tiles, section, there

NAME = "work"
FIGURES = {
    "average_absolute_error_pct": "average absolute error",
    "valve_travel_pct_per_h": "valve travel",
    "loss": "loss",
}
"""What is won, and how it is called."""
READ = ("loop", "status", "oscillating_pct", *FIGURES)


@dataclass(frozen=True, slots=True)
class Sides:
    """A loop's nights before and since a piece of work."""

    before: Sequence[Row]
    since: Sequence[Row]

    def means(self, column: str) -> tuple[float, float] | None:
        """Mean figure before and since; None where a side does not know it."""
        known = [[r[column] for r in side if r[column] is not None] for side in (self.before, self.since)]
        return (float(np.mean(known[0])), float(np.mean(known[1]))) if all(known) else None


def sides(rows: Sequence[Row], day: str) -> Sides:
    """A loop's assessed nights, oldest first, parted by the day of the work, which is neither."""
    told = [r for r in rows if r["status"] == Status.OK]
    before = [r for r in told if r["night"] < day][-PAGES.before_work :]
    return Sides(before, [r for r in told if r["night"] > day])


def said_since(work: Work, both: Sides) -> str:
    """What the nights since a piece of work say of it; nothing of work that is not done."""
    if work.state not in FINISHED:
        return ""
    if not both.since:
        return "no night since"
    still, was = (sum(oscillates(r) for r in side) for side in (both.since, both.before))
    text = with_noun(len(both.since), "night")
    if was and not still:
        text += ": cured, oscillates in none"
    elif was or still:
        text += f": oscillates in {still}, before in {was} of {len(both.before)}"
    changes = [(both.means(column), name) for column, name in FIGURES.items() if column != "loss"]
    return ", ".join([text, *(f"{name} {_change(*m)}" for m, name in changes if m is not None and m[0] > 0)])


def _change(before: float, since: float) -> str:
    return f"{100.0 * (since / before - 1.0):+.0f} %".replace("-", "\u2212")


def _of_work(night: ShownNight, row: Row, work: Work, both: Sides) -> dict[str, Cell]:
    """What is told of a piece of work, and what the nights since say of it."""
    late = bool(work.due) and work.due < night.name and work.state not in FINISHED
    return {
        "loop": link_to(night, row["loop"]),
        "state": Cell(work.state, kind="better" if work.state in FINISHED else ""),
        "owner": Cell(work.owner),
        "due": Cell(work.due, kind="worse" if late else ""),
        "note": Cell(f"{work.note.text} ({stamp(work.note.time_s, night.zone)[:10]})"),
        "cause": cause_cell(row["cause"]),
        "since": Cell(said_since(work, both)),
    }


def won(night: ShownNight, works: Mapping[str, Work], history: Mapping[str, Sequence[Row]]) -> Tiles | None:
    """What work that was finished since the start of the month brought; None where none was."""
    month = night.name[:7]
    done = [
        sides(history.get(loop, ()), day)
        for loop, w in works.items()
        if w.state in FINISHED and (day := stamp(w.since_s, night.zone)[:10])[:7] == month
    ]
    items = []
    for column, name in FIGURES.items():
        known = [m for m in (x.means(column) for x in done) if m is not None]
        before, since = (sum(m[k] for m in known) for k in (0, 1))
        if before > 0.0:
            tone = "better" if since < before else "worse"
            items.append((_change(before, since), f"{name} of {with_noun(len(known), 'loop')}", tone))
    return Tiles(tuple(items)) if items else None


def work_page(store: Store, night: ShownNight) -> Page:
    """The work list as it stands after a night."""
    works = {loop: work_on(notes) for loop, notes in night.notes.items() if notes}
    names = [n for n in store.nights() if n <= night.name][-PAGES.work_nights :]
    history = by_loop(read_nights(store, names, READ, works))
    rows = {r["loop"]: r for r in night.rows if r["loop"] in works}
    told = []  # what is not finished first, by its date; then what was reached last
    order = {k: (w.state in FINISHED, w.due or "9999", -w.since_s, k) for k, w in works.items()}
    for k in sorted(rows, key=lambda loop: order[loop]):
        both = sides(history.get(k, ()), stamp(works[k].since_s, night.zone)[:10])
        told.append(cells(rows[k], "work", **_of_work(night, rows[k], works[k], both)))
    note = f"Since: nights after the day of the note, beside the {PAGES.before_work} before it."
    empty = Text(('Nothing is noted: triage note STORE LOOP "..." --state open --due DATE.',))
    sections = there(
        section(f"Won since {night.name[:7]}-01", won(night, works, history)),
        Section("Work", (page_table("work", told, note=note) if told else empty,)),
    )
    links = (ALL_LOOPS, ("As CSV", f"csv/{NAME}-work-list.csv"))
    waiting = with_noun(sum(works[k].state not in FINISHED for k in rows), "loop")
    return Page(NAME, "Work list", f"{waiting} waiting after the night of {night.name}", sections, links)
