"""Groups that share an oscillation: their list, the table of the morning page, a page each, a part of a member's."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analyzer.columns import GROUP_LIST, row_of
from analyzer.limits import PAGES
from analyzer.loop.decisions import GroupRole
from analyzer.pages import words
from analyzer.pages.reading import Thinned, action_text
from analyzer.plantwide.view import GroupView, read_groups
from analyzer.store.store import Store
from analyzer.words.units import Row, duration, number
from identification.signals.spectrum import PER_OCTAVE
from reports import pages as parts
from reports.texts import slug

PERIODS = 12.0
"""Periods that the aligned trends show."""
FLOOR_DB = 30.0
"""Level under a loop's peak from which a colour is empty [dB]."""


def grouped(
    store: Store, night: str | None = None, top: int | None = None
) -> tuple[list[dict[str, Any]], str]:
    """Rows of the groups of a night, those that cost most first.

    Raises
    ------
    InputError
        Where there is no such store or night.
    """
    name = night or store.require()
    store.read("nights", name, ["loop"])
    return [group_row(g) for g in read_groups(store, name)][:top], name


def group_row(g: GroupView) -> dict[str, Any]:
    """What is told of a group."""
    source = g.source
    own = g.loops[source["loop"]] if source else None
    told = {
        "group": g.number,
        "group_period_s": g.period_s,
        "loops": float(len(g.rows)),
        "fix_first": source["loop"] if source else None,
        "source_pct": source["source_pct"] if source else None,
        "candidates": json.dumps({r["loop"]: round(r["source_pct"], 1) for r in g.candidates}),
        "unseen_pct": g.unseen_pct,
        "source_cause": own["cause"] if own else None,
        "source_action": action_there(g),
        "others_gain_pct": g.gain_pct,
        "members": json.dumps([r["loop"] for r in g.rows]),
        "sentence": sentence(g),
    }
    return row_of(told, GROUP_LIST)


def action_there(g: GroupView) -> str:
    """The action at the source with the settings to type in, where there are any."""
    return action_text(g.loops[g.source["loop"]], g.action) if g.source else g.action


def _candidates(g: GroupView) -> str:
    return ", ".join(f"{r['loop']} {r['source_pct']:.0f} %" for r in g.candidates)


def sentence(g: GroupView) -> str:
    """One cause, so many loops: what is shared, where it starts, what the others would gain."""
    head = f"One oscillation of {duration(g.period_s)} in {len(g.rows)} loops"
    if g.source is not None:
        loop, pct = g.source["loop"], g.source["source_pct"]
        tail = f"it starts at {loop} ({pct:.0f} %)"
    else:
        tail = f"it starts at one of {_candidates(g)}, or outside what is recorded ({g.unseen_pct:.0f} %)"
    return f"{head}; {tail}; without it the others' average errors fall by {number(g.gain_pct)} % of span together"


def page_name(number: str) -> str:
    """The file of a group's page, without its ending."""
    return f"group-{number}"


def morning_table(groups: Sequence[GroupView], linked: bool) -> parts.Table:
    """One cause, several loops: the groups of a night, those that cost most first; `linked` to their pages."""
    rows = (
        (
            parts.Cell(
                f"group {g.number}", kind="strong", href=f"{page_name(g.number)}.html" if linked else ""
            ),
            parts.Cell(str(len(g.rows)), len(g.rows)),
            parts.Cell(duration(g.period_s), g.period_s),
            parts.Cell(_candidates(g) or "not clear"),
            parts.Cell(action_there(g) or "undecided: look at the candidates"),
            words.plain_cell(g.gain_pct),
            parts.Cell(", ".join(r["loop"] for r in g.rows if r is not g.source)),
        )
        for g in groups
    )
    return words.page_table("groups", rows)


def _member_cells(g: GroupView, row: Row, paged: frozenset[str]) -> tuple[parts.Cell, ...]:
    name, pct = row["loop"], row["source_pct"]
    return (
        parts.Cell(name, kind="strong", href=f"{slug(name)}.html" if name in paged else ""),
        parts.Cell(row["role"]),
        parts.Cell(f"{pct:.0f}" if pct >= 1 else "under 1", pct),
        words.cause_cell(g.loops[name]["cause"]),
        *(words.plain_cell(row[c.key]) for c in words.page_columns("members")[4:]),
    )


def _signs_table(g: GroupView) -> parts.Table:
    """Why there: the signs of the likeliest candidates side by side."""
    shown = {r["loop"]: json.loads(r["group_signs"]) for r in g.rows[:5] if r["group_signs"]}
    columns = (*words.page_columns("signs"), *(parts.Column(loop, loop, True) for loop in shown))
    rows = (
        (
            parts.Cell(text),
            *(parts.Cell(f"{signs.get(k, 0.0):.2f}", signs.get(k, 0.0)) for signs in shown.values()),
        )
        for k, text in words.texts("signs").items()
    )
    return words.page_table("signs", rows, columns=columns)


def group_page(g: GroupView, trends: Mapping[str, Thinned], night: str, paged: frozenset[str]) -> parts.Page:
    """A group's page."""
    facts = [("Period", duration(g.period_s)), ("Loops", str(len(g.rows)))]
    if g.source is not None:
        facts += [("Fix first", g.source["loop"]), ("Action there", action_there(g))]
    facts.append(("Others gain", f"{number(g.gain_pct)} % of span"))
    facts.append(("It starts elsewhere", f"{g.unseen_pct:.0f} %"))
    members = words.page_table("members", (_member_cells(g, r, paged) for r in g.rows))
    sections = parts.there(
        parts.Section("What and where", (words.lead(sentence(g)), parts.Facts(tuple(facts)), graph(g))),
        parts.Section("Loops", (members,)),
        parts.Section("Why there", (_signs_table(g),)),
        parts.section("Trends and spectra", aligned(g, trends), heat_map(g)),
    )
    subtitle = f"{words.with_noun(len(g.rows), 'loop')}, night {night}."
    return parts.Page(
        page_name(g.number), f"Group {g.number}: one oscillation", subtitle, sections, (words.ALL_LOOPS,)
    )


def member_section(g: GroupView, loop: str, trends: Mapping[str, Thinned]) -> parts.Section:
    """The part of a member's page: its place in the group, its trend above the source's."""
    row = next(r for r in g.rows if r["loop"] == loop)
    source = g.source
    said = [f"{sentence(g)}."]
    if source is not None and source["loop"] != loop and row["role"] == GroupRole.FOLLOWER:
        late = f", {row['lag_s']:.0f} s later" if row["lag_s"] is not None else ""
        said.append(f"{loop} follows {source['loop']} with a coherence of {row['coherence']:.2f}{late}.")
    beneath = [loop, *[r["loop"] for r in g.rows if r["loop"] != loop][:1]]
    return parts.Section(
        "Moves with other loops", parts.there(parts.Text(tuple(said)), aligned(g, trends, beneath))
    )


def graph(g: GroupView) -> parts.Graph:
    """The way of the oscillation from loop to loop."""
    shown = [r for r in g.rows if r["role"] != GroupRole.SHARES or r is g.rows[0]][: PAGES.group_loops]
    by_name = {r["loop"]: r for r in shown}
    first = shown[0]["loop"]
    depth = {first: 0}

    def column(name: str) -> int:
        if name not in depth:
            depth[name] = 1  # of a ring, were there one
            parent = by_name[name]["parent"]
            depth[name] = 1 + column(parent if parent in by_name else first)
        return depth[name]

    nodes = tuple(parts.Node(n, _node_text(r), str(r["role"]), column(n)) for n, r in by_name.items())
    arrows = tuple(
        parts.Arrow(r["parent"] if r["parent"] in by_name else first, n, _arrow_text(r))
        for n, r in by_name.items()
        if n != first
    )
    left = len(g.rows) - len(shown)
    caption = "From left to right as coherence falls; lags are behind the likeliest source."
    caption += f" {left} more not drawn." if left else ""
    return parts.Graph("way", "Where it starts and whom it moves", nodes, arrows, caption)


def _node_text(r: Row) -> str:
    role = f"{r['role']} {r['source_pct']:.0f} %" if r["source_pct"] >= 1 else str(r["role"])
    return f"{role}, {number(r['wave_amplitude_pct'])} %"


def _arrow_text(r: Row) -> str:
    lag = r["lag_s"]
    return f"{lag:+.0f} s" if lag is not None else f"{r['coherence']:.2f}"


def heat_map(g: GroupView) -> parts.HeatMap | None:
    """Spectra of the members beneath each other; None where the night kept none."""
    rows = g.rows[: PAGES.group_loops]
    kept = [(r["loop"], json.loads(s)) for r in rows if (s := g.loops[r["loop"]]["spectrum"])]
    if not kept:
        return None
    count = max(len(s["db"]) for _, s in kept)
    longest = max(s["period_s"] for _, s in kept)
    shares = np.full((len(kept), count), np.nan)
    for i, (_, s) in enumerate(kept):
        level = np.array(s["db"], dtype=float)
        at = round(PER_OCTAVE * np.log2(longest / s["period_s"])) + np.arange(level.size)
        inside = at < count
        near = at[inside]
        shares[i, near] = np.clip(1.0 + (level[inside] - level.max()) / FLOOR_DB, 0.0, 1.0)
    periods = longest / 2.0 ** (np.arange(count) / PER_OCTAVE)
    mark = parts.Mark(g.period_s, duration(g.period_s))
    caption = "Depth of colour: level of the error in each band under the loop's own peak, 30 dB to nothing."
    loops = tuple(n for n, _ in kept)
    return parts.HeatMap(
        "spectra", "Spectra", "period [s]", periods[::-1], loops, shares[:, ::-1], (mark,), caption
    )


def aligned(g: GroupView, trends: Mapping[str, Thinned], only: Sequence[str] = ()) -> parts.Trend | None:
    """PV of the members beneath each other over some periods; None where the trends are too coarse to show any."""
    names = [r["loop"] for r in g.rows if r["loop"] in trends and (not only or r["loop"] in only)]
    names = (sorted(names, key=only.index) if only else names)[: PAGES.group_loops]
    if not names:
        return None
    first = trends[names[0]]
    middle = 0.5 * (first.time_s[0] + first.time_s[-1])
    lead = first.between(middle - 0.5 * PERIODS * g.period_s, middle + 0.5 * PERIODS * g.period_s)
    if lead.time_s.size < 4 * PERIODS:
        return None
    bands = []
    for i, name in enumerate(names):
        t = trends[name]
        low, high = (np.interp(lead.time_s, t.time_s, t.extremes[f"pv_{end}"]) for end in ("min", "max"))
        bands.append(parts.Band(f"{name}.PV", "pv", i, low, high))
    top = "" if only else ", the likeliest source on top"
    caption = f"PV [% of span] over {PERIODS:g} periods in the middle of the night{top}."
    title = "Trends, aligned"
    return parts.Trend("aligned", title, lead.time_s, lead.gap, tuple(bands), tuple(names), (), caption)
