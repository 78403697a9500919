"""The before/after page: changes of controllers and their effects, per loop and on average, with evidence."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analyzer.comparison.before_after import (
    LoopComparison,
    grade,
)
from analyzer.comparison.equal_load import LogRatio
from analyzer.comparison.measures import (
    LIMITS,
    MEASURES,
    Change,
    ChangeVerdict,
    Grade,
    Measure,
)
from analyzer.history.plant_clock import UTC_NAME
from analyzer.pages import words
from analyzer.pages.change_cases import ChangeCase
from analyzer.pages.loop_pictures import trend_block
from analyzer.words.units import gain_unit
from reports import pages as parts

HOURS_A_YEAR = 8760.0
PRIMARY = tuple(m for m in MEASURES if m.primary)
"""The study's four figures."""
NINETY = 1.645
"""Standard deviations of a 90 % interval to either side."""
TREND_BUCKETS = 4000
"""Buckets of a trend on this page: two weeks at two pixels a bucket, 64 kB a loop; ours."""
OFFERED = "These changes were not stated but seen in the loops' behaviour: confirm them first."


def outcome(found: LoopComparison) -> str:
    """A loop's result in one phrase, with the reasons why its weeks differ."""

    def of(verdict: ChangeVerdict) -> list[Change]:
        return [c for c in found.primary if c.verdict is verdict]

    reached, won, lost = grade(found), of(ChangeVerdict.BETTER), of(ChangeVerdict.WORSE)
    reasons = "; ".join(found.reasons) or "no hourly figures on both sides"
    text: str = words.texts("outcomes")[reached]["said"].format(
        better=words.enumerated([c.measure.short_title.lower() for c in won]),
        gained=words.enumerated([_figure_text(c) for c in won]),
        lost=words.enumerated([_figure_text(c) for c in lost]),
        reasons=reasons,
    )
    if found.reasons and reached is not Grade.INCOMPARABLE:
        text += f"; this is on equal load because the weeks are not comparable as measured: {reasons}"
    if found.reference is not None and found.reference.of:
        text += f"; the change of {found.reference.loops} unchanged loops of its area is subtracted"
    if found.source_loop:
        text += f"; it follows the oscillation of the neighbour {found.source_loop}, which is the cause"
    return text


def _figure_text(change: Change) -> str:
    """A figure's name, with its own change if it is simulated."""
    name = change.measure.short_title.lower()
    return name if change.parts is None else f"{name} ({words.signed(_percent(change.parts.change.value))} %)"


def _percent(log_ratio: float) -> float:
    return 100.0 * math.expm1(log_ratio)


def _part_cell(part: LogRatio) -> parts.Cell:
    """A part in percent with its 90 % interval."""
    low, high = (words.signed(_percent(end)) for end in part.interval(NINETY))
    value = _percent(part.value)
    return parts.Cell("0" if part.deviation == 0 else f"{words.signed(value)} ({low} … {high})", value)


def _stated(row: words.Row, name: str) -> float | None:
    """A number stated by the plant: a column of the night, or of its JSON of the plant's own columns."""
    columns = json.loads(row.get("extra") or "{}") | {k: v for k, v in row.items() if v is not None}
    try:
        value = float(columns[name])
    except (KeyError, TypeError, ValueError):
        return None
    return value if math.isfinite(value) and value > 0 else None


def _clear_change(found: LoopComparison, name: str) -> Change | None:
    """The change of a figure, if it is clear."""
    unclear = (ChangeVerdict.INCOMPARABLE, ChangeVerdict.UNCLEAR)
    return next((c for c in found.changes if c.measure.name == name and c.verdict not in unclear), None)


def wear_texts(found: LoopComparison, row: words.Row) -> tuple[str, ...]:
    """The effect of the change on valve life and on the plant's cost of error, from numbers in loops.csv.

    valve_life_travel_pct : travel after which a valve is overhauled [% of stroke, summed]
    cost_per_error_pct_h : cost of one percent of average absolute error per hour [cost_unit]
    """
    texts = []
    travel, life = _clear_change(found, "valve_travel_pct_per_h"), _stated(row, "valve_life_travel_pct")
    if travel is not None and life is not None:
        a, b = (life / max(v, 1e-9) / HOURS_A_YEAR for v in (travel.found.before, travel.found.after))
        texts.append(
            f"Valve life at this travel: {words.number(a)} years before, {words.number(b)} years after."
        )
    error, cost = _clear_change(found, "average_absolute_error_pct"), _stated(row, "cost_per_error_pct_h")
    if error is not None and cost is not None:
        unit = json.loads(row.get("extra") or "{}").get("cost_unit", "") or "units of cost"
        low, high = (words.number(-end * cost * HOURS_A_YEAR) for end in (error.found.high, error.found.low))
        texts.append(f"Saved by the smaller error: {low} to {high} {unit} a year at the stated cost.")
    return tuple(texts)


def _outcome_tiles(cases: Sequence[ChangeCase]) -> parts.Tiles:
    """Number of changes with each result, in the order of results."""
    known = words.texts("outcomes")
    counts = Counter(known[grade(c.found)]["tile"] for c in cases)
    tones = {o["tile"]: o["tone"] for o in known.values()}
    shown = ((str(counts[tile]), tile, tone) for tile, tone in tones.items() if counts[tile])
    return parts.Tiles(((str(len(cases)), "changes compared", ""), *shown))


def _row(change: Change, found: LoopComparison, first: bool) -> tuple[words.CellContent, ...]:
    """A figure before and after; the interval is in percent of before, in the figure's unit if that is zero; the
    remark on a loop is in its first row."""
    d, ends, unit = change.found, change.interval_pct, change.measure.unit
    interval = f"{words.number(d.low)} … {words.number(d.high)} {unit}"
    if ends is not None:
        interval = f"{words.signed(ends[0])} … {words.signed(ends[1])} %"
    of = change.parts
    follows = f"follows {found.source_loop}" if found.source_loop else ""
    return (
        *(found.loop, change.measure.title, unit, d.before, d.after),
        parts.Cell(words.signed(change.value_pct), change.value_pct),
        *(interval, d.low, d.high),
        *(("–",) * 4 if of is None else map(_part_cell, (of.change, of.load, of.left, of.promised))),
        parts.Cell(change.verdict.value, kind=_colour(change, found)),
        ("; ".join(found.reasons) or follows) if first else "",
    )


def _colour(change: Change, found: LoopComparison) -> str:
    """The colour of a figure's verdict: the cost in a trade-off is not red."""
    traded = change.verdict is ChangeVerdict.WORSE and grade(found) is Grade.TRADED
    return ChangeVerdict.UNCLEAR.colour if traded else change.verdict.colour


def figures(cases: Sequence[ChangeCase], primary: bool, name: str) -> parts.Table:
    """Figures before and after of all loops (the study's Figure 11)."""
    rows = []
    for case in cases:
        some = [c for c in case.found.changes if c.measure.primary == primary]
        rows += [_row(c, case.found, primary and c is some[0]) for c in some]
    return words.page_table("figures", rows, name=name, searchable=len(rows) > 12)


def _settings_typed(case: ChangeCase) -> str:
    """Old and new settings with their units; otherwise what was detected."""
    change, row = case.change, case.row
    if change.kp_new is None and change.ti_new is None:
        return change.seen or "not stated"
    kp, ti = (
        " → ".join("–" if value is None else f"{value:g}" for value in pair)
        for pair in ((change.kp_old, change.kp_new), (change.ti_old, change.ti_new))
    )
    gain = gain_unit(row["gain_unit"], row["pv_unit"], row["op_unit"])
    return f"Kp {kp}, Ti {ti} ({row['form'] or 'ideal'} form, Kp in {gain}, Ti in {row['ti_unit'] or 's'})"


def _in_short(case: ChangeCase) -> tuple[words.CellContent, ...]:
    """A loop in one row: the new settings, the four changes, and the conclusion."""
    by_name = {c.measure.name: c for c in case.found.primary}
    kind = words.texts("outcomes")[grade(case.found)]["tone"]
    return (
        parts.Cell(case.found.loop, kind="strong"),
        case.row["description"] or "",
        _settings_typed(case),
        *(_change_cell(by_name.get(m.name), case.found) for m in PRIMARY),
        parts.Cell(outcome(case.found), kind=kind),
    )


def _change_cell(change: Change | None, found: LoopComparison) -> parts.Cell:
    """The change's own part if both loops were simulated, otherwise the measured change."""
    if change is None or change.verdict is ChangeVerdict.INCOMPARABLE:
        return parts.Cell("–")
    colour = _colour(change, found)
    if change.parts is not None:
        return replace(_part_cell(change.parts.change), kind=colour)
    if change.interval_pct is None:
        return parts.Cell("–")
    low, high = map(words.signed, change.interval_pct)
    return parts.Cell(f"{words.signed(change.value_pct)} ({low} … {high})", change.value_pct, colour)


def changes_in_short(cases: Sequence[ChangeCase]) -> parts.Table:
    """One row per loop."""
    *first, last = words.page_columns("changes")
    hint = "Change, with its interval"
    four = (parts.Column(m.name, f"{m.short_title}, % of before", True, hint, True) for m in PRIMARY)
    return words.page_table("changes", map(_in_short, cases), columns=(*first, *four, last))


def _change_parts(found: LoopComparison) -> parts.Listing | None:
    """Components of each simulated figure's difference, one line each; None without a simulation."""
    text = words.texts("parts_told")["line"]
    lines = []
    for c in found.primary:
        if c.parts is not None:
            four = (
                _part_cell(part).text
                for part in (c.parts.change, c.parts.load, c.parts.left, c.parts.promised)
            )
            names = ("change", "load", "left", "promised")
            line = text.format(measured=words.signed(c.value_pct), **dict(zip(names, four, strict=True)))
            lines.append((f"{c.measure.title}:", line))
    return parts.Listing(tuple(lines)) if lines else None


def loop_section(case: ChangeCase, number_: int, zone: str = UTC_NAME) -> parts.Section:
    """Results for one loop: settings, spans, remarks, trends (the study's Figure 10)."""
    found, change = case.found, case.change
    spans = [
        f"{words.stamp(s.first_s, zone)} to {words.stamp(s.last_s, zone)} {zone}, {usable_h:.0f} usable hours"
        for s, usable_h in zip((found.before, found.after), found.hours, strict=True)
    ]
    when = f"{words.stamp(change.time_s, zone)} {zone}" + (f" by {change.who}" if change.who else "")
    names = ("Settings", "Changed", "Before", "After")
    facts = parts.Facts(tuple(zip(names, (_settings_typed(case), when, *spans), strict=True)))
    wear = wear_texts(found, case.row)
    blocks: tuple[parts.Block, ...] = parts.without_none(
        words.lead(outcome(found)),
        facts,
        _change_parts(found),
        words.listing(wear) if wear else None,
        _trend(case, number_),
    )
    return parts.Section(f"{found.loop} {case.row['description'] or ''}".strip(), blocks)


def _trend(case: ChangeCase, number_: int) -> parts.Trend | None:
    """Both spans of a loop; None if the store has no trends of them, because they may have been deleted."""
    if case.trend is None:
        return None
    found, marks = case.found, (parts.Mark(case.change.time_s, "changed"),)
    thin = case.trend.between(found.before.first_s, found.after.last_s).coarser(TREND_BUCKETS)
    if thin.time_s.size < 2:
        return None
    title = f"{found.loop}: before and after on one scale"
    return trend_block(f"trend-{number_}", title, thin, marks, words.pv_scale_of(case.row))


def _shown(change: Change) -> tuple[float | None, float | None, float | None]:
    """The change's own part if both loops were simulated, otherwise the measured one, with its ends [% of before]."""
    if change.parts is not None:
        low, high = map(_percent, change.parts.change.interval(NINETY))
        return _percent(change.parts.change.value), low, high
    return change.value_pct, *(change.interval_pct or (None, None))


def per_loop_chart(cases: Sequence[ChangeCase]) -> parts.IntervalChart:
    """Change per loop and assessment (the study's Figure 12)."""
    bars = []
    for case in cases:
        for c in case.found.primary:
            value, low, high = _shown(c)
            text = c.verdict.value if value is None else f"{words.signed(value)} %"
            name, kind = c.measure.short_title, _colour(c, case.found)
            bars.append(parts.IntervalBar(case.found.loop, name, value, low, high, kind, text))
    caption = "Bars: change in % of the span before; lines: its interval. Less is better in all four."
    return parts.IntervalChart(
        "change-per-loop", "Change per loop and assessment", "% of before", tuple(bars), caption
    )


def _average(cases: Sequence[ChangeCase], measure: Measure) -> parts.IntervalBar:
    """Mean of the loops' changes; errors of different loops are assumed independent."""
    changes = [c for case in cases for c in case.found.primary if c.measure.name == measure.name]
    known = [shown for shown in map(_shown, changes) if shown[0] is not None]
    group = words.with_noun(len(known), "loop")
    if not known:
        return parts.IntervalBar(
            group, measure.short_title, None, None, None, "incomparable", "nothing comparable"
        )
    values, ends = np.array(known, float)[:, 0], np.array(known, float)[:, 1:]
    down, up = np.sqrt(((ends - values[:, None]) ** 2).sum(axis=0)) / len(known)
    mean = float(values.mean())
    low, high = max(mean - float(down), -100.0), mean + float(up)
    kind = "unclear" if low <= 0 <= high else "better" if mean < 0 else "worse"
    return parts.IntervalBar(group, measure.short_title, mean, low, high, kind, f"{words.signed(mean)} %")


def average_chart(cases: Sequence[ChangeCase]) -> parts.IntervalChart:
    """Average change of loops that can be compared (the study's Figure 13)."""
    bars = tuple(_average(cases, m) for m in PRIMARY)
    caption = "Mean over all comparable loops, including those that did not improve."
    return parts.IntervalChart("average-change", "Average change", "% of before", bars, caption)


def changes_page(
    cases: Sequence[ChangeCase],
    missing: Sequence[tuple[str, str]],
    subtitle: str,
    offered: bool = False,
    zone: str = UTC_NAME,
) -> parts.Page:
    """The page of all changes on the plant's clock; `missing` could not be analysed, with the reason."""
    lost = parts.Listing(tuple((loop, f"not looked at: {why}") for loop, why in missing)) if missing else None
    seen = parts.Text((OFFERED,)) if offered else None
    comparable = [c for c in cases if grade(c.found) is not Grade.INCOMPARABLE]
    charts = (average_chart(comparable), per_loop_chart(comparable)) if len(comparable) > 1 else ()
    limits = cases[0].found.limits if cases else LIMITS
    values = {"m": limits, "error": 100 * (1 - limits.confidence), "share": 100 * limits.usable_share}
    method = parts.Text(tuple(text.format(**values) for text in words.texts("method").values()))
    sections = parts.without_none(
        parts.section("In short", seen, _outcome_tiles(cases), changes_in_short(cases), lost),
        parts.section("In pictures", *charts),
        *(loop_section(c, i, zone) for i, c in enumerate(cases)),
        parts.Section("Figures before and after", (figures(cases, True, "figures"),), closed=True),
        parts.Section("Other figures", (figures(cases, False, "other-figures"),), closed=True),
        parts.Section("How the figures are made", (method,), closed=True),
    )
    return parts.Page("before-after", "Effects of the changes", subtitle, sections, zone=zone)
