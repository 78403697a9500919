"""Groups with a common oscillation: as a list, on the morning page, on their own pages and on those of loops."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analyzer.columns import GROUP_LIST, names, row_of
from analyzer.loop.decisions import GroupRole
from analyzer.pages import words
from analyzer.pages.rank import PIPED, interactive
from analyzer.pages.reading import ShownNight, Thinned, action_text
from analyzer.plantwide.view import GroupView, read_groups
from analyzer.store.store import Store
from analyzer.words.units import Row, duration, number
from identification.signals.spectrum import PER_OCTAVE
from reports import pages as parts
from reports.markdown import escaped, rows_of_table
from reports.plain import csv_text
from reports.texts import visible

GROUP_LOOPS = 12  # Loops of a group that are drawn one above the other [loops]: more do not fit on a screen

PERIODS = 12.0
"""Periods in the aligned trends."""
FLOOR_DB = 30.0
"""Level below a loop's peak at which the colour is empty [dB]."""


def grouped(store: Store, night: str | None = None, top: int | None = None) -> tuple[list[GroupView], str]:
    """The groups of a night, highest loss first, and the night's name.

    Raises
    ------
    InputError
        There is no such store or night.
    """
    name = night or store.require()
    store.read("nights", name, ["loop"])
    return read_groups(store, name)[:top], name


def group_row(g: GroupView) -> dict[str, Any]:
    """Listed columns of a group, candidates by their names and members unchanged."""
    source = g.source
    values = {
        "group": g.number,
        "group_period_s": g.period_s,
        "loops": float(len(g.rows)),
        "fix_first": source["loop"] if source else None,
        "source_pct": source["source_pct"] if source else None,
        "candidates": {r["loop"]: round(r["source_pct"], 1) for r in g.candidates},
        "unseen_pct": g.unseen_pct,
        "source_cause": g.loops[source["loop"]]["cause"] if source else None,
        "source_action": action_there(g),
        "others_gain_pct": g.gain_pct,
        "members": [r["loop"] for r in g.rows],
        "sentence": sentence(g),
    }
    return row_of(values, GROUP_LIST)


def rendered_groups(groups: Sequence[GroupView], night: str, form: str) -> str:
    """Groups as text in one of the formats."""
    rows = [group_row(g) for g in groups]
    if form == "csv":
        cells = ([json.dumps(v) if isinstance(v, dict | list) else v for v in r.values()] for r in rows)
        return csv_text(names(GROUP_LIST), cells).rstrip("\n")
    if form == "json":
        return json.dumps(rows, indent=1)
    shown = [list(map(visible, _group_texts(g, "unseen", "undecided"))) for g in groups]
    if form == "table":
        return _as_table(shown, night)
    heads = [column.title for column in words.page_columns("list-of-groups")]
    return "\n".join(rows_of_table(heads, (map(escaped, cells) for cells in shown)))


def _as_table(shown: Sequence[Sequence[str]], night: str) -> str:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    if not shown:
        return f"Night {night}: no loops share an oscillation"
    drawn = Table(box=SIMPLE_HEAD, title=f"Night {night}: one cause, several loops", title_justify="left")
    for column in words.page_columns("list-of-groups"):
        drawn.add_column(column.title, justify="right" if column.numeric else "left")
    for cells in shown:
        drawn.add_row(*map(Text, cells))
    console = Console(width=None if interactive() else PIPED)
    with console.capture() as capture:
        console.print(drawn)
    return "\n".join(line.rstrip() for line in capture.get().rstrip().splitlines())


def _group_texts(g: GroupView, unseen: str, undecided: str) -> tuple[str, ...]:
    """A row of a group: number, loops, period, the source or `unseen`, the action there or `undecided`, the
    improvement for the others, and their names."""
    others = ", ".join(r["loop"] for r in g.rows if r is not g.source)
    head = g.number, str(len(g.rows)), duration(g.period_s), _candidates(g) or unseen
    return (*head, action_there(g) or undecided, number(g.gain_pct), others)


def action_there(g: GroupView) -> str:
    """The action at the source with the new settings, if there are any."""
    return action_text(g.loops[g.source["loop"]], g.action) if g.source else g.action


def _candidates(g: GroupView) -> str:
    return ", ".join(f"{r['loop']} {r['source_pct']:.0f} %" for r in g.candidates)


def sentence(g: GroupView) -> str:
    """Summary of a group: the common oscillation, its source, and the improvement for the others."""
    head = f"One oscillation of {duration(g.period_s)} in {len(g.rows)} loops"
    if g.source is not None:
        loop, pct = g.source["loop"], g.source["source_pct"]
        tail = f"it starts at {loop} ({pct:.0f} %)"
    else:
        tail = f"it starts at one of {_candidates(g)}, or outside the recorded loops ({g.unseen_pct:.0f} %)"
    return f"{head}; {tail}; without it the others' average errors fall by {number(g.gain_pct)} % of span together"


def morning_table(groups: Sequence[GroupView], linked: bool) -> parts.Table:
    """One cause, several loops: the groups of a night, highest loss first; `linked` to their pages."""
    rows = []
    for g in groups:
        href = f"group-{g.number}.html" if linked else ""
        _, *texts = _group_texts(g, "not clear", "undecided: look at the candidates")
        figures = (len(g.rows), g.period_s, None, None, g.gain_pct, None)
        rows.append(
            (parts.Cell(f"group {g.number}", kind="strong", href=href), *map(parts.Cell, texts, figures))
        )
    return words.page_table("groups", rows)


def _members_table(g: GroupView, night: ShownNight) -> parts.Table:
    """The members with their lags and gains, the most likely source first."""

    def own(row: Row) -> dict[str, words.CellContent]:
        pct, cause = row["source_pct"], g.loops[row["loop"]]["cause"]
        confidence = parts.Cell(f"{pct:.0f}" if pct >= 1 else "under 1", pct)
        return {"source_pct": confidence, "cause": words.cause_cell(cause)}

    return night.table("members", g.rows, own)


def _signs_table(g: GroupView) -> parts.Table:
    """The evidence for the source: criteria of the most likely candidates side by side."""
    shown = {r["loop"]: json.loads(r["group_signs"]) for r in g.rows[:5] if r["group_signs"]}
    columns = (*words.page_columns("signs"), *(parts.Column(loop, loop, True) for loop in shown))
    rows = (
        (text, *(parts.Cell(f"{s.get(k, 0.0):.2f}", s.get(k, 0.0)) for s in shown.values()))
        for k, text in words.texts("signs").items()
    )
    return words.page_table("signs", rows, columns=columns)


def group_page(g: GroupView, trends: Mapping[str, Thinned], night: ShownNight) -> parts.Page:
    """A group's page."""
    facts = [("Period", duration(g.period_s)), ("Loops", str(len(g.rows)))]
    if g.source is not None:
        facts += [("Fix first", g.source["loop"]), ("Action there", action_there(g))]
    facts.append(("Error in others", f"{number(g.gain_pct)} % of span"))
    facts.append(("It starts elsewhere", f"{g.unseen_pct:.0f} %"))
    sections = parts.without_none(
        parts.Section("What and where", (words.lead(sentence(g)), parts.Facts(tuple(facts)), graph(g))),
        parts.Section("Loops", (_members_table(g, night),)),
        parts.Section("Why there", (_signs_table(g),)),
        parts.section("Trends and spectra", aligned(g, trends), heat_map(g)),
    )
    subtitle = f"{words.with_noun(len(g.rows), 'loop')}, night {night.name}."
    return parts.Page(
        f"group-{g.number}", f"Group {g.number}: one oscillation", subtitle, sections, (words.ALL_LOOPS,)
    )


def member_section(g: GroupView, loop: str, trends: Mapping[str, Thinned]) -> parts.Section:
    """The part of a member's page: its place in the group, its trend above the source's."""
    row = next(r for r in g.rows if r["loop"] == loop)
    source = g.source
    notes = [f"{sentence(g)}."]
    if source is not None and source["loop"] != loop and row["role"] == GroupRole.FOLLOWER:
        late = f", {row['lag_s']:.0f} s later" if row["lag_s"] is not None else ""
        notes.append(f"{loop} follows {source['loop']} with a coherence of {row['coherence']:.2f}{late}.")
    beneath = [loop, *[r["loop"] for r in g.rows if r["loop"] != loop][:1]]
    return parts.Section(
        "Moves with other loops", parts.without_none(parts.Text(tuple(notes)), aligned(g, trends, beneath))
    )


def graph(g: GroupView) -> parts.Graph:
    """Propagation of the oscillation from loop to loop."""
    shown = [r for r in g.rows if r["role"] != GroupRole.SHARES or r is g.rows[0]][:GROUP_LOOPS]
    by_name = {r["loop"]: r for r in shown}
    first = shown[0]["loop"]
    parents = {n: r["parent"] if r["parent"] in by_name else first for n, r in by_name.items() if n != first}
    depth = {first: 0}

    def column(name: str) -> int:
        if name not in depth:
            depth[name] = 1  # in case of a ring
            depth[name] = 1 + column(parents[name])
        return depth[name]

    def node(name: str, row: Row) -> parts.Node:
        sure = f" {row['source_pct']:.0f} %" if row["source_pct"] >= 1 else ""
        text = f"{row['role']}{sure}, {number(row['wave_amplitude_pct'])} %"
        return parts.Node(name, text, str(row["role"]), column(name))

    nodes = tuple(node(n, r) for n, r in by_name.items())
    lags = {n: by_name[n]["lag_s"] for n in parents}
    texts = {n: f"{by_name[n]['coherence']:.2f}" if s is None else f"{s:+.0f} s" for n, s in lags.items()}
    arrows = tuple(parts.Arrow(parents[n], n, text) for n, text in texts.items())
    not_shown = len(g.rows) - len(shown)
    caption = "From left to right as coherence falls; lags are behind the likeliest source."
    caption += f" {not_shown} more not drawn." if not_shown else ""
    return parts.Graph("way", "Source and followers", nodes, arrows, caption)


def heat_map(g: GroupView) -> parts.HeatMap | None:
    """Spectra of the members below each other; None if the night has none."""
    rows = g.rows[:GROUP_LOOPS]
    spectra = [(r["loop"], json.loads(s)) for r in rows if (s := g.loops[r["loop"]]["spectrum"])]
    if not spectra:
        return None
    count = max(len(s["db"]) for _, s in spectra)
    longest = max(s["period_s"] for _, s in spectra)
    shares = np.full((len(spectra), count), np.nan)
    for i, (_, s) in enumerate(spectra):
        level = np.array(s["db"], dtype=float)
        at = round(PER_OCTAVE * np.log2(longest / s["period_s"])) + np.arange(level.size)
        inside = at < count
        near = at[inside]
        shares[i, near] = np.clip(1.0 + (level[inside] - level.max()) / FLOOR_DB, 0.0, 1.0)
    periods = longest / 2.0 ** (np.arange(count) / PER_OCTAVE)
    mark = parts.Mark(g.period_s, duration(g.period_s))
    caption = "Depth of colour: level of the error in each band under the loop's own peak, 30 dB to nothing."
    loops = tuple(n for n, _ in spectra)
    return parts.HeatMap(
        "spectra", "Spectra", "period [s]", periods[::-1], loops, shares[:, ::-1], (mark,), caption
    )


def aligned(g: GroupView, trends: Mapping[str, Thinned], only: Sequence[str] = ()) -> parts.Trend | None:
    """PV of the members below each other over some periods; None if the trends are too coarse."""
    shown = [r["loop"] for r in g.rows if r["loop"] in trends and (not only or r["loop"] in only)]
    shown = (sorted(shown, key=only.index) if only else shown)[:GROUP_LOOPS]
    if not shown:
        return None
    first = trends[shown[0]]
    middle = 0.5 * (first.time_s[0] + first.time_s[-1])
    lead = first.between(middle - 0.5 * PERIODS * g.period_s, middle + 0.5 * PERIODS * g.period_s)
    if lead.time_s.size < 4 * PERIODS:
        return None
    bands = []
    for i, name in enumerate(shown):
        t = trends[name]
        low, high = (np.interp(lead.time_s, t.time_s, t.extremes[f"pv_{end}"]) for end in ("min", "max"))
        bands.append(parts.Band(f"{name}.PV", "pv", i, low, high))
    top = "" if only else ", the likeliest source on top"
    caption = f"PV [% of span] over {PERIODS:g} periods in the middle of the night{top}."
    title = "Trends, aligned"
    return parts.Trend("aligned", title, lead.time_s, lead.gap, tuple(bands), tuple(shown), (), caption)
