"""The before/after page: what retuning brought, per loop and on average, with proof."""

from __future__ import annotations

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
from analyzer.config import ComparisonLimits
from analyzer.history.plant_clock import UTC_NAME
from analyzer.pages.changes import ChangeCase, outcome, wear_texts
from analyzer.pages.loop_pictures import trend_block
from analyzer.pages.words import (
    cell,
    number,
    page_columns,
    plain_cell,
    pv_scale_of,
    signed,
    stamp,
    texts,
    with_noun,
)
from analyzer.words.units import gain_unit
from reports.pages import (
    Block,
    Cell,
    Column,
    Facts,
    IntervalBar,
    IntervalChart,
    Listing,
    Mark,
    Page,
    Section,
    Table,
    Text,
    Tiles,
)

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


def _outcome_tiles(cases: Sequence[ChangeCase]) -> Tiles:
    known = texts("outcomes")
    found = [known[grade(c.found)] for c in cases]
    counts = {o["tile"]: (sum(x["tile"] == o["tile"] for x in found), o["tone"]) for o in known.values()}
    shown = ((str(n), tile, tone) for tile, (n, tone) in counts.items() if n)
    return Tiles(((str(len(cases)), "changes looked at", ""), *shown))


def _interval(change: Change) -> str:
    """The interval of a change in percent of before, or in the figure's unit where before is zero."""
    ends = change.interval_pct
    if ends is None:
        return f"{number(change.found.low)} … {number(change.found.high)} {change.measure.unit}"
    return f"{signed(ends[0])} … {signed(ends[1])} %"


def _row(change: Change, found: LoopComparison) -> tuple[Cell, ...]:
    d = change.found
    remark = "; ".join(found.reasons) or (f"follows {found.source_loop}" if found.source_loop else "")
    return (
        Cell(found.loop),
        Cell(change.measure.title),
        Cell(change.measure.unit),
        plain_cell(d.before),
        plain_cell(d.after),
        Cell(signed(change.value_pct), change.value_pct),
        Cell(_interval(change)),
        plain_cell(d.low),
        plain_cell(d.high),
        Cell(change.verdict.value, kind=KINDS[change.verdict]),
        Cell(remark),
    )


def figures(cases: Sequence[ChangeCase], primary: bool, name: str) -> Table:
    """Figures before and after of all loops (the study's Figure 11)."""
    rows = [_row(c, case.found) for case in cases for c in case.found.changes if c.measure.primary == primary]
    return Table(
        name, "", page_columns("figures"), tuple(rows), searchable=len(rows) > 12, facets=("verdict",)
    )


def _setting(value: float | None) -> str:
    return "–" if value is None else f"{value:g}"


def _settings_typed(case: ChangeCase) -> str:
    change, row = case.change, case.row
    if change.kp_new is None and change.ti_new is None:
        return change.seen or "not stated"
    pairs = (("Kp", change.kp_old, change.kp_new), ("Ti", change.ti_old, change.ti_new))
    said = ", ".join(f"{name} {_setting(old)} → {_setting(new)}" for name, old, new in pairs)
    gain = gain_unit(row["gain_unit"], row["pv_unit"], row["op_unit"])
    return f"{said} ({row['form'] or 'ideal'} form, Kp in {gain}, Ti in {row['ti_unit'] or 's'})"


def _in_short(case: ChangeCase) -> tuple[Cell, ...]:
    """A loop in one row: what was typed in, the four changes, and what to make of them."""
    by_name = {c.measure.name: c for c in case.found.primary}
    kind = texts("outcomes")[grade(case.found)]["tone"]
    return (
        Cell(case.found.loop, kind="strong"),
        cell(case.row, "description"),
        Cell(_settings_typed(case)),
        *(_change_cell(by_name.get(m.name)) for m in PRIMARY),
        Cell(outcome(case.found), kind=kind),
    )


def _change_cell(change: Change | None) -> Cell:
    if change is None or change.verdict is ChangeVerdict.INCOMPARABLE or change.interval_pct is None:
        return Cell("–")
    low, high = (signed(x) for x in change.interval_pct)
    return Cell(f"{signed(change.value_pct)} ({low} … {high})", change.value_pct, KINDS[change.verdict])


def changes_in_short(cases: Sequence[ChangeCase]) -> Table:
    """A row a loop."""
    note = "Change of each figure in % of what it was before, with its interval; less is better in all four."
    *first, last = page_columns("changes")
    hint = "Change, with its interval"
    four = (Column(m.name, f"{m.short_title}, % of before", True, hint, True) for m in PRIMARY)
    return Table("loops", "", (*first, *four, last), tuple(map(_in_short, cases)), note, cards=True)


def _span_text(first_s: float, last_s: float, usable_h: float, zone: str) -> str:
    return f"{stamp(first_s, zone)} to {stamp(last_s, zone)} {zone}, {usable_h:.0f} usable hours"


def loop_section(case: ChangeCase, number_: int, zone: str = UTC_NAME) -> Section:
    """What became of one loop: settings, spans, remarks, trends (the study's Figure 10)."""
    found, change = case.found, case.change
    facts = (
        ("Settings", _settings_typed(case)),
        ("Changed", f"{stamp(change.time_s, zone)} {zone}" + (f" by {change.who}" if change.who else "")),
        ("Before", _span_text(found.before.first_s, found.before.last_s, found.hours[0], zone)),
        ("After", _span_text(found.after.first_s, found.after.last_s, found.hours[1], zone)),
    )
    text = outcome(found)
    blocks: list[Block] = [Text((text[:1].upper() + text[1:] + ".",), "lead"), Facts(facts)]
    wear = wear_texts(found, case.row)
    if wear:
        blocks.append(Listing(tuple(("", text) for text in wear)))
    if case.trend is not None and case.trend.time_s.size > 1:
        thin = case.trend.between(found.before.first_s, found.after.last_s).coarser(TREND_BUCKETS)
        marks = (Mark(change.time_s, "changed"),)
        title = f"{found.loop}: before and after on one scale"
        if thin.time_s.size > 1:  # trends may have been pruned where hours were kept
            blocks.append(trend_block(f"trend-{number_}", title, thin, marks, pv_scale_of(case.row)))
    title = f"{found.loop} {case.row['description'] or ''}".strip()
    return Section(title, tuple(blocks))


def _bar(change: Change, group: str) -> IntervalBar:
    ends = change.interval_pct
    low, high = ends if ends else (None, None)
    text = f"{signed(change.value_pct)} %" if ends else change.verdict.value
    title, kind = change.measure.short_title, KINDS[change.verdict]
    return IntervalBar(group, title, change.value_pct, low, high, kind, text)


def per_loop_chart(cases: Sequence[ChangeCase]) -> IntervalChart:
    """Change per loop and assessment (the study's Figure 12)."""
    bars = tuple(_bar(c, case.found.loop) for case in cases for c in case.found.primary)
    caption = "Bars: change in % of the span before; lines: its interval. Less is better in all four."
    return IntervalChart("change-per-loop", "Change per loop and assessment", "% of before", bars, caption)


def _average(cases: Sequence[ChangeCase], measure: Measure) -> IntervalBar:
    """Mean of the comparable loops' changes; errors of different loops taken as independent."""
    changes = [c for case in cases for c in case.found.primary if c.measure == measure]
    known = [c for c in changes if c.verdict is not ChangeVerdict.INCOMPARABLE and c.value_pct is not None]
    group = with_noun(len(known), "loop")
    if not known:
        return IntervalBar(group, measure.short_title, None, None, None, "incomparable", "nothing comparable")
    values = np.array([c.value_pct for c in known], float)
    ends = np.array([c.interval_pct for c in known], float)
    down, up = (float(np.sqrt(((ends[:, k] - values) ** 2).sum()) / len(known)) for k in (0, 1))
    mean = float(values.mean())
    low, high = max(mean - down, -100.0), mean + up
    kind = "unclear" if low <= 0 <= high else "better" if mean < 0 else "worse"
    return IntervalBar(group, measure.short_title, mean, low, high, kind, f"{signed(mean)} %")


def average_chart(cases: Sequence[ChangeCase]) -> IntervalChart:
    """Average change of all comparable loops (the study's Figure 13)."""
    bars = tuple(_average(cases, m) for m in PRIMARY)
    caption = "Mean over the loops that can be compared; loops that were not better count as they are."
    return IntervalChart("average-change", "Average change", "% of before", bars, caption)


def _method(limits: ComparisonLimits) -> Section:
    said = {"m": limits, "error": 100 * (1 - limits.confidence), "share": 100 * limits.usable_share}
    return Section(
        "How the figures are made",
        (Text(tuple(t.format(**said) for t in texts("method").values())),),
        closed=True,
    )


OFFERED = "These changes were not stated but seen in the loops' behaviour: confirm them first."


def changes_page(
    cases: Sequence[ChangeCase],
    missing: Sequence[tuple[str, str]],
    subtitle: str,
    offered: bool = False,
    zone: str = UTC_NAME,
) -> Page:
    """The page of all changes on the plant's clock; `missing` could not be looked at, with the reason."""
    short: list[Block] = [Text((OFFERED,))] if offered else []
    short += [_outcome_tiles(cases), changes_in_short(cases)]
    if missing:
        short.append(Listing(tuple((loop, f"not looked at: {why}") for loop, why in missing)))
    comparable = [
        c for c in cases if any(x.verdict is not ChangeVerdict.INCOMPARABLE for x in c.found.primary)
    ]
    charts = (average_chart(cases), per_loop_chart(comparable)) if len(comparable) > 1 else ()
    sections = (
        Section("In short", tuple(short)),
        *((Section("In pictures", charts),) if charts else ()),
        *(loop_section(c, i, zone) for i, c in enumerate(cases)),
        Section("Figures before and after", (figures(cases, True, "figures"),), closed=True),
        Section("Other figures", (figures(cases, False, "other-figures"),), closed=True),
        _method(cases[0].found.limits if cases else LIMITS),
    )
    return Page("before-after", "What the changes brought", subtitle, sections, zone=zone)
