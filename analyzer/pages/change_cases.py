"""The changes of settings that a report compares, stated or detected, with what was found of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analyzer.comparison.before_after import (
    Evidence,
    Hours,
    LoopComparison,
    Reference,
    compare,
    follows,
    reasons_of_load,
    reference,
)
from analyzer.comparison.equal_load import equal_load, weeks_of
from analyzer.comparison.measures import (
    LIMITS,
    Span,
    spans_around,
)
from analyzer.config import ComparisonLimits, Config, FigureLimits
from analyzer.loop.decisions import Action, counts
from analyzer.loops.changes import TuningChange, behaviour_change, stated_changes
from analyzer.pages import words
from analyzer.pages.reading import Thinned, by_loop, nights_within, read_hours, read_nights, read_trends
from analyzer.store.store import Store

COLUMNS = words.keys("of-a-change")
MOST_CONTROLS = 40
"""Maximum number of unchanged loops of an area that are read; ours."""


@dataclass(frozen=True, slots=True)
class ChangeCase:
    """A change with its result, the loop's row of the last night around it, and its trend."""

    change: TuningChange
    found: LoopComparison
    row: words.Row
    trend: Thinned | None


def detected(store: Store, loops: Sequence[str] | None, config: Config) -> list[TuningChange]:
    """Unstated changes: settings that differ between nights, and steps of a controller's behaviour."""
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
    store: Store,
    changes: Sequence[TuningChange],
    days: float = 7.0,
    stated: tuple[Span | None, Span | None] = (None, None),
    limits: ComparisonLimits = LIMITS,
) -> tuple[list[ChangeCase], list[tuple[str, str]]]:
    """All changes with their results, and those that could not be analysed, with the reason.

    Some days on each side are compared, or stated spans; several changes of one loop limit each other's spans.
    """
    if not changes:
        return [], []
    others = ([o.time_s for o in changes if o.loop == c.loop and o != c] for c in changes)
    around = (spans_around(c.time_s, days, own, limits) for c, own in zip(changes, others, strict=True))
    of = [(stated[0] or before, stated[1] or after) for before, after in around]
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
        seen = _evidence(own, hours[change.loop], change, (before, after), limits)
        if seen.simulated is None or not seen.simulated.same:
            seen = replace(
                seen, reference=_reference(store, nights, own[-1], changes, (before, after), limits)
            )
        result = compare(change.loop, hours[change.loop], before, after, source, limits, seen)
        found.append(ChangeCase(change, result, own[-1], trends.get(change.loop)))
    return found, missing


def _evidence(
    rows: Sequence[words.Row],
    hours: Hours,
    change: TuningChange,
    spans: tuple[Span, Span],
    limits: ComparisonLimits,
) -> Evidence:
    """Evidence on a change from a loop's nights, besides its hours."""
    ends = [(span.first_s, span.last_s) for span in spans]
    weeks = weeks_of(rows, ends, (change.kp_old, change.ti_old), (change.kp_new, change.ti_new), limits)
    recorded = any(r["travel_of"] == "stem" for r in rows)
    was_other, is_other = (_works_with_others(rows, span) for span in spans)
    if was_other or is_other:  # nothing can be simulated
        sham = "OP does not follow the new settings: they were not entered"
        return Evidence(() if was_other else (sham,), stem_recorded=recorded)
    if weeks is None:
        return Evidence(stem_recorded=recorded)
    reasons = reasons_of_load(hours, spans, weeks, limits)
    return Evidence(tuple(reasons), equal_load(weeks, limits, FigureLimits()), None, recorded)


def _works_with_others(rows: Sequence[words.Row], span: Span) -> bool:
    """Whether OP shows settings other than the stated ones in most nights of a span."""
    own = [r for r in rows if r["start_s"] is not None and span.first_s <= r["start_s"] < span.last_s]
    return sum(r["action"] == Action.CHECK_SETTINGS for r in own) > 0.5 * len(own)


def _reference(
    store: Store,
    nights: Sequence[str],
    row: words.Row,
    changes: Sequence[TuningChange],
    spans: tuple[Span, Span],
    limits: ComparisonLimits,
) -> Reference | None:
    """Change in loops of the same area without a stated change meanwhile; None with too few, or without areas."""
    if not row["area"]:
        return None
    touched = {c.loop for c in changes}
    rows = store.own_rows("nights", nights[-1], ["loop", "area", "status"])
    alike = [r["loop"] for r in rows if r["area"] == row["area"] and r["loop"] not in touched]
    held = read_hours(store, alike[:MOST_CONTROLS], nights)
    return reference(list(held.values()), *spans, limits)
