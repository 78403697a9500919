"""Groups that share an oscillation: a table for the morning page, a page for each, a part of each member's page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from analyzer.columns import GROUPS
from analyzer.loop.decisions import GroupRole
from analyzer.pages.group_list import sentence, with_settings
from analyzer.pages.group_pictures import aligned, graph, heat_map
from analyzer.pages.reading import Thinned
from analyzer.pages.view import Night
from analyzer.pages.words import counted, duration, number
from analyzer.plantwide.view import GroupView
from reports.pages import Cell, Column, Facts, Page, Section, Table, Text
from reports.texts import slug

Row = Mapping[str, Any]
DECLARED = {c.name: c for c in GROUPS}


def page_name(number: str) -> str:
    """The file of a group's page, without its ending."""
    return f"group-{number}"


def _heading(name: str, wide: bool = False) -> Column:
    declared = DECLARED[name]
    unit = f" [{declared.unit}]" if declared.unit else ""
    return Column(name, declared.heading + unit, declared.is_number, declared.hint, wide)


MORNING = (
    Column("group", "Group"),
    Column("loops", "Loops", True),
    Column("group_period_s", "Period", True, DECLARED["group_period_s"].hint),
    Column(
        "fix_first", "Fix first", wide=True, hint="Loop at which the oscillation starts, with its confidence."
    ),
    Column("action", "Action there", wide=True),
    Column(
        "gain", "Others gain", True, "Average absolute error that would go in the other loops, % of span."
    ),
    Column("members", "Others", wide=True),
)


def morning_table(night: Night, groups: Sequence[GroupView]) -> Table:
    """One cause, several loops: the groups of a night, those that cost most first."""
    rows = tuple(_morning_row(night, g) for g in groups)
    return Table(
        "groups", "", MORNING, rows, "Repair or retune the first loop, then look at the others again."
    )


def _morning_row(night: Night, g: GroupView) -> tuple[Cell, ...]:
    named = ", ".join(f"{r['loop']} {r['source_pct']:.0f} %" for r in g.candidates)
    others = ", ".join(r["loop"] for r in g.rows if r is not g.source)
    href = f"{page_name(g.number)}.html"
    return (
        Cell(f"group {g.number}", kind="strong", href=href),
        Cell(str(len(g.rows)), len(g.rows)),
        Cell(duration(g.period_s), g.period_s),
        Cell(named or "not clear"),
        Cell(with_settings(g) or "undecided: look at the candidates"),
        Cell(number(g.gain_pct), g.gain_pct),
        Cell(others),
    )


MEMBERS = (
    Column("loop", "Loop"),
    _heading("role"),
    _heading("source_pct"),
    Column("cause", "Cause"),
    *(_heading(n) for n in ("coherence", "lag_s", "wave_amplitude_pct", "wave_share_pct", "gain_pct")),
)


def _percent(value: float) -> str:
    return f"{value:.0f}" if value >= 1 else "under 1"


def _members(g: GroupView, paged: frozenset[str]) -> Table:
    rows = []
    for r in g.rows:
        name = r["loop"]
        href = f"{slug(name)}.html" if name in paged else ""
        figures = ("coherence", "lag_s", "wave_amplitude_pct", "wave_share_pct", "gain_pct")
        cells = [Cell(number(r[n]), r[n]) for n in figures]
        cause = g.loops[name]["cause"] or ""
        rows.append(
            (
                Cell(name, kind="strong", href=href),
                Cell(r["role"]),
                Cell(_percent(r["source_pct"]), r["source_pct"]),
                Cell(cause, kind=cause if cause in ("valve", "tuning", "load") else ""),
                *cells,
            )
        )
    return Table("members", "", MEMBERS, tuple(rows), "Lags that the night cannot tell are left empty.")


SIGN_WORDS = {
    "valve": "its own valve is at fault",
    "best_valve": "its valve has the most evidence of the group",
    "tuning": "its own tuning oscillates",
    "oscillates": "it oscillates by itself",
    "first": "it moves before the others",
    "foresees": "its past foresees the others",
    "central": "the others go with it best",
    "clear": "its wave is the clearest",
    "share": "most of its error is the wave",
    "nonlinear": "its wave is bent most",
}


def _signs(g: GroupView) -> Table:
    """Why there: the signs of the likeliest candidates side by side."""
    shown = [r for r in g.rows[:5] if r["group_signs"]]
    columns = (Column("sign", "Sign", wide=True), *(Column(r["loop"], r["loop"], True) for r in shown))
    kept = [json.loads(r["group_signs"]) for r in shown]
    rows = tuple(
        (Cell(text), *(Cell(f"{signs.get(k, 0.0):.2f}", signs.get(k, 0.0)) for signs in kept))
        for k, text in SIGN_WORDS.items()
    )
    note = "From 0 to 1; who is first from -1 to 1. triage config says what each adds to the odds."
    return Table("signs", "", columns, rows, note)


def page(g: GroupView, trends: Mapping[str, Thinned], night: str, paged: frozenset[str]) -> Page:
    """A group's page."""
    facts = [("Period", duration(g.period_s)), ("Loops", str(len(g.rows)))]
    if g.source is not None:
        facts += [("Fix first", g.source["loop"]), ("Action there", with_settings(g))]
    facts += [
        ("Others gain", f"{number(g.gain_pct)} % of span"),
        ("It starts elsewhere", f"{g.unseen_pct:.0f} %"),
    ]
    pictures = [b for b in (aligned(g, trends), heat_map(g)) if b is not None]
    sections = (
        Section("What and where", (Text((f"{sentence(g)}.",), "lead"), Facts(tuple(facts)), graph(g))),
        Section("Loops", (_members(g, paged),)),
        Section("Why there", (_signs(g),)),
        *((Section("Trends and spectra", tuple(pictures)),) if pictures else ()),
    )
    subtitle = f"{counted(len(g.rows), 'loop')}, night {night}."
    return Page(
        page_name(g.number),
        f"Group {g.number}: one oscillation",
        subtitle,
        sections,
        (("All loops", "index.html"),),
    )


def of_loop(g: GroupView, loop: str, trends: Mapping[str, Thinned]) -> Section:
    """The part of a member's page: its place in the group, its trend above the source's."""
    row = next(r for r in g.rows if r["loop"] == loop)
    source = g.source
    said = [f"{sentence(g)}."]
    if source is not None and source["loop"] != loop and row["role"] == GroupRole.FOLLOWER:
        late = f", {row['lag_s']:.0f} s later" if row["lag_s"] is not None else ""
        said.append(f"{loop} follows {source['loop']} with a coherence of {row['coherence']:.2f}{late}.")
    beneath = [loop, *[r["loop"] for r in g.rows if r["loop"] != loop][:1]]
    picture = aligned(g, trends, beneath)
    return Section("Moves with other loops", (Text(tuple(said)), *((picture,) if picture else ())))
