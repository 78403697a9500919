"""Data that the pages read from a store: nights, hours and trends of some loops, and one night as a whole."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from analyzer.comparison.block_bootstrap import Floats
from analyzer.comparison.measures import Span
from analyzer.lanes.lanes import FIGURE
from analyzer.loop.cost import LOSS, cost, cost_column
from analyzer.loop.decisions import Cause, Status, counts
from analyzer.pages.rank import worst_first
from analyzer.pages.words import CellContent, cells, keys, page_table
from analyzer.store import notes
from analyzer.store.notes import Note, is_hidden, last
from analyzer.store.store import Store
from analyzer.store.table import SHADED, TREND, read_stored, stored_names
from analyzer.words.units import Row, row_settings
from reports.pages import Cell, Table
from reports.texts import slug

USUAL_NIGHTS = 15
"""Earlier nights that give the usual values of a loop [nights]: two weeks, and the night before."""

SIDE_BY_SIDE = "side-by-side"
"""Name of the page with loops below each other; the address after # lists them."""
AROUND_D = 2
"""Nights are named by the date of their middle and are up to 36 h long: so many more days are read [d]."""


@dataclass(frozen=True, slots=True)
class Thinned:
    """Decimated signals of a loop: start of each bucket [s], extremes by name ("pv_min") [% of span], gaps; manual
    and frozen, where the controller is in manual and where PV is constant."""

    time_s: Floats
    extremes: Mapping[str, Floats]
    gap: np.ndarray
    manual: np.ndarray
    frozen: np.ndarray

    def middle(self, signal: str) -> Floats:
        """Middle of each bucket's extremes, shape (b,)."""
        return 0.5 * (self.extremes[f"{signal}_min"] + self.extremes[f"{signal}_max"])

    def between(self, first_s: float, last_s: float) -> Thinned:
        """The buckets that begin in a span."""
        a, b = np.searchsorted(self.time_s, [first_s, last_s])
        masks = (x[a:b] for x in (self.gap, self.manual, self.frozen))
        return Thinned(self.time_s[a:b], {k: v[a:b] for k, v in self.extremes.items()}, *masks)

    def coarser(self, most: int) -> Thinned:
        """At most about `most` buckets, with neighbours merged so that no extreme is lost."""
        n = self.time_s.size
        if n <= most:
            return self
        edges = (np.arange(most) * n) // most
        joined = {}
        for name, x in self.extremes.items():
            joined[name] = (np.minimum if name.endswith("_min") else np.maximum).reduceat(x, edges)
        masks = (np.logical_and.reduceat(x, edges) for x in (self.gap, self.manual, self.frozen))
        return Thinned(self.time_s[edges], joined, *masks)

    def spans(self, mask: np.ndarray) -> tuple[tuple[float, float], ...]:
        """First and last time [s] of each stretch in which a mask of the buckets is True."""
        ends = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(int)))
        stamps = np.append(self.time_s, self.time_s[-1:])
        return tuple((float(stamps[a]), float(stamps[b])) for a, b in zip(ends[::2], ends[1::2], strict=True))


def nights_within(store: Store, span: Span) -> list[str]:
    """Names of the nights that may contain part of a span."""
    around = timedelta(days=AROUND_D)
    first = (datetime.fromtimestamp(span.first_s, UTC) - around).strftime("%Y-%m-%d")
    last = (datetime.fromtimestamp(span.last_s, UTC) + around).strftime("%Y-%m-%d")
    return [n for n in store.nights() if first <= n <= last]


def read_nights(
    store: Store, nights: Sequence[str], columns: Sequence[str], loops: Collection[str] | None = None
) -> list[dict[str, Any]]:
    """Rows of several nights, oldest first; columns missing in a night are None."""
    read = nights if loops is None or loops else ()
    return [{**r, "night": night} for night in read for r in store.rows("nights", night, columns, loops)]


def by_loop(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows of nights by their loop, in their order."""
    out: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        out[row["loop"]].append(row)
    return dict(out)


def _figures(
    store: Store,
    table: str,
    loops: Collection[str],
    nights: Sequence[str],
    columns: Sequence[str] | None = None,
) -> dict[str, dict[str, Floats]]:
    """Columns of numbers by loop, in the order of the nights that have the table, NaN where unknown."""
    paths = [store.file(table, night) for night in nights] if loops else []
    tables = [_read_loops(p, columns, loops) for p in paths if p.exists()]
    if not tables:
        return {}
    names = dict.fromkeys(n for t in tables for n in t.column_names if n not in ("loop", "night"))
    kinds = {"loop": pa.string(), "night": pa.string(), **dict.fromkeys(names, pa.float64())}
    alike = [t.cast(pa.schema([(n, kinds[n]) for n in t.column_names])) for t in tables]
    joined = pa.concat_tables(alike, promote_options="default")
    held = {n: joined.column(n).to_numpy(zero_copy_only=False) for n in names}
    tags = joined.column("loop").combine_chunks().dictionary_encode()
    code, out = tags.indices.to_numpy(), {}
    for k, tag in enumerate(tags.dictionary.to_pylist()):
        own = np.flatnonzero(code == k)
        out[str(tag)] = {n: x[own] for n, x in held.items()}
    return out


def _read_loops(path: Path, columns: Sequence[str] | None, loops: Collection[str]) -> pa.Table:
    """The rows of some loops in a table, with those of some columns that exist."""
    held = None if columns is None else set(stored_names(path))
    wanted = None if held is None else [c for c in columns or () if c in held]
    return read_stored(path, wanted, loops)


def read_hours(store: Store, loops: Collection[str], nights: Sequence[str]) -> dict[str, dict[str, Floats]]:
    """Hourly figures by loop, in order of time, NaN where unknown; of an hour recorded twice the fuller one."""
    out = {}
    for tag, figures in _figures(store, "hours", loops, nights).items():
        order = np.lexsort((figures["usable_h"], figures["hour_s"]))
        last = order[np.append(np.diff(figures["hour_s"][order]) != 0, True)]
        out[tag] = {name: x[last] for name, x in figures.items()}
    return out


def read_trends(store: Store, loops: Collection[str], nights: Sequence[str]) -> dict[str, Thinned]:
    """Decimated trends by loop, in order of time; a bucket of a gap where nothing was recorded."""
    found = _figures(store, "trends", loops, nights, ("loop", *TREND, *SHADED))
    return {tag: _thinned_from(figures) for tag, figures in found.items()}


def _thinned_from(figures: Mapping[str, Floats]) -> Thinned:
    time_s, order = np.unique(figures["time_s"], return_index=True)
    step = np.diff(time_s)
    jumps = np.flatnonzero(step > 3 * np.median(step)) + 1 if step.size else np.array([], int)
    extremes = {name: figures[name][order] for name in TREND if name not in ("time_s", "bad")}
    unknown = np.zeros(figures["bad"].size)
    gap, *shaded = (figures.get(name, unknown)[order] > 0.5 for name in ("bad", *SHADED))
    return Thinned(
        np.insert(time_s, jumps, time_s[jumps - 1] + 1.0),
        {name: np.insert(x, jumps, x[jumps - 1]) for name, x in extremes.items()},
        np.insert(gap, jumps, True),
        *(np.insert(x, jumps, False) for x in shaded),
    )


NIGHT_COLUMNS = tuple(dict.fromkeys((*keys("of-a-night"), *FIGURE.values())))
"""Columns of a night used on its pages."""
REMEMBERED = ("loop", "lanes", *FIGURE.values())
"""Columns of earlier nights that are read."""


@dataclass(frozen=True, slots=True)
class ShownNight:
    """The rows of a night, worst first, and trends of the worst.

    earlier : for loops of the previous night, its row and earlier ones, oldest first, with the columns that are kept;
    paged : loops that have a page, worst first.
    """

    name: str
    rows: tuple[Row, ...]
    earlier: Mapping[str, Sequence[Row]]
    before_name: str
    worst: tuple[Row, ...]
    trends: Mapping[str, Thinned] = field(default_factory=dict)
    notes: Mapping[str, tuple[Note, ...]] = field(default_factory=dict)
    paged: tuple[str, ...] = ()

    @property
    def zone(self) -> str:
        """The plant's time zone."""
        return next((r["timezone"] for r in self.rows if r["timezone"]), "UTC")

    @property
    def hidden(self) -> frozenset[str]:
        """Loops hidden from the list by a note."""
        return frozenset(loop for loop in self.notes if is_hidden(last(self.notes, loop), self.name))

    def note(self, loop: str) -> str:
        """The newest note of a loop, '' if there is none."""
        found = last(self.notes, loop)
        return "" if found is None else found.as_line(self.zone)

    def link(self, loop: str) -> Cell:
        """The loop's name, linked to its page if there is one."""
        return Cell(loop, kind="strong", href=f"{slug(loop)}.html" if loop in self.paged else "")

    def table(
        self,
        declared: str,
        rows: Iterable[Row],
        own: Callable[[Row], Mapping[str, CellContent]] = lambda row: {},
        **stated: Any,
    ) -> Table:
        """A table of loops as declared in tables.toml, except for `stated` properties: each row's own cells, a link
        to the loop's page, and otherwise values of the store."""
        shown = stated.get("columns", declared)
        shown_rows = (cells(row, shown, **{"loop": self.link(row["loop"]), **own(row)}) for row in rows)
        return page_table(declared, shown_rows, **stated)


def oscillates(row: Row | None) -> bool:
    """Whether a loop counts as oscillating."""
    return row is not None and counts(row["oscillating_pct"])


def needs_a_look(row: Row) -> bool:
    """Whether a loop oscillates, has a valve fault without an oscillation, or is in another lane."""
    if row["status"] == Status.FAILED:
        return False
    return bool(row["lanes"]) or (
        row["status"] == Status.OK and (oscillates(row) or row["cause"] not in (Cause.NONE, None, ""))
    )


def largest_loss(rows: Sequence[Row]) -> str:
    """The loop with the highest loss, which is always in the morning's list; '' if losses are not compared."""
    if cost_column(rows) != LOSS:
        return ""
    return str(max(rows, key=lambda r: cost(r, LOSS))["loop"])


def followers_under(rows: Sequence[Row]) -> list[Row]:
    """Rows in their order, each loop that follows another one directly below it."""
    present = {r["loop"] for r in rows}
    under: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        under[row["source_loop"] if row["source_loop"] in present else ""].append(row)
    out: list[Row] = []
    for row in under.pop("", []):
        out += [row, *under.pop(row["loop"], [])]
    return out + [r for rest in under.values() for r in rest]


def remembered_columns(store: Store, night: str) -> list[dict[str, Any]]:
    """Columns of a night that the pages of later nights read."""
    return read_nights(store, [night], REMEMBERED)


def read_night(
    store: Store,
    name: str | None,
    top: int,
    drawn: bool = True,
    read_earlier: Callable[[Store, str], list[dict[str, Any]]] = remembered_columns,
) -> ShownNight:
    """Data of the morning page of a night, with trends of the worst loops if they are drawn; `read_earlier` reads
    earlier nights and may cache them for several pages."""
    nights = store.nights()
    night = name or store.require()
    store.read("nights", night, ["loop"])
    earlier = [n for n in nights if n < night]
    rows = worst_first(read_nights(store, [night], NIGHT_COLUMNS))
    remembered = by_loop([r for n in earlier[-USUAL_NIGHTS:] for r in read_earlier(store, n)])
    remembered = {loop: own for loop, own in remembered.items() if own[-1]["night"] == earlier[-1]}
    known = notes.read_notes(store.path)
    most = largest_loss(rows)
    looked = [
        r
        for r in rows
        if (needs_a_look(r) or r["loop"] == most) and not is_hidden(last(known, r["loop"]), night)
    ]
    worst = tuple(followers_under(looked)[:top])
    paged = tuple(dict.fromkeys(r["loop"] for r in (*worst, *rows)))[:top]
    trends = read_trends(store, {r["loop"] for r in worst}, [night]) if drawn else {}
    return ShownNight(
        night, tuple(rows), remembered, earlier[-1] if earlier else "", worst, trends, known, paged
    )


def action_text(row: Row, action: str = "") -> str:
    """The action (the row's, unless another is given), with the new settings if there are any."""
    action = action or row["action"] or ""
    if row["kp_new"] is None and row["ti_new"] is None:
        return action
    return f"{action}: {row_settings(row, 'kp_new', 'ti_new')}"
