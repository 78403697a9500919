"""The morning page: loops that need action, changes, loops not assessed, and the plant as a whole: its areas, its map
of losses by loop, and its figures over the nights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.loop.cost import LOSS, MARK, OF_RECORDED, SIGNIFICANCE, cost, cost_column, mark
from analyzer.loop.decisions import CAUSES, Action, Cause, Status, counts
from analyzer.pages import words, work
from analyzer.pages.groups import morning_table
from analyzer.pages.loop_pictures import close_span, sparkline
from analyzer.pages.reading import SIDE_BY_SIDE, ShownNight, needs_a_look, oscillates, read_nights
from analyzer.pages.summary import first_things, since
from analyzer.plantwide.view import GroupView
from analyzer.store.store import Store
from analyzer.words.units import changed_settings, row_settings
from reports.pages import (
    Cell,
    Line,
    Listing,
    Page,
    Panels,
    Plot,
    Section,
    Table,
    Tile,
    Tiles,
    TreeMap,
    section,
    without_none,
)

HISTORY = 60  # Nights of history on a page [nights]: two months, as a maintenance round takes
CURVE_NIGHTS = 3  # Nights from which a curve is drawn [nights]
AREA_LOOPS = 5  # Worst loops of an area that are named [loops]
AREA_TILES = 15  # Loops of an area that are drawn separately; the rest is one rectangle [loops]

NO_AREA = "no area stated"
KEYS = (
    *((cause, cause) for cause in CAUSES),
    ("unclear", "another reason to look"),
    ("calm", "nothing to do"),
)
SUMMED = ("loop", "status", "oscillating_pct", "cause", "importance", LOSS, SIGNIFICANCE)
FOLLOWER = "\u2514 "
"""Prefix of the name of a loop that is listed below the one it follows."""
LINKS = (
    ("Hand-over to maintenance", f"{work.MAINTENANCE}.html"),
    ("Work list", f"{work.WORK}.html"),
    ("Loops side by side", f"{SIDE_BY_SIDE}.html"),
    ("All loops as CSV", "csv/index-ranking.csv"),
)


def _what_marks(rows: Sequence[words.Row], *columns: str) -> str:
    """Meaning of the mark after figures; '' if none of the columns has one."""
    return f"{MARK} {OF_RECORDED}." if any(mark(row, name) for row in rows for name in columns) else ""


def worst_table(night: ShownNight) -> Table:
    """The loops that need action, worst first, followers below the loop that moves them."""
    here, by = {r["loop"] for r in night.worst}, cost_column(night.rows)

    def own(row: words.Row) -> dict[str, words.CellContent]:
        name, trend = night.link(row["loop"]), night.trends.get(row["loop"])
        drawn = None if trend is None else sparkline(trend, close_span(row, trend))
        changed = row["kp_new"] is not None or row["ti_new"] is not None
        known = row["kp"] is not None or row["ti"] is not None
        settings = changed_settings(row) if changed else row_settings(row)
        return {
            "loop": replace(name, text=FOLLOWER + name.text) if row["source_loop"] in here else name,
            "trend": Cell("", figure=drawn),
            by: words.marked_cell(row, by),
            "cause": words.cause_cell(row["cause"]),
            "settings": settings if known or not changed else f"new: {settings}",
            "note": night.note(row["loop"]),
        }

    noted = any(night.note(r["loop"]) for r in night.worst)
    declared = words.page_columns("worst") if noted else words.page_columns("worst")[:-1]
    shown = (*declared[:4], words.heading(by), *declared[4:])
    return night.table("worst", night.worst, own, columns=shown, note=_what_marks(night.worst, by))


def ranking(night: ShownNight) -> Table:
    """All loops of the night."""
    declared, by = words.page_columns("ranking"), cost_column(night.rows)
    shown = declared if by in words.keys("ranking") else (*declared[:4], words.heading(by), *declared[4:])
    figures = [c.key for c in shown if c.numeric]

    def own(row: words.Row) -> Mapping[str, words.CellContent]:
        return {name: words.marked_cell(row, name) for name in figures} | {
            "cause": words.cause_cell(row["cause"])
        }

    return night.table("ranking", night.rows, own, columns=shown, note=_what_marks(night.rows, *figures))


def waiting(night: ShownNight) -> list[tuple[str, str]]:
    """Loops that need a look and are hidden by a note, with that note."""
    rows = [r for r in night.rows if r["loop"] in night.hidden and needs_a_look(r)]
    return [(f"{r['loop']} waits:", night.note(r["loop"])) for r in rows]


def _night_tiles(night: ShownNight) -> Tiles:
    assessed = [r for r in night.rows if r["status"] == Status.OK]
    causes = [r["cause"] for r in assessed if needs_a_look(r)]
    items = [(f"{len(assessed)} of {len(night.rows)}", "loops assessed", "")]
    items.append((str(sum(oscillates(r) for r in assessed)), "oscillate", "worse"))
    items += [(str(causes.count(c)), f"caused by {c}", c) for c in CAUSES]
    unknown = [r for r in assessed if r["cause"] == Cause.UNDECIDED and oscillates(r)]
    items.append((str(len(unknown)), "undecided", "unclear"))
    return Tiles(tuple(items))


def lost_table(night: ShownNight) -> Table:
    """Loops that were not assessed, and why."""
    lost = sorted((r for r in night.rows if r["status"] != Status.OK), key=lambda r: r["loop"])
    return night.table("not-assessed", lost, lambda r: {"loop": r["loop"]}, searchable=len(lost) > 12)


def by_area(rows: Sequence[words.Row]) -> dict[str, list[words.Row]]:
    """Rows by the name of their area, '' if none is stated."""
    return {a: [r for r in rows if (r["area"] or "") == a] for a in sorted({r["area"] or "" for r in rows})}


def score(rows: Sequence[words.Row]) -> float | None:
    """Share of assessed loops, by importance, that need no action [%]; None if none is assessed."""
    weights = [
        (
            1.0 if r["importance"] is None else r["importance"],
            r["cause"] in (Cause.NONE, None) and r["action"] in (Action.NONE, None),
        )
        for r in rows
        if r["status"] == Status.OK
    ]
    total = sum(w for w, _ in weights)
    return 100.0 * sum(w for w, good in weights if good) / total if total > 0 else None


def _area(name: str, rows: Sequence[words.Row]) -> tuple[words.CellContent, ...]:
    assessed = [r for r in rows if r["status"] == Status.OK]
    worst = sorted((r for r in assessed if r["cause"] != Cause.NONE), key=lambda r: -(r[SIGNIFICANCE] or 0.0))
    numbers = [len(rows), len(assessed)]
    numbers += [sum(r["cause"] == c for r in assessed) for c in (*CAUSES, Cause.UNDECIDED)]
    named = ", ".join(f"{r['loop']} ({words.number(r[SIGNIFICANCE])})" for r in worst[:AREA_LOOPS])
    return (name or NO_AREA, score(rows), *numbers, sum(r[SIGNIFICANCE] or 0.0 for r in assessed), named)


def area_table(rows: Sequence[words.Row]) -> Table:
    """Areas with their worst loops, the lowest score first."""
    areas = by_area(rows).items()
    ordered = sorted(areas, key=lambda a: 101.0 if (found := score(a[1])) is None else found)
    return words.page_table("areas", (_area(name, own) for name, own in ordered))


def _plant_tiles(night: ShownNight, rows: Sequence[words.Row], by: str) -> tuple[Tile, ...]:
    """An area's loops, highest loss first, and the others in one tile."""
    ordered = sorted(((cost(r, by), r) for r in rows), key=lambda c: (-c[0], c[1]["loop"]))
    tiles = []
    for worth, row in ordered[:AREA_TILES]:
        kind = "calm" if not needs_a_look(row) else row["cause"] if row["cause"] in CAUSES else "unclear"
        text = f"{row['loop']}: {words.number(worth)}. {words.cell(row, 'reason').text}"
        tiles.append(Tile(row["loop"], worth, kind, text, night.link(row["loop"]).href))
    rest = [worth for worth, _ in ordered[AREA_TILES:]]
    if rest:
        text = f"{len(rest)} more loops: {words.number(sum(rest))}"
        tiles.append(Tile(f"{len(rest)} more", sum(rest), "calm", text))
    return tuple(tiles)


def plant_map(night: ShownNight) -> TreeMap | None:
    """Areas and assessed loops with sizes by loss, coloured by the reason for a look; None if there is no loss
    anywhere."""
    rows = [r for r in night.rows if r["status"] == Status.OK]
    by = cost_column(rows)
    if not any(cost(r, by) > 0 for r in rows):
        return None
    what = "average absolute error times importance" if by == LOSS else "oscillation significance"
    groups = tuple((area or NO_AREA, _plant_tiles(night, own, by)) for area, own in by_area(rows).items())
    return TreeMap("plant", f"The plant by area: size is {what}", groups, KEYS)


@dataclass(frozen=True, slots=True)
class NightSum:
    """One night of the plant: its name, number of oscillating loops, number by cause, and total loss by a column."""

    name: str
    oscillate: int
    causes: Mapping[Cause, int]
    cost: float
    by: str = LOSS


def summed(name: str, rows: Sequence[words.Row]) -> NightSum:
    """The sums of one night's rows."""
    swinging = [r for r in rows if counts(r["oscillating_pct"])]
    of = {c: sum(r["cause"] == c for r in swinging) for c in (*CAUSES, Cause.UNDECIDED)}
    by = cost_column(rows)
    return NightSum(name, len(swinging), of, sum(cost(r, by) for r in rows), by)


def read_sums(store: Store, night: str) -> list[NightSum]:
    """The sums of a night and of those before it, oldest first."""
    names = [n for n in store.nights() if n <= night][-HISTORY:]
    return [summed(n, read_nights(store, [n], SUMMED)) for n in names]


def plant_history(sums: Sequence[NightSum]) -> Panels | None:
    """Curves over the nights: oscillating loops, and total loss, of the nights with the figure of the last one; None
    if there are too few."""
    if len(sums) < CURVE_NIGHTS:
        return None
    day = np.array([date.fromisoformat(s.name[:10]).toordinal() for s in sums], float)
    day -= day[-1]
    lines = [Line("all that oscillate", day, np.array([s.oscillate for s in sums], float), kind="recorded")]
    kinds = ((Cause.VALVE, "op"), (Cause.TUNING, "baseline"), (Cause.LOAD, "pv"))
    lines += [Line(f"by {c}", day, np.array([s.causes[c] for s in sums], float), kind=k) for c, k in kinds]
    most, last = max(s.oscillate for s in sums) + 1.0, sums[-1].name[:10]
    title = "Loops that oscillate"
    loops = Plot("oscillating", title, "night", "loops", tuple(lines), reach=(0.0, most), day=last)
    by = sums[-1].by
    cost, named = np.array([s.cost if s.by == by else np.nan for s in sums]), BY_NAME[by].heading.lower()
    title = f"The loops' {named} together, now {words.number(float(cost[-1]))}"
    line = Line(named, day, cost, kind="recorded")
    costs = Plot("loss", title, "night", named, (line,), reach=(0.0, 1.0), day=last)
    return Panels("over-the-nights", "The plant over the nights", (loops, costs))


def morning_page(
    night: ShownNight,
    groups: Sequence[GroupView] = (),
    sums: Sequence[NightSum] = (),
    links: Sequence[tuple[str, str]] = (),
) -> Page:
    """The morning page of a night, with its groups of common oscillations and the plant's figures over the nights.

    links : to other nights, after those to the sheet and the CSV.
    """
    seen = [r for r in night.rows if r["loop"] not in night.hidden]
    first = Listing((*(("", text) for text in first_things(seen, groups)), *waiting(night)))
    drawn, lost = plant_map(night), lost_table(night)
    sections = without_none(
        Section("First", (first, _night_tiles(night))),
        since(night),
        Section("Loops worth a look", (worst_table(night),)),
        section("One cause, several loops", morning_table(groups, bool(night.paged)) if groups else None),
        Section("The plant", without_none(drawn, plant_history(sums))) if drawn is not None else None,
        Section("Areas", (area_table(night.rows),)),
        Section("All loops", (ranking(night),)),
        Section(f"Not assessed ({len(lost.rows)})", (lost,)),
    )
    by = BY_NAME[cost_column(night.rows)].title.lower()
    subtitle = f"{words.with_noun(len(night.rows), 'loop')}, the worst first by {by}."
    return Page("index", f"Loops in the morning of {night.name}", subtitle, sections, (*LINKS, *links))
