"""The page of one loop: what, why, the evidence, the trends, and how it was over the nights."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from statistics import median
from typing import Any
from urllib.parse import quote

import numpy as np

from analyzer.columns import BY_NAME
from analyzer.explain.words import agreement, title
from analyzer.limits import PAGES
from analyzer.loop.cost import mark
from analyzer.loop.decisions import CAUSES, Fault, Status
from analyzer.pages.loop_pictures import (
    answered_moves,
    close_span,
    pv_over_op,
    rhythm_plots,
    trend_block,
    turn_panels,
)
from analyzer.pages.maintenance import work_order
from analyzer.pages.reading import BESIDE, Thinned
from analyzer.pages.words import (
    ALL_LOOPS,
    PvScale,
    Row,
    beside,
    cause_cell,
    cell,
    cells,
    duration,
    number,
    page_columns,
    plain_cell,
    pv_scale_of,
    titled,
    with_noun,
)
from analyzer.words.belief import wear_text
from analyzer.words.reason import in_short
from analyzer.words.units import row_settings
from identification.mismatch.words import check
from reports.pages import Block, Cell, Facts, Line, Listing, Page, Panels, Plot, Section, Table, Text
from reports.texts import slug

WEEK = 7
OVER_NIGHTS = ("oscillation_significance", "average_absolute_error_pct", "valve_travel_pct_per_h", "period_s")
"""Figures of a loop that are drawn night by night."""
FIGURES = (
    *("oscillation_significance", "oscillating_pct", "average_absolute_error_pct", "variability_pct"),
    *("valve_travel_pct_per_h", "reversals_per_h", "crossings_per_h", "noise_band_pct", "harris_index"),
    *("regularity", "normal_pct", "at_limits_pct", "service_pct", "usable_h"),
    *("sp_mean_pct", "pv_mean_pct", "op_mean_pct", "manual_pct", "frozen_pct", "lasting_error_pct"),
    *("error_memory_ti", "loss"),
)
MODEL = (
    *("gain", "time_constant_s", "slope_pct_per_s", "dead_time_s", "backlash_pct", "stickband_pct"),
    "slip_jump_pct",
)
SHARED = (
    *("valve_pct", "changeovers_per_h", "winds_up_pct", "takeover_s"),
    *("split_at_pct", "split_slope", "half_slope"),
)
"""Figures of a loop that shares a valve, or works half of a split range."""
BUILT = ("source_loop", "master", "ratio_of", "split_of", "override_with")
"""Other loops to which it is tied."""
LEVELS = frozenset({"sp_mean_pct", "pv_mean_pct"})
"""Figures that are places and no sizes: their own unit has another zero."""
LIKELIHOOD = ("evidence", "valve_size")
CYCLES = (
    ("recorded", "period_s", "pv_amplitude_pct"),
    ("predicted by the model", "predicted_period_s", "predicted_pv_amplitude_pct"),
    ("expected with the new settings", "expected_period_s", "expected_pv_amplitude_pct"),
)
COLUMNS = (
    *("loop", "type", "area", "description", "pv_unit", "op_unit", "status", "reason", "action", "cause"),
    *("valve_fault", "pv_lo", "pv_hi", "close_first_s", "close_last_s", "lanes", "evidence", "valve_size"),
    *("timezone", "lack", "turns", "group", *BUILT),
    *(f"osc_{cause}_pct" for cause in CAUSES),
    *("kp", "ti", "kp_new", "ti_new", "settings_from", "form", "gain_unit", "ti_unit", "signs", "notes"),
    *("advice", "start_s", "percent_of", *FIGURES, *MODEL),
    *("witness", "believed_nights", "believed_since", "worn_pct", "worn_nights", "certain_since"),
    *("width_pct", "width_low_pct", "width_high_pct", "wear_pct_per_month", "wear_low_pct", "wear_high_pct"),
    *("wear_since", "reaches_pct", "reaches_from", "reaches_by"),
    *("sp_moves", "rise_time_s", "overshoot_pct", "settling_time_s", "moves"),
    *("phases", "growing", *SHARED),
    *(name for _, period, amplitude in CYCLES for name in (period, amplitude)),
)
"""What a loop's page reads of the table of nights."""


def _known_figures(row: Row, names: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Figures that the night knows, with their titles and units."""
    return tuple(titled(name, number(row[name])) for name in names if row[name] is not None)


def _facts(row: Row) -> Facts:
    facts = [titled("action", row["action"] or "–"), titled("cause", row["cause"] or "not assessed")]
    shares = [(c, row[f"osc_{c}_pct"]) for c in CAUSES]
    facts += [titled(f"osc_{c}_pct", f"{share:.0f}") for c, share in shares if share is not None]
    fault = () if row["valve_fault"] == Fault.NONE else ("valve_fault",)
    facts += [titled(name, row[name]) for name in (*fault, *BUILT) if row[name]]
    facts += _known_figures(row, SHARED)
    if row["period_s"] is not None:
        facts.append(("Period", duration(row["period_s"])))
        facts.append(titled("pv_amplitude_pct", number(row["pv_amplitude_pct"])))
    if row["kp"] is not None:
        source = f", of {row['settings_from']}" if row["settings_from"] else ""
        facts.append(("Settings in force", f"{row_settings(row)} ({row['form']} form{source})"))
    if row["kp_new"] is not None or row["ti_new"] is not None:
        facts.append(("Settings to type in", row_settings(row, "kp_new", "ti_new")))
    return Facts(tuple(facts))


def _notes(notes: Sequence[str]) -> tuple[Section, ...]:
    """What people wrote, the newest first."""
    return (Section("Notes", (Listing(tuple(("", n) for n in reversed(notes))),)),) if notes else ()


def _first_section(row: Row, thin: Thinned | None) -> Section:
    """What is wrong, what to do in three lines, and ten periods of it."""
    reason = cell(row, "reason").text or "nothing was found"
    blocks: list[Block] = [Text((reason[:1].upper() + reason[1:] + ".",), "lead")]
    order = work_order(row)
    if order:
        blocks.append(Listing(tuple((f"{lead}:", text) for lead, text in order if text)))
    if thin is not None and thin.time_s.size > 1:
        opening = close_span(row, thin)
        title = "SP, PV and OP" + (", the last ten periods" if opening else "")
        blocks.append(trend_block("trend", title, thin, (), pv_scale_of(row), opening))
    events = turn_panels(row, pv_scale_of(row))
    if events is not None:
        blocks.append(events)
    return Section("What to do", tuple(blocks))


def _verdict_section(row: Row) -> Section:
    """What was found, and on how many nights it rests."""
    believed = (Facts(_believed(row)),) if row["believed_nights"] else ()
    return Section("What and why", (_facts(row), *believed))


def _evidence_section(row: Row) -> Section:
    signs = sorted(json.loads(row["signs"] or "[]"), key=lambda s: -s["strength"])
    rows = tuple(
        (
            cause_cell(s["points_to"]),
            Cell(f"{s['strength']:.2f}", s["strength"]),
            Cell(f"{s['text']} ({s['figures']})" if s.get("figures") else s["text"]),
        )
        for s in signs
    )
    blocks: list[Block] = (
        [Table("evidence", "", page_columns("evidence"), rows)] if rows else [Text(("No sign of a fault.",))]
    )
    more = in_short(row["reason"] or "")[1]
    if more:
        blocks.insert(0, Text((more[:1].upper() + more[1:] + ".",)))
    known = _known_figures(row, (*MODEL, *LIKELIHOOD))
    if known:
        blocks.append(Facts(known))
    if row["advice"]:
        blocks.append(Text((f"The advice rests on this: {row['advice']}",)))
    if row["notes"]:
        blocks.append(Text((f"About the data: {row['notes']}.",), "note"))
    return Section("Evidence, for experts", tuple(blocks), closed=True)


def _figure_with_unit(name: str, row: Row, scale: PvScale) -> tuple[str, str]:
    """A figure with its unit, and in the loop's own unit too where it is a percentage of span."""
    term, text = titled(name, number(row[name]) + mark(row, name))
    own = "" if name in LEVELS else beside(BY_NAME[name].unit, row[name], scale)
    return term, text + own


def _moves(row: Row) -> list[Section]:
    """How PV answers moves of the set point, where there were some."""
    drawn = answered_moves(row)
    if drawn is None:
        return []
    names = ("sp_moves", "rise_time_s", "overshoot_pct", "settling_time_s")
    facts = Facts(_known_figures(row, names))
    growing = [Text((row["growing"] + ".",), "lead")] if row["growing"] else []
    return [Section("Moves of the set point", (*growing, facts, drawn, *_phases(row)))]


def _phases(row: Row) -> list[Table]:
    """Moves of a programme that come back, a row a kind: how often, and the medians of their answers."""
    told = json.loads(row["phases"] or "[]")
    if not told:
        return []
    low, span = row["pv_lo"] or 0.0, (row["pv_hi"] or 100.0) - (row["pv_lo"] or 0.0)
    rows = []
    for phase in told:
        ends = (low + span * phase[k] / 100.0 for k in ("begin", "end"))
        count, overshoot = len(phase["start_s"]), median(phase["overshoot_pct"])
        settled = [s for s in phase["settled_s"] if s is not None]
        figures = (*ends, count, overshoot, median(settled) if settled else None)
        rows.append(tuple(map(plain_cell, figures)))
    unit = f"Levels in {row['pv_unit']}." if row["pv_unit"] else ""
    return [Table("phases", "Phases that come back", page_columns("phases"), tuple(rows), unit)]


def _limit_cycle(row: Row) -> list[Section]:
    """Recorded against predicted limit cycle, and what new settings promise, where the night holds them."""
    known = [(name, row[p], row[a]) for name, p, a in CYCLES if row[p] is not None]
    if len(known) < 2:
        return []
    rows = tuple((Cell(name), Cell(duration(p), p), plain_cell(a)) for name, p, a in known)
    return [Section("Limit cycle", (Table("limit-cycle", "", page_columns("limit-cycle"), rows),))]


def _picture_sections(thin: Thinned | None, row: Row) -> list[Section]:
    if thin is None or thin.time_s.size < 2:
        return []
    last = thin.between(row["start_s"] or 0.0, float("inf"))
    pictures = (pv_over_op(last, row), *rhythm_plots(last, row["period_s"]))
    return [Section("PV over OP, and its rhythm", pictures)]


def _night_cells(row: Row) -> tuple[Cell, ...]:
    """One night's cells; the last says why where the loop was not assessed."""
    lost = {} if row["status"] == Status.OK else {"action": Cell(f"{row['status']}: {row['reason']}")}
    return cells(row, page_columns("history"), **lost)


def nights_section(rows: Sequence[Row]) -> Section:
    """A table of a loop's nights, the last first, and pictures of how its oscillation and the width of its valve's
    fault grew or fell."""
    drawn = (*(_over_nights(rows, column) for column in OVER_NIGHTS), _widths(rows))
    plots = tuple(p for p in drawn if p is not None)
    pictures = (Panels("nights", "Night by night", plots),) if plots else ()
    table = Table("history", "", page_columns("history"), tuple(map(_night_cells, reversed(rows))))
    return Section("Over the nights", (*pictures, table))


def _believed(row: Row) -> tuple[tuple[str, str], ...]:
    """What the nights together say, and how many they are."""
    nights = with_noun(int(row["believed_nights"]), "night")
    out = [("The verdict rests on", f"{nights} since {row['believed_since']}")]
    if row["worn_nights"]:
        certain = f", certain since {row['certain_since']}" if row["certain_since"] else ""
        sure = "> 99" if row["worn_pct"] > PAGES.most_sure_pct else f"{row['worn_pct']:.0f}"
        out.append(("Worn valve", f"{sure} %{certain}"))
    if row["certain_since"] and row["width_pct"] is not None:
        ends = f"{number(row['width_low_pct'])} … {number(row['width_high_pct'])}"
        out.append(("Play or stickband", f"{number(row['width_pct'])} % of OP ({ends})"))
    if row["wear_pct_per_month"] is not None:
        out.append(("It wears", wear_text(row)))
    return tuple(out)


def _over_nights(rows: Sequence[Row], column: str) -> Plot | None:
    """A figure over the nights; None where fewer than three know it."""
    line = _by_night("each night", [r[column] for r in rows])
    if line.x.size < 3:
        return None
    name, shown = f"nights-{slug(column)}", BY_NAME[column]
    return Plot(name, shown.title, "nights before this one", shown.unit, (line,), reach=(0.0, 0.0))


def _by_night(label: str, figures: Sequence[float | None], **drawn: Any) -> Line:
    """A figure of the nights up to this one, where it is known."""
    known = [(i - len(figures) + 1.0, y) for i, y in enumerate(figures) if y is not None]
    x, y = np.array(known, float).reshape(-1, 2).T
    return Line(label, x, y, **drawn)


def _widths(rows: Sequence[Row]) -> Plot | None:
    """Width of the valve's fault as each night tells it, and as they do together; None where fewer than three do."""
    own = _by_night("each night", [_own_width(r) for r in rows], joined=False)
    certain = [r["width_pct"] if r["certain_since"] else None for r in rows]
    pooled = _by_night("nights together", certain, kind="op")
    if not rows[-1]["certain_since"] or min(own.x.size, pooled.x.size) < 3:
        return None
    title = "Width of the valve's fault"
    return Plot("widths", title, "nights before this one", "% of OP", (own, pooled), reach=(0.0, 1.0))


def _own_width(row: Row) -> float | None:
    """Width that a night tells by itself."""
    found = json.loads(row["witness"]).get("width") if row["witness"] else None
    return found[0] if found else None


def _explained_section(found: Row | None, row: Row) -> list[Section]:
    """What the plain loop lacks, where the night was explained, and how that goes with the night's verdict."""
    if found is None:
        return []
    together = agreement(row, found["verdict"], found["block"])
    said = (f"{title(found['verdict']).capitalize()}: {found['reason']}", check(found))
    text = Text((*said, together) if together else said)
    return [Section("What the plain loop lacks", (text,))]


def loop_page(
    rows: Sequence[Row],
    thin: Thinned | None,
    explained: Row | None = None,
    more: Page | None = None,
    shared: Section | None = None,
    notes: Sequence[str] = (),
    settings: Page | None = None,
) -> Page:
    """A loop's page.

    Parameters
    ----------
    rows : sequence of mapping
        The loop's nights, oldest first; the last is the night that the page is about.
    thin : Thinned or None
        Its trends of the last week.
    explained : mapping or None
        The night's explanation of the loop (analyzer.columns.EXPLAINED).
    more : Page or None
        The page of that explanation.
    shared : Section or None
        What it shares with other loops.
    notes : sequence of str
        What people wrote about it, oldest first.
    settings : Page or None
        The page on which settings are tried; what it opens with stands here too.
    """
    row = rows[-1]
    sections = [
        _first_section(row, thin),
        *_notes(notes),
        _verdict_section(row),
        *(() if shared is None else (shared,)),
        *_explained_section(explained, row),
        _evidence_section(row),
        *_picture_sections(thin, row),
        *_moves(row),
        *_limit_cycle(row),
        *(() if settings is None else (_of_settings(settings),)),
        _figures(row),
        nights_section(rows),
    ]
    group = None if shared is None else row["group"]
    links = (ALL_LOOPS, *_links_beside(more, settings, group), *_beside_source(row))
    return Page(slug(row["loop"]), row["loop"], _subtitle(row), tuple(sections), links)


def _of_settings(found: Page) -> Section:
    """What the page of settings opens with: what is won and what it costs, in a sentence and a picture."""
    first = found.sections[0]
    return Section(first.title, tuple(b for b in first.blocks if isinstance(b, Text | Plot)))


def _figures(row: Row) -> Section:
    """The figures of the night that are known, folded."""
    scale = pv_scale_of(row)
    figures = tuple(_figure_with_unit(k, row, scale) for k in FIGURES if row[k] is not None)
    return Section("Figures of the night, for experts", (Facts(figures),), closed=True)


def _subtitle(row: Row) -> str:
    """What loop it is, and which night."""
    known = [row["description"], row["type"], row["area"], f"night {row['night']}"]
    return ", ".join(k for k in known if k)


def _beside_source(row: Row) -> Iterator[tuple[str, str]]:
    """To its trends and those of the loop that it follows, on one time axis."""
    source = row["source_loop"]
    if source:
        pair = ",".join(quote(name, safe="") for name in (source, row["loop"]))
        yield f"Beside {source}", f"{BESIDE}.html#{pair}"


def _links_beside(more: Page | None, settings: Page | None, group: str | None) -> Iterator[tuple[str, str]]:
    """To the loop's other pages and to its group's."""
    if more is not None:
        yield "The explanation", f"{more.name}.html"
    if settings is not None:
        yield "Try settings", f"{settings.name}.html"
    if group:
        yield "Its group", f"group-{group}.html"
