"""The before/after page: what retuning brought, per loop and on average, with proof."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from analyzer.comparison.before_after import (
    LIMITS,
    MEASURES,
    Change,
    ChangeVerdict,
    LoopComparison,
    Measure,
    grade,
)
from analyzer.history.plant_clock import UTC_NAME
from analyzer.pages import words
from analyzer.pages.changes import ChangeCase, outcome, wear_texts
from analyzer.pages.loop_pictures import trend_block
from analyzer.words.units import gain_unit
from reports import pages as parts

PRIMARY = tuple(m for m in MEASURES if m.primary)
"""The study's four figures."""
KINDS = {
    ChangeVerdict.BETTER: "better",
    ChangeVerdict.WORSE: "worse",
    ChangeVerdict.UNCLEAR: "unclear",
    ChangeVerdict.INCOMPARABLE: "incomparable",
}
"""Colour of each verdict."""
TREND_BUCKETS = 4000
"""Buckets of a trend on this page: two weeks at two pixels a bucket, 64 kB a loop; ours."""
OFFERED = "These changes were not stated but seen in the loops' behaviour: confirm them first."


def _outcome_tiles(cases: Sequence[ChangeCase]) -> parts.Tiles:
    """How many changes came out how, in the order of the outcomes."""
    known = words.texts("outcomes")
    counts = Counter(known[grade(c.found)]["tile"] for c in cases)
    tones = {o["tile"]: o["tone"] for o in known.values()}
    shown = ((str(counts[tile]), tile, tone) for tile, tone in tones.items() if counts[tile])
    return parts.Tiles(((str(len(cases)), "changes looked at", ""), *shown))


def _row(change: Change, found: LoopComparison) -> tuple[parts.Cell, ...]:
    """A figure before and after; the interval is in percent of before, in the figure's unit where that is zero."""
    d, ends, unit = change.found, change.interval_pct, change.measure.unit
    interval = f"{words.number(d.low)} … {words.number(d.high)} {unit}"
    if ends is not None:
        interval = f"{words.signed(ends[0])} … {words.signed(ends[1])} %"
    follows = f"follows {found.source_loop}" if found.source_loop else ""
    return (
        *map(parts.Cell, (found.loop, change.measure.title, unit)),
        *map(words.plain_cell, (d.before, d.after)),
        parts.Cell(words.signed(change.value_pct), change.value_pct),
        parts.Cell(interval),
        *map(words.plain_cell, (d.low, d.high)),
        parts.Cell(change.verdict.value, kind=KINDS[change.verdict]),
        parts.Cell("; ".join(found.reasons) or follows),
    )


def figures(cases: Sequence[ChangeCase], primary: bool, name: str) -> parts.Table:
    """Figures before and after of all loops (the study's Figure 11)."""
    rows = [_row(c, case.found) for case in cases for c in case.found.changes if c.measure.primary == primary]
    return words.page_table("figures", rows, name=name, searchable=len(rows) > 12)


def _settings_typed(case: ChangeCase) -> str:
    """Old and new settings with their units; else what was seen."""
    change, row = case.change, case.row
    if change.kp_new is None and change.ti_new is None:
        return change.seen or "not stated"
    kp, ti = (
        " → ".join("–" if value is None else f"{value:g}" for value in pair)
        for pair in ((change.kp_old, change.kp_new), (change.ti_old, change.ti_new))
    )
    gain = gain_unit(row["gain_unit"], row["pv_unit"], row["op_unit"])
    return f"Kp {kp}, Ti {ti} ({row['form'] or 'ideal'} form, Kp in {gain}, Ti in {row['ti_unit'] or 's'})"


def _in_short(case: ChangeCase) -> tuple[parts.Cell, ...]:
    """A loop in one row: what was typed in, the four changes, and what to make of them."""
    by_name = {c.measure.name: c for c in case.found.primary}
    kind = words.texts("outcomes")[grade(case.found)]["tone"]
    return (
        parts.Cell(case.found.loop, kind="strong"),
        words.cell(case.row, "description"),
        parts.Cell(_settings_typed(case)),
        *(_change_cell(by_name.get(m.name)) for m in PRIMARY),
        parts.Cell(outcome(case.found), kind=kind),
    )


def _change_cell(change: Change | None) -> parts.Cell:
    if change is None or change.verdict is ChangeVerdict.INCOMPARABLE or change.interval_pct is None:
        return parts.Cell("–")
    low, high = map(words.signed, change.interval_pct)
    return parts.Cell(
        f"{words.signed(change.value_pct)} ({low} … {high})", change.value_pct, KINDS[change.verdict]
    )


def changes_in_short(cases: Sequence[ChangeCase]) -> parts.Table:
    """A row a loop."""
    *first, last = words.page_columns("changes")
    hint = "Change, with its interval"
    four = (parts.Column(m.name, f"{m.short_title}, % of before", True, hint, True) for m in PRIMARY)
    return words.page_table("changes", map(_in_short, cases), columns=(*first, *four, last))


def loop_section(case: ChangeCase, number_: int, zone: str = UTC_NAME) -> parts.Section:
    """What became of one loop: settings, spans, remarks, trends (the study's Figure 10)."""
    found, change = case.found, case.change
    spans = [
        f"{words.stamp(s.first_s, zone)} to {words.stamp(s.last_s, zone)} {zone}, {usable_h:.0f} usable hours"
        for s, usable_h in zip((found.before, found.after), found.hours, strict=True)
    ]
    when = f"{words.stamp(change.time_s, zone)} {zone}" + (f" by {change.who}" if change.who else "")
    names = ("Settings", "Changed", "Before", "After")
    facts = parts.Facts(tuple(zip(names, (_settings_typed(case), when, *spans), strict=True)))
    wear = wear_texts(found, case.row)
    blocks: tuple[parts.Block, ...] = parts.there(
        words.lead(outcome(found)), facts, words.listing(wear) if wear else None, _trend(case, number_)
    )
    return parts.Section(f"{found.loop} {case.row['description'] or ''}".strip(), blocks)


def _trend(case: ChangeCase, number_: int) -> parts.Trend | None:
    """Both spans of a loop; None where the store holds no trends of them, for they may have been pruned."""
    if case.trend is None or case.trend.time_s.size < 2:
        return None
    found, marks = case.found, (parts.Mark(case.change.time_s, "changed"),)
    thin = case.trend.between(found.before.first_s, found.after.last_s).coarser(TREND_BUCKETS)
    title = f"{found.loop}: before and after on one scale"
    if thin.time_s.size < 2:
        return None
    return trend_block(f"trend-{number_}", title, thin, marks, words.pv_scale_of(case.row))


def per_loop_chart(cases: Sequence[ChangeCase]) -> parts.IntervalChart:
    """Change per loop and assessment (the study's Figure 12)."""
    bars = []
    for case in cases:
        for c in case.found.primary:
            low, high = c.interval_pct or (None, None)
            text = f"{words.signed(c.value_pct)} %" if c.interval_pct else c.verdict.value
            name, kind = c.measure.short_title, KINDS[c.verdict]
            bars.append(parts.IntervalBar(case.found.loop, name, c.value_pct, low, high, kind, text))
    caption = "Bars: change in % of the span before; lines: its interval. Less is better in all four."
    return parts.IntervalChart(
        "change-per-loop", "Change per loop and assessment", "% of before", tuple(bars), caption
    )


def _average(cases: Sequence[ChangeCase], measure: Measure) -> parts.IntervalBar:
    """Mean of the comparable loops' changes; errors of different loops taken as independent."""
    changes = [c for case in cases for c in case.found.primary if c.measure == measure]
    known = [c for c in changes if c.verdict is not ChangeVerdict.INCOMPARABLE and c.value_pct is not None]
    group = words.with_noun(len(known), "loop")
    if not known:
        return parts.IntervalBar(
            group, measure.short_title, None, None, None, "incomparable", "nothing comparable"
        )
    values = np.array([c.value_pct for c in known], float)
    ends = np.array([c.interval_pct for c in known], float)
    down, up = np.sqrt(((ends - values[:, None]) ** 2).sum(axis=0)) / len(known)
    mean = float(values.mean())
    low, high = max(mean - float(down), -100.0), mean + float(up)
    kind = "unclear" if low <= 0 <= high else "better" if mean < 0 else "worse"
    return parts.IntervalBar(group, measure.short_title, mean, low, high, kind, f"{words.signed(mean)} %")


def average_chart(cases: Sequence[ChangeCase]) -> parts.IntervalChart:
    """Average change of all comparable loops (the study's Figure 13)."""
    bars = tuple(_average(cases, m) for m in PRIMARY)
    caption = "Mean over the loops that can be compared; loops that were not better count as they are."
    return parts.IntervalChart("average-change", "Average change", "% of before", bars, caption)


def changes_page(
    cases: Sequence[ChangeCase],
    missing: Sequence[tuple[str, str]],
    subtitle: str,
    offered: bool = False,
    zone: str = UTC_NAME,
) -> parts.Page:
    """The page of all changes on the plant's clock; `missing` could not be looked at, with the reason."""
    lost = parts.Listing(tuple((loop, f"not looked at: {why}") for loop, why in missing)) if missing else None
    seen = parts.Text((OFFERED,)) if offered else None
    told = [(c, {x.verdict for x in c.found.primary} - {ChangeVerdict.INCOMPARABLE}) for c in cases]
    comparable = [c for c, verdicts in told if verdicts]
    charts = (average_chart(cases), per_loop_chart(comparable)) if len(comparable) > 1 else ()
    limits = cases[0].found.limits if cases else LIMITS
    said = {"m": limits, "error": 100 * (1 - limits.confidence), "share": 100 * limits.usable_share}
    method = parts.Text(tuple(text.format(**said) for text in words.texts("method").values()))
    sections = parts.there(
        parts.section("In short", seen, _outcome_tiles(cases), changes_in_short(cases), lost),
        parts.section("In pictures", *charts),
        *(loop_section(c, i, zone) for i, c in enumerate(cases)),
        parts.Section("Figures before and after", (figures(cases, True, "figures"),), closed=True),
        parts.Section("Other figures", (figures(cases, False, "other-figures"),), closed=True),
        parts.Section("How the figures are made", (method,), closed=True),
    )
    return parts.Page("before-after", "What the changes brought", subtitle, sections, zone=zone)
