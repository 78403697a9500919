"""The plant as a whole: its areas, its map of what each loop costs, and its figures over the nights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.limits import PAGES
from analyzer.loop.cost import LOSS, SIGNIFICANCE, cost, cost_column
from analyzer.loop.decisions import CAUSES, Cause, Status, counts
from analyzer.pages.reading import ShownNight, link_to, needs_a_look, read_nights
from analyzer.pages.words import Row, cell, number, page_table, plain_cell
from analyzer.store.store import Store
from reports.pages import Cell, Line, Panels, Plot, Table, Tile, TreeMap

NO_AREA = "no area stated"
KEYS = (
    *((cause, cause) for cause in CAUSES),
    ("unclear", "another reason to look"),
    ("calm", "nothing to do"),
)
SUMMED = ("loop", "status", "oscillating_pct", "cause", "importance", LOSS, SIGNIFICANCE)


def by_area(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows by the name of their area, '' where none is stated."""
    return {a: [r for r in rows if (r["area"] or "") == a] for a in sorted({r["area"] or "" for r in rows})}


def score(rows: Sequence[Row]) -> float | None:
    """Share of assessed loops, by importance, with no fault found [%]; None where none is assessed."""
    weights = [
        (1.0 if r["importance"] is None else r["importance"], r["cause"] in (Cause.NONE, None))
        for r in rows
        if r["status"] == Status.OK
    ]
    total = sum(w for w, _ in weights)
    return 100.0 * sum(w for w, good in weights if good) / total if total > 0 else None


def _area(name: str, rows: Sequence[Row]) -> tuple[Cell, ...]:
    assessed = [r for r in rows if r["status"] == Status.OK]
    worst = sorted((r for r in assessed if r["cause"] != Cause.NONE), key=lambda r: -(r[SIGNIFICANCE] or 0.0))
    numbers = [len(rows), len(assessed)]
    numbers += [sum(r["cause"] == c for r in assessed) for c in (*CAUSES, Cause.UNDECIDED)]
    return (
        Cell(name or NO_AREA),
        *map(plain_cell, (score(rows), *numbers, sum(r[SIGNIFICANCE] or 0.0 for r in assessed))),
        Cell(", ".join(f"{r['loop']} ({number(r[SIGNIFICANCE])})" for r in worst[: PAGES.area_loops])),
    )


def area_table(rows: Sequence[Row]) -> Table:
    """Areas with their worst loops, the lowest score first."""
    cells = [_area(name, own) for name, own in by_area(rows).items()]
    return page_table("areas", sorted(cells, key=lambda c: 101.0 if c[1].number is None else c[1].number))


def _plant_tiles(night: ShownNight, rows: Sequence[Row], by: str) -> tuple[Tile, ...]:
    """An area's loops, those that cost most first, and the others in one."""
    ordered = sorted(((cost(r, by), r) for r in rows), key=lambda c: (-c[0], c[1]["loop"]))
    tiles = []
    for worth, row in ordered[: PAGES.area_tiles]:
        kind = "calm" if not needs_a_look(row) else row["cause"] if row["cause"] in CAUSES else "unclear"
        text = f"{row['loop']}: {number(worth)}. {cell(row, 'reason').text}"
        tiles.append(Tile(row["loop"], worth, kind, text, link_to(night, row["loop"]).href))
    rest = [worth for worth, _ in ordered[PAGES.area_tiles :]]
    if rest:
        text = f"{len(rest)} more loops: {number(sum(rest))}"
        tiles.append(Tile(f"{len(rest)} more", sum(rest), "calm", text))
    return tuple(tiles)


def plant_map(night: ShownNight) -> TreeMap | None:
    """Areas and assessed loops as large as what they cost, coloured by why they are worth a look; None where nothing
    is lost anywhere."""
    rows = [r for r in night.rows if r["status"] == Status.OK]
    by = cost_column(rows)
    if not any(cost(r, by) > 0 for r in rows):
        return None
    what = "average absolute error times importance" if by == LOSS else "oscillation significance"
    groups = tuple((area or NO_AREA, _plant_tiles(night, own, by)) for area, own in by_area(rows).items())
    return TreeMap("plant", f"The plant by area: size is {what}", groups, KEYS)


@dataclass(frozen=True, slots=True)
class NightSum:
    """One night of the plant: its name, loops that oscillate, those of each cause, and what all cost by a column."""

    name: str
    oscillate: int
    causes: Mapping[Cause, int]
    cost: float
    by: str = LOSS


def summed(name: str, rows: Sequence[Row]) -> NightSum:
    """The sums of one night's rows."""
    swinging = [r for r in rows if counts(r["oscillating_pct"])]
    of = {c: sum(r["cause"] == c for r in swinging) for c in (*CAUSES, Cause.UNDECIDED)}
    by = cost_column(rows)
    return NightSum(name, len(swinging), of, sum(cost(r, by) for r in rows), by)


def read_sums(store: Store, night: str) -> list[NightSum]:
    """The sums of a night and of those before it, oldest first."""
    names = [n for n in store.nights() if n <= night][-PAGES.history :]
    return [summed(n, read_nights(store, [n], SUMMED)) for n in names]


def plant_history(sums: Sequence[NightSum]) -> Panels | None:
    """Curves over the nights: loops that oscillate, and what all cost, of the nights whose figure is that of the last
    one; None where there are too few."""
    if len(sums) < PAGES.curve_nights:
        return None
    day = np.array([date.fromisoformat(s.name[:10]).toordinal() for s in sums], float)
    day -= day[-1]
    lines = [Line("all that oscillate", day, np.array([s.oscillate for s in sums], float), kind="recorded")]
    kinds = ((Cause.VALVE, "op"), (Cause.TUNING, "baseline"), (Cause.LOAD, "pv"))
    lines += [Line(f"by {c}", day, np.array([s.causes[c] for s in sums], float), kind=k) for c, k in kinds]
    axis, most = "days before this night", max(s.oscillate for s in sums) + 1.0
    loops = Plot("oscillating", "Loops that oscillate", axis, "loops", tuple(lines), reach=(0.0, most))
    by = sums[-1].by
    cost, named = np.array([s.cost if s.by == by else np.nan for s in sums]), BY_NAME[by].heading.lower()
    title = f"The loops' {named} together, now {number(float(cost[-1]))}"
    costs = Plot("loss", title, axis, named, (Line(named, day, cost, kind="recorded"),), reach=(0.0, 1.0))
    return Panels("over-the-nights", "The plant over the nights", (loops, costs))
