"""The loops of a night in the order of the morning; reads what is shown and no more."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.columns import BELIEVED, BY_NAME, LISTED, NOTED, RANKING, names
from analyzer.lanes.lanes import FIGURE, lanes_in
from analyzer.loop.cost import LOSS, SIGNIFICANCE, compares, cost_column
from analyzer.loop.decisions import Cause, Due, Lane
from analyzer.store import notes
from analyzer.store.notes import Note
from analyzer.store.store import Store
from analyzer.words.units import Row
from identification.errors import InputError

BELIEFS_TOLD = tuple(c for c in BELIEVED if c.name not in ("constants", "state", "news_tone"))
"""What beliefs add to a list."""
LANE_FIGURES = tuple(n for n in FIGURE.values() if n not in names((*RANKING, *BELIEFS_TOLD)))
"""Figures of lanes that the list does not hold."""
SORTABLE = (*names(RANKING), "importance", LOSS, *LANE_FIGURES, *names(BELIEFS_TOLD))
KEPT = names((*RANKING, *LISTED, *BELIEFS_TOLD))
LIST_COLUMNS = (*KEPT, *names(NOTED))
"""Columns of CSV and JSON: the contract's, then what says in which units settings stand, and the advice in full."""
MOST_NAMES = 10
"""Areas that are named in an error."""


def ranked(
    store: Store,
    column: str | None = None,
    top: int | None = None,
    night: str | None = None,
    ascending: bool = False,
    area: str | None = None,
    lane: Lane | None = None,
) -> tuple[list[dict[str, Any]], str]:
    """Rows of a night, or of one of its areas or lanes, sorted; loops without a figure come last by name.

    Without a column, loops that are worth a look come first: those of a lane by its figure; all by their loss where
    loops.csv states importances, else by the significance of their oscillation.

    Raises
    ------
    InputError
        Where there is no such store, night, column or area.
    """
    if column is not None and column not in SORTABLE:
        raise InputError(f"column {column!r}", "one of " + ", ".join(SORTABLE), "correct --by")
    name = night or store.require()
    rows = _within(_read(store, name), area)
    if lane is not None:
        rows = [r for r in rows if lane in lanes_in(r)]
    if column is None and not ascending:
        return worst_first(rows, None if lane is None else FIGURE[lane])[:top], name
    return _sorted(rows, column or SIGNIFICANCE, ascending)[:top], name


def _read(store: Store, night: str) -> list[dict[str, Any]]:
    """The night's rows; columns that an older version did not write are None."""
    wanted = (*KEPT, *LANE_FIGURES, "timezone")
    known = notes.read_notes(store.path)
    return [_noted(row, known) for row in store.rows("nights", night, wanted)]


def _noted(row: dict[str, Any], known: Mapping[str, tuple[Note, ...]]) -> dict[str, Any]:
    """A row with the newest note of its loop; numbers that are none are not known."""
    row = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}
    found = notes.last(known, row["loop"])
    said, until = (None, None) if found is None else (found.said(row["timezone"]), found.hidden_until or None)
    return {**row, "note": said, "hidden_until": until}


def hidden_loops(rows: Sequence[Row], night: str) -> tuple[str, ...]:
    """Loops that their notes keep out of a night's list."""
    return tuple(r["loop"] for r in rows if notes.hides(r["hidden_until"], night))


def _sorted(rows: Sequence[dict[str, Any]], column: str, ascending: bool) -> list[dict[str, Any]]:
    """Rows by a column, ties and loops without a figure by name."""
    by_name = sorted(rows, key=lambda r: r["loop"])
    known = [r for r in by_name if r[column] not in (None, "")]
    falls = BY_NAME[column].is_number and not ascending
    known.sort(key=lambda r: -r[column] if falls else r[column])
    return known + [r for r in by_name if r[column] in (None, "")]


def worst_first(rows: Sequence[dict[str, Any]], column: str | None = None) -> list[dict[str, Any]]:
    """Rows as the morning reads them: what oscillates, then what stands in another lane, then the rest.

    Each by a column; behind them, by the significance within their own recorded range, those whose figure is not
    known or compares with no other's.
    """
    by = cost_column(rows)
    alike = _sorted([r for r in rows if compares(r, column or by)], column or by, False)
    others = _sorted([r for r in rows if not compares(r, column or by)], SIGNIFICANCE, False)
    return sorted((*alike, *others), key=lambda row: _worth(row, by == LOSS))


def _worth(row: Row, lossy: bool) -> int:
    """0 for loops to be looked at first, 2 for those with nothing to look at; losses are compared across lanes."""
    lanes = lanes_in(row)
    if row["due"] == Due.SHUTDOWN:
        return 1
    if Lane.OSCILLATION in lanes or row["cause"] == Cause.VALVE:
        return 0
    return 2 if not lanes else 0 if lossy else 1


def _within(rows: list[dict[str, Any]], area: str | None) -> list[dict[str, Any]]:
    """The rows of an area, all where none is named; capitals do not matter."""
    if area is None:
        return rows
    found = [r for r in rows if (r["area"] or "").casefold() == area.casefold()]
    if not found:
        known = sorted({r["area"] for r in rows if r["area"]})
        named = ", ".join(known[:MOST_NAMES]) or "none: loops.csv states no areas"
        raise InputError(f"area {area!r}", f"one of {named}", "correct --area")
    return found
