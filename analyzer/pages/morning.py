"""The morning page: which loops to touch, what is new, what got better, what was not assessed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from analyzer.columns import BY_NAME
from analyzer.loop.cost import MARK, OF_RECORDED, SIGNIFICANCE, cost_column, mark
from analyzer.loop.decisions import CAUSES, Cause, Status
from analyzer.pages import maintenance, words
from analyzer.pages.groups import morning_table
from analyzer.pages.loop_pictures import close_span, sparkline
from analyzer.pages.plant import NightSum, area_table, plant_history, plant_map
from analyzer.pages.reading import BESIDE, ShownNight, link_to, needs_a_look, oscillates
from analyzer.pages.summary import first_things, since
from analyzer.plantwide.view import GroupView
from analyzer.words.units import changed_settings, row_settings
from reports.pages import Cell, Listing, Page, Section, Table, Tiles, section, there

FOLLOWER = "\u2514 "
"""Before the name of a loop that stands under the one it follows."""
ALL_SHARES = ("oscillating_pct", "osc_valve_pct", "osc_tuning_pct", "osc_load_pct")
ALL_COSTS = (SIGNIFICANCE, "average_absolute_error_pct", "valve_travel_pct_per_h", "variability_pct")
LINKS = (
    ("Hand-over to maintenance", f"{maintenance.NAME}.html"),
    ("Work list", "work.html"),
    ("Loops side by side", f"{BESIDE}.html"),
    ("All loops as CSV", "csv/index-ranking.csv"),
)


def _of_worst(night: ShownNight, row: words.Row, follows: bool, by: str) -> dict[str, Cell]:
    """What a loop to touch is shown with and the store does not hold."""
    name, trend = link_to(night, row["loop"]), night.trends.get(row["loop"])
    drawn = None if trend is None else sparkline(trend, close_span(row, trend))
    changed = row["kp_new"] is not None or row["ti_new"] is not None
    return {
        "loop": replace(name, text=FOLLOWER + name.text) if follows else name,
        "trend": Cell("", figure=drawn),
        by: words.marked_cell(row, by),
        "cause": words.cause_cell(row["cause"]),
        "settings": Cell(changed_settings(row) if changed else row_settings(row)),
        "note": Cell(night.note(row["loop"])),
    }


def _what_marks(rows: Sequence[words.Row], *columns: str) -> str:
    """What the mark behind figures means; '' where none of some columns has one."""
    return f"{MARK} {OF_RECORDED}." if any(mark(row, name) for row in rows for name in columns) else ""


def worst_table(night: ShownNight) -> Table:
    """The loops to touch, the worst first, followers under the loop that moves them."""
    here, by = {r["loop"] for r in night.worst}, cost_column(night.rows)
    noted = any(night.note(r["loop"]) for r in night.worst)
    declared = words.page_columns("worst") if noted else words.page_columns("worst")[:-1]
    shown = (*declared[:4], words.heading(by), *declared[4:])
    rows = (words.cells(r, shown, **_of_worst(night, r, r["source_loop"] in here, by)) for r in night.worst)
    return words.page_table("worst", rows, columns=shown, note=_what_marks(night.worst, by))


def ranking(night: ShownNight) -> Table:
    """All loops of the night."""
    rows = []
    for r in night.rows:
        own = {name: words.marked_cell(r, name) for name in ALL_COSTS}
        own |= {name: words.marked_cell(r, name, ".0f") for name in ALL_SHARES}
        own |= {"loop": link_to(night, r["loop"]), "cause": words.cause_cell(r["cause"])}
        rows.append(words.cells(r, "ranking", **own))
    return words.page_table("ranking", rows, note=_what_marks(night.rows, *ALL_COSTS))


def waiting(night: ShownNight) -> list[tuple[str, str]]:
    """Loops that ask for a look and are hidden by a note, with that note."""
    rows = [r for r in night.rows if r["loop"] in night.hidden and needs_a_look(r)]
    return [(f"{r['loop']} waits:", night.note(r["loop"])) for r in rows]


def _night_tiles(night: ShownNight) -> Tiles:
    assessed = [r for r in night.rows if r["status"] == Status.OK]
    causes = [r["cause"] for r in assessed if needs_a_look(r)]
    items = [(f"{len(assessed)} of {len(night.rows)}", "loops assessed", "")]
    items.append((str(sum(oscillates(r) for r in assessed)), "oscillate", "worse"))
    items += [(str(causes.count(c)), f"caused by {c}", c) for c in CAUSES]
    items.append((str(causes.count(Cause.UNDECIDED)), "undecided", "unclear"))
    return Tiles(tuple(items))


def lost_table(night: ShownNight) -> Table:
    """Loops that were not assessed, and why."""
    lost = sorted((r for r in night.rows if r["status"] != Status.OK), key=lambda r: r["loop"])
    return words.page_table(
        "not-assessed", (words.cells(r, "not-assessed") for r in lost), searchable=len(lost) > 12
    )


def morning_page(
    night: ShownNight,
    groups: Sequence[GroupView] = (),
    sums: Sequence[NightSum] = (),
    links: Sequence[tuple[str, str]] = (),
) -> Page:
    """The morning page of a night, with its groups that share an oscillation and the plant's figures over the nights.

    links : to other nights, after those to the sheet and the CSV.
    """
    seen = [r for r in night.rows if r["loop"] not in night.hidden]
    first = Listing((*(("", text) for text in first_things(seen, groups)), *waiting(night)))
    drawn, lost = plant_map(night), lost_table(night)
    sections = there(
        Section("First", (first, _night_tiles(night))),
        since(night),
        Section("Loops worth a look", (worst_table(night),)),
        section("One cause, several loops", morning_table(groups, bool(night.paged)) if groups else None),
        Section("The plant", there(drawn, plant_history(sums))) if drawn is not None else None,
        Section("Areas", (area_table(night.rows),)),
        Section("All loops", (ranking(night),)),
        Section(f"Not assessed ({len(lost.rows)})", (lost,)),
    )
    by = BY_NAME[cost_column(night.rows)].title.lower()
    subtitle = f"{words.with_noun(len(night.rows), 'loop')}, the worst first by {by}."
    return Page("index", f"Loops in the morning of {night.name}", subtitle, sections, (*LINKS, *links))
