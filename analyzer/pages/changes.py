"""Changes of controllers with what came of them: found in a store, compared, in words, in wear and money."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

from analyzer.comparison.before_after import (
    LIMITS,
    Change,
    ChangeVerdict,
    LoopComparison,
    Span,
    compare,
    follows,
    grade,
    spans_around,
)
from analyzer.config import ComparisonLimits, Config
from analyzer.loop.decisions import counts
from analyzer.loops.changes import TuningChange, behaviour_change, stated_changes
from analyzer.pages.reading import Thinned, by_loop, nights_within, read_hours, read_nights, read_trends
from analyzer.pages.words import Row, enumerated, keys, number, texts
from analyzer.store.store import Store

COLUMNS = keys("of-a-change")
HOURS_A_YEAR = 8760.0


@dataclass(frozen=True, slots=True)
class ChangeCase:
    """A change with what came of it, the loop's row of the last night around it, and its trend."""

    change: TuningChange
    found: LoopComparison
    row: Row
    trend: Thinned | None


@dataclass(frozen=True, slots=True)
class Spans:
    """How long to look: days each side, or spans stated outright."""

    days: float = 7.0
    before: Span | None = None
    after: Span | None = None

    def of(
        self, change: TuningChange, others: Sequence[float], limits: ComparisonLimits
    ) -> tuple[Span, Span]:
        """Spans before and after a change."""
        before, after = spans_around(change.time_s, self.days, others, limits)
        return self.before or before, self.after or after


def detected(store: Store, loops: Sequence[str] | None, config: Config) -> list[TuningChange]:
    """Changes that nobody stated: settings that differ between nights, and steps of a controller's
    behaviour."""
    nights = store.nights()
    rows = by_loop(read_nights(store, nights, COLUMNS, loops))
    hours = read_hours(store, rows, nights)
    found = []
    for tag, own in rows.items():
        stated = stated_changes(own)
        seen = behaviour_change(tag, hours[tag], config) if tag in hours else None
        found += stated or ([seen] if seen else [])
    return found


def change_cases(
    store: Store, changes: Sequence[TuningChange], spans: Spans, limits: ComparisonLimits = LIMITS
) -> tuple[list[ChangeCase], list[tuple[str, str]]]:
    """Every change with what came of it, and those that could not be looked at, with the reason; several changes of
    one loop end each other's spans."""
    if not changes:
        return [], []
    of = [spans.of(c, [o.time_s for o in changes if o.loop == c.loop and o != c], limits) for c in changes]
    ends = [span for pair in of for span in pair]
    nights = nights_within(store, Span(min(s.first_s for s in ends), max(s.last_s for s in ends)))
    loops = {c.loop for c in changes}
    rows = by_loop(read_nights(store, nights, COLUMNS, loops))
    hours, trends = read_hours(store, loops, nights), read_trends(store, loops, nights)
    found: list[ChangeCase] = []
    missing: list[tuple[str, str]] = []
    for change, (before, after) in zip(changes, of, strict=True):
        own = rows.get(change.loop)
        if change.loop not in hours or not own:
            missing.append((change.loop, "the store holds no hours of it around the change"))
            continue
        oscillating = [counts(r["oscillating_pct"]) for r in own]
        source = follows([r["source_loop"] for r in own], oscillating, limits)
        result = compare(change.loop, hours[change.loop], before, after, source, limits)
        found.append(ChangeCase(change, result, own[-1], trends.get(change.loop)))
    return found, missing


def outcome(found: LoopComparison) -> str:
    """A loop's outcome in one phrase."""
    better = [c.measure.short_title.lower() for c in found.primary if c.verdict is ChangeVerdict.BETTER]
    reasons = "; ".join(found.reasons) or "no hourly figures on both sides"
    text: str = texts("outcomes")[grade(found)]["said"].format(better=enumerated(better), reasons=reasons)
    if found.source_loop:
        text += f"; the cause lies in the neighbour {found.source_loop}, whose oscillation it follows"
    return text


def _stated(row: Row, name: str) -> float | None:
    """A number of the plant: a column of the night, or of its JSON of the plant's own columns."""
    held = json.loads(row.get("extra") or "{}") | {k: v for k, v in row.items() if v is not None}
    try:
        value = float(held[name])
    except (KeyError, TypeError, ValueError):
        return None
    return value if math.isfinite(value) and value > 0 else None


def _clear_change(found: LoopComparison, name: str) -> Change | None:
    """The change of a figure, where it is clear."""
    unclear = (ChangeVerdict.INCOMPARABLE, ChangeVerdict.UNCLEAR)
    return next((c for c in found.changes if c.measure.name == name and c.verdict not in unclear), None)


def wear_texts(found: LoopComparison, row: Row) -> tuple[str, ...]:
    """What the change means in valve life and in the plant's own cost of error, from numbers that loops.csv states
    alone.

    valve_life_travel_pct : travel after which a valve is overhauled [% of stroke, summed]
    cost_per_error_pct_h : what one percent of average absolute error costs an hour [cost_unit]
    """
    texts = []
    travel, life = _clear_change(found, "valve_travel_pct_per_h"), _stated(row, "valve_life_travel_pct")
    if travel is not None and life is not None:
        a, b = (life / max(v, 1e-9) / HOURS_A_YEAR for v in (travel.found.before, travel.found.after))
        texts.append(f"Valve life at this travel: {number(a)} years before, {number(b)} years after.")
    error, cost = _clear_change(found, "average_absolute_error_pct"), _stated(row, "cost_per_error_pct_h")
    if error is not None and cost is not None:
        unit = json.loads(row.get("extra") or "{}").get("cost_unit", "") or "units of cost"
        low, high = (number(-end * cost * HOURS_A_YEAR) for end in (error.found.high, error.found.low))
        texts.append(f"Saved by the smaller error: {low} to {high} {unit} a year at the stated cost.")
    return tuple(texts)
