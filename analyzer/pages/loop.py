"""The page of one loop: problem, cause, evidence, trends, and history over the nights."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from datetime import date
from statistics import median
from typing import Any
from urllib.parse import quote

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.explain.words import night_note, title
from analyzer.history.plant_clock import UTC_NAME
from analyzer.loop.cost import mark
from analyzer.loop.decisions import CAUSES, Fault, Status
from analyzer.pages import loop_pictures, words
from analyzer.pages.experiments import experiments_section
from analyzer.pages.reading import SIDE_BY_SIDE, Thinned
from analyzer.pages.words import Row, duration, keys, known_figures, lead, number, page_table, stamp, titled
from analyzer.words.belief import wear_text
from analyzer.words.decision import indices
from analyzer.words.orders import order
from analyzer.words.reason import in_short
from analyzer.words.units import row_settings
from identification.mismatch.words import check
from reports import pages as parts
from reports.texts import slug

MOST_SURE_PCT = 99.0  # Largest confidence shown [%]: nothing is certain

WEEK = 7
LEVELS = frozenset({"sp_mean_pct", "pv_mean_pct"})
"""Figures that are positions, not sizes: 0 % is not zero in the loop's own unit."""
CYCLES = {
    "recorded": "",
    "predicted by the model": "predicted_",
    "expected with the new settings": "expected_",
}
"""Limit cycles, and the prefixes of the columns of their periods and amplitudes."""
COLUMNS = keys("of-a-loop", "figures-of-a-night", "model", "shared-valve", "tied-to", "moves")
"""Columns of the table of nights used on a loop's page."""


def loop_page(
    rows: Sequence[Row],
    thin: Thinned | None,
    explained: Row | None = None,
    more: parts.Page | None = None,
    shared: parts.Section | None = None,
    notes: Sequence[str] = (),
    settings: parts.Page | None = None,
) -> parts.Page:
    """A loop's page.

    Parameters
    ----------
    rows : sequence of mapping
        The loop's nights, oldest first; the page is about the last one.
    thin : Thinned or None
        Its trends of the last week.
    explained, more : mapping or None, parts.Page or None
        The night's explanation of the loop (analyzer.columns.EXPLAINED), and its page.
    shared : parts.Section or None
        Its relations to other loops.
    notes : sequence of str
        Users' notes on it, oldest first.
    settings : parts.Page or None
        The page on which settings are simulated; its opening is also shown here.
    """
    row = rows[-1]
    sections = parts.without_none(
        _first_section(row, thin),
        parts.section("Notes", words.listing(reversed(notes)) if notes else None),
        parts.section("What and why", _facts(row, thin), _believed(row) if row["believed_nights"] else None),
        shared,
        experiments_section(row),
        _explained_section(explained, row),
        _evidence_section(row),
        _picture_section(thin, row),
        _moves(row),
        _limit_cycle(row),
        _of_settings(settings),
        _indices(row),
        parts.Section("Figures of the night, for experts", (_figures(row),), closed=True),
        nights_section(rows),
    )
    about = [row["description"], row["type"], row["area"], f"night {row['night']}"]
    links = tuple(_links(row, more, settings, shared is not None))
    return parts.Page(slug(row["loop"]), row["loop"], ", ".join(filter(None, about)), sections, links)


def _links(
    row: Row, more: parts.Page | None, settings: parts.Page | None, shared: bool
) -> Iterator[tuple[str, str]]:
    """Links to all loops, the loop's other pages, its group's page, and a comparison with the loop it follows."""
    yield words.ALL_LOOPS
    if more is not None:
        yield "The explanation", f"{more.name}.html"
    if settings is not None:
        yield "Try settings", f"{settings.name}.html"
    if shared and row["group"]:
        yield "Its group", f"group-{row['group']}.html"
    if row["source_loop"]:
        pair = ",".join(quote(name, safe="") for name in (row["source_loop"], row["loop"]))
        yield f"Compare with {row['source_loop']}", f"{SIDE_BY_SIDE}.html#{pair}"


def _first_section(row: Row, thin: Thinned | None) -> parts.Section:
    """The problem, the action in three lines, and ten periods of the trend."""
    reason, drawn, scale = words.cell(row, "reason").text, None, words.pv_scale_of(row)
    lines = tuple((f"{head}:", text) for head, text in order(row) if text)
    if thin is not None and thin.time_s.size > 1:
        opening = loop_pictures.close_span(row, thin)
        name = "SP, PV and OP" + (", the last ten periods" if opening else "")
        drawn = loop_pictures.trend_block("trend", name, thin, (), scale, opening)
    do, events = parts.Listing(lines) if lines else None, loop_pictures.turn_panels(row, scale)
    return parts.Section(
        "What to do", parts.without_none(lead(reason or "nothing was found"), do, drawn, events)
    )


def manual_since(row: Row, thin: Thinned | None) -> tuple[str, str] | None:
    """Time since which a loop is in manual, as a fact; None if it is not at the end of its trend."""
    spans = () if thin is None else thin.spans(thin.manual)
    if thin is None or not spans or spans[-1][1] < thin.time_s[-1]:
        return None
    first = spans[-1][0]
    since = stamp(first, row["timezone"] or UTC_NAME)
    return "In manual since", since if first > thin.time_s[0] else f"{since} or before"


def _facts(row: Row, thin: Thinned | None) -> parts.Facts:
    """Findings of a loop, linked loops, and its settings."""
    facts = [titled("action", row["action"] or "–"), titled("cause", row["cause"] or "not assessed")]
    shares = [(name, row[name]) for name in (f"osc_{c}_pct" for c in CAUSES)]
    facts += [titled(name, f"{share:.0f}") for name, share in shares if share is not None]
    fault = () if row["valve_fault"] == Fault.NONE else ("valve_fault",)
    facts += [titled(name, row[name]) for name in (*fault, *keys("tied-to")) if row[name]]
    facts += known_figures(row, keys("shared-valve")).items
    if row["period_s"] is not None:
        facts.append(("Period", duration(row["period_s"])))
        facts.append(titled("pv_amplitude_pct", number(row["pv_amplitude_pct"])))
    if row["kp"] is not None:
        source = f", of {row['settings_from']}" if row["settings_from"] else ""
        facts.append(("Settings in force", f"{row_settings(row)} ({row['form']} form{source})"))
    if row["kp_new"] is not None or row["ti_new"] is not None:
        facts.append(("Settings to type in", row_settings(row, "kp_new", "ti_new")))
    facts += filter(None, (manual_since(row, thin),))
    return parts.Facts(tuple(facts))


def _believed(row: Row) -> parts.Facts:
    """Joint results of the nights, and their number."""
    nights = words.with_noun(int(row["believed_nights"]), "night")
    out = [("The verdict is based on", f"{nights} since {row['believed_since']}")]
    if row["worn_nights"]:
        certain = f", certain since {row['certain_since']}" if row["certain_since"] else ""
        sure = "> 99" if row["worn_pct"] > MOST_SURE_PCT else f"{row['worn_pct']:.0f}"
        out.append(("Probability of a worn valve", f"{sure} %{certain}"))
    if row["certain_since"] and row["width_pct"] is not None:
        ends = f"{number(row['width_low_pct'])} … {number(row['width_high_pct'])}"
        out.append(("Backlash or stickband, all nights", f"{number(row['width_pct'])} % of OP ({ends})"))
    if row["wear_pct_per_month"] is not None:
        out.append(("Wear", wear_text(row)))
    return parts.Facts(tuple(out))


def _explained_section(found: Row | None, row: Row) -> parts.Section | None:
    """Effects that the baseline model does not include, if explained, and agreement with the night's verdict."""
    if found is None:
        return None
    together = night_note(row, found["verdict"], found["block"])
    reasons = (f"{title(found['verdict']).capitalize()}: {found['reason']}", check(found))
    return parts.Section(
        "Physics missing in the baseline model", (parts.Text((*reasons, together) if together else reasons),)
    )


def _evidence_section(row: Row) -> parts.Section:
    """Further clauses of the reason, the evidence, the model, the advice and missing data."""
    signs = sorted(json.loads(row["signs"] or "[]"), key=lambda s: -s["strength"])
    rows = [
        (
            words.cause_cell(s["points_to"]),
            parts.Cell(f"{s['strength']:.2f}", s["strength"]),
            f"{s['text']} ({s['figures']})" if s.get("figures") else s["text"],
        )
        for s in signs
    ]
    more = in_short(row["reason"] or "")[1]
    known = known_figures(row, keys("model"))
    blocks: tuple[parts.Block, ...] = parts.without_none(
        parts.Text(lead(more).paragraphs) if more else None,
        page_table("evidence", rows) if rows else parts.Text(("No sign of a fault.",)),
        known if known.items else None,
        parts.Text((f"Basis of the advice: {row['advice']}",)) if row["advice"] else None,
        parts.Text((f"About the data: {row['notes']}.",), "note") if row["notes"] else None,
    )
    return parts.Section("Evidence, for experts", blocks, closed=True)


def _picture_section(thin: Thinned | None, row: Row) -> parts.Section | None:
    """The last night's PV over OP, and the autocorrelation of its error."""
    if thin is None or thin.time_s.size < 2:
        return None
    last = thin.between(row["start_s"] or 0.0, float("inf"))
    rhythm = loop_pictures.rhythm_plots(last, row["period_s"])
    title = "PV over OP, autocorrelation and spectrum"
    return parts.Section(title, (loop_pictures.pv_over_op(last, row), *rhythm))


def _moves(row: Row) -> parts.Section | None:
    """Response of PV to set point moves, if there were any."""
    drawn = loop_pictures.answered_moves(row)
    if drawn is None:
        return None
    growing = parts.Text((row["growing"] + ".",), "lead") if row["growing"] else None
    return parts.section(
        "Moves of the set point", growing, known_figures(row, keys("moves")), drawn, _phases(row)
    )


def _phases(row: Row) -> parts.Table | None:
    """Repeated moves of a programme, one row per kind: count, and medians of their responses."""
    low, span = row["pv_lo"] or 0.0, (row["pv_hi"] or 100.0) - (row["pv_lo"] or 0.0)
    rows = []
    for phase in json.loads(row["phases"] or "[]"):
        ends = (low + span * phase[k] / 100.0 for k in ("begin", "end"))
        settled = [s for s in phase["settled_s"] if s is not None]
        middles = median(phase["overshoot_pct"]), median(settled) if settled else None
        rows.append((*ends, len(phase["start_s"]), *middles))
    unit = f"Levels in {row['pv_unit']}." if row["pv_unit"] else ""
    return page_table("phases", rows, note=unit) if rows else None


def _limit_cycle(row: Row) -> parts.Section | None:
    """Recorded and predicted limit cycle, and that with new settings, if the night has them."""
    known = [(name, row[f"{of}period_s"], row[f"{of}pv_amplitude_pct"]) for name, of in CYCLES.items()]
    rows = [(name, parts.Cell(duration(p), p), size) for name, p, size in known if p is not None]
    return parts.Section("Limit cycle", (page_table("limit-cycle", rows),)) if len(rows) > 1 else None


def _of_settings(found: parts.Page | None) -> parts.Section | None:
    """Opening of the settings page: gains and losses, in a sentence and a picture."""
    if found is None:
        return None
    first = found.sections[0]
    return parts.section(first.title, *(b for b in first.blocks if isinstance(b, parts.Text | parts.Plot)))


def _indices(row: Row) -> parts.Section | None:
    """The published indices, the conclusion of each publication, and the project's own conclusion."""
    labels, width = words.texts("field_indices"), row["backlash_pct"] or row["stickband_pct"]
    fault = row["valve_fault"] or row["cause"] or "not assessed"
    ours = {
        "valve": fault,
        "linear": fault,
        "width": "–" if width is None else f"{number(width)} %",
        "cycle": f"{row['oscillating_pct'] or 0.0:.0f} % of the time",
        "slow": row["action"] or "–",
        "variance": "–",
    }
    rows = []
    for found in indices(row):
        index = labels[found["index"]]
        sees = labels["sees"][index["of"]]
        concludes = sees if isinstance(sees, str) else sees[str(found["finds"]).lower()]
        rows.append((index["name"], ", ".join(map(number, found["values"])), concludes, ours[index["of"]]))
    if not rows:
        return None
    return parts.Section("Indices of the literature", (page_table("indices", rows),), closed=True)


def _figures(row: Row) -> parts.Facts:
    """The known figures of the night, with the loop's own unit if they are percentages of span."""
    facts, scale = [], words.pv_scale_of(row)
    for name in keys("figures-of-a-night"):
        if row[name] is not None:
            term, text = titled(name, number(row[name]) + mark(row, name))
            own = "" if name in LEVELS else words.in_loop_unit(BY_NAME[name].unit, row[name], scale)
            facts.append((term, text + own))
    return parts.Facts(tuple(facts))


def nights_section(rows: Sequence[Row]) -> parts.Section:
    """A table of a loop's nights, the last first, and pictures of its oscillation and of the width of its valve's
    fault over time."""
    day = rows[-1]["night"][:10]
    plots = [
        _over_nights(f"nights-{slug(c)}", BY_NAME[c].title, BY_NAME[c].unit, 0.0, day, _by_night(rows, c))
        for c in keys("figures-over-nights")
    ]
    if rows[-1]["certain_since"]:
        alone = [(json.loads(r["witness"] or "{}").get("width") or [None])[0] for r in rows]
        certain = [r["width_pct"] if r["certain_since"] else None for r in rows]
        marked = [{**r, "alone": a, "certain": c} for r, a, c in zip(rows, alone, certain, strict=True)]
        lines = (
            _by_night(marked, "alone", joined=False),
            _by_night(marked, "certain", "nights together", kind="op"),
        )
        plots.append(_over_nights("widths", "Width of the valve's fault", "% of OP", 1.0, day, *lines))
    shown = parts.without_none(*plots)
    drawn = parts.Panels("nights", "Night by night", shown) if shown else None
    table = page_table("history", map(_night_cells, reversed(rows)))
    return parts.Section("Over the nights", parts.without_none(drawn, table))


def _night_cells(row: Row) -> tuple[words.CellContent, ...]:
    """One night's cells; the last gives the reason if the loop was not assessed."""
    lost = {} if row["status"] == Status.OK else {"action": f"{row['status']}: {row['reason']}"}
    return words.cells(row, "history", **lost)


def _by_night(rows: Sequence[Row], column: str, label: str = "each night", **drawn: Any) -> parts.Line:
    """A figure over the days up to the last night, where known."""
    days = [float(date.fromisoformat(r["night"][:10]).toordinal()) for r in rows]
    known = [(x - days[-1], r[column]) for x, r in zip(days, rows, strict=True) if r[column] is not None]
    x, y = np.array(known, float).reshape(-1, 2).T
    return parts.Line(label, x, y, **drawn)


def _over_nights(
    name: str, title: str, unit: str, least: float, day: str, *lines: parts.Line
) -> parts.Plot | None:
    """Figures over the nights up to a day, from 0 to at least `least`; None if it is known in fewer than three
    nights."""
    if min(line.x.size for line in lines) < 3:
        return None
    return parts.Plot(name, title, "night", unit, lines, reach=(0.0, least), day=day)
