"""From changes and a store to the cases of a before/after page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from analyzer.comparison.before_after import LIMITS, LoopComparison, Span, compare, follows
from analyzer.comparison.spans import spans_around
from analyzer.config import ChangeLimits, ComparisonLimits
from analyzer.loop.decisions import counts
from analyzer.loops.changes import TuningChange, behaviour_change, stated_changes
from analyzer.pages.change_case import Case
from analyzer.pages.engineering import scale_of
from analyzer.pages.reading import nights_within, read_hours, read_nights, read_trends
from analyzer.pages.wear import wear_texts
from analyzer.store.store import Store
from analyzer.words.units import gain_unit

COLUMNS = (
    *(
        "loop",
        "night",
        "description",
        "type",
        "gain_unit",
        "ti_unit",
        "pv_unit",
        "op_unit",
        "form",
        "kp",
        "ti",
        "start_s",
        "status",
    ),
    *("source_loop", "oscillating_pct", "extra", "pv_lo", "pv_hi"),
)
CHANGES = ChangeLimits()
"""The limits in force where none are given."""


@dataclass(frozen=True, slots=True)
class Spans:
    """How long to look: days each side, or spans stated outright."""

    days: float = 7.0
    before: Span | None = None
    after: Span | None = None

    def of(self, change: TuningChange, others: Sequence[float]) -> tuple[Span, Span]:
        """Spans before and after a change."""
        before, after = spans_around(change.time_s, self.days, others)
        return self.before or before, self.after or after


def detected(
    store: Store, loops: Sequence[str] | None = None, limits: ChangeLimits = CHANGES
) -> list[TuningChange]:
    """Changes that nobody stated: settings that differ between nights, and steps of a controller's
    behaviour."""
    nights = store.nights()
    rows = read_nights(store, nights, COLUMNS, loops)
    tags = list(dict.fromkeys(r["loop"] for r in rows))
    hours = read_hours(store, tags, nights)
    found = []
    for tag in tags:
        stated = stated_changes([r for r in rows if r["loop"] == tag])
        seen = behaviour_change(tag, hours[tag], limits) if tag in hours else None
        found += stated or ([seen] if seen else [])
    return found


def _around(spans: Sequence[tuple[Span, Span]]) -> Span:
    ends = [s for pair in spans for s in pair]
    return Span(min(s.first_s for s in ends), max(s.last_s for s in ends))


def _source(rows: Sequence[dict[str, Any]], limits: ComparisonLimits) -> str:
    oscillating = [counts(r["oscillating_pct"]) for r in rows]
    return follows([r["source_loop"] for r in rows], oscillating, limits)


def _units(row: dict[str, Any]) -> str:
    gain = gain_unit(row["gain_unit"], row["pv_unit"], row["op_unit"])
    return f"{row['form'] or 'ideal'} form, Kp in {gain}, Ti in {row['ti_unit'] or 's'}"


def cases(
    store: Store, changes: Sequence[TuningChange], spans: Spans, limits: ComparisonLimits = LIMITS
) -> tuple[list[Case], list[tuple[str, str]]]:
    """Every change with what came of it, and those that could not be looked at, with the reason.

    Parameters
    ----------
    store : Store
    changes : sequence of TuningChange
        Several of one loop end each other's spans.
    spans : Spans
    limits : ComparisonLimits
    """
    if not changes:
        return [], []
    of = [spans.of(c, [o.time_s for o in changes if o.loop == c.loop and o != c]) for c in changes]
    nights = nights_within(store, _around(of))
    loops = {c.loop for c in changes}
    rows = read_nights(store, nights, COLUMNS, loops)
    hours, trends = read_hours(store, loops, nights), read_trends(store, loops, nights)
    found: list[Case] = []
    missing: list[tuple[str, str]] = []
    for change, (before, after) in zip(changes, of, strict=True):
        own = [r for r in rows if r["loop"] == change.loop]
        if change.loop not in hours or not own:
            missing.append((change.loop, "the store holds no hours of it around the change"))
            continue
        result = compare(change.loop, hours[change.loop], before, after, _source(own, limits), limits)
        found.append(_case(change, result, own[-1], trends.get(change.loop)))
    return found, missing


def _case(change: TuningChange, result: LoopComparison, row: dict[str, Any], trend: Any) -> Case:
    return Case(
        change, result, row["description"] or "", _units(row), trend, wear_texts(result, row), scale_of(row)
    )
