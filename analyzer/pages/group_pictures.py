"""Pictures of a group: the way of its oscillation, spectra beneath each other, trends beneath each other."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analyzer.loop.decisions import GroupRole
from analyzer.pages.reading import Thinned
from analyzer.pages.words import duration, number
from analyzer.plantwide.view import GroupView
from identification.signals.spectrum import PER_OCTAVE
from reports.pages import Arrow, Band, Graph, HeatMap, Mark, Node, Trend

Row = Mapping[str, Any]
MOST = 12
"""Loops that are drawn beneath each other; ours: more do not fit on a screen."""
PERIODS = 12.0
"""Periods that the aligned trends show."""
FLOOR_DB = 30.0
"""Level under a loop's peak from which a colour is empty [dB]."""


def graph(g: GroupView) -> Graph:
    """The way of the oscillation from loop to loop."""
    shown = [r for r in g.rows if r["role"] != GroupRole.SHARES or r is g.rows[0]][:MOST]
    by_name = {r["loop"]: r for r in shown}
    first = shown[0]["loop"]
    depth = {first: 0}

    def column(name: str) -> int:
        if name not in depth:
            depth[name] = 1  # of a ring, were there one
            parent = by_name[name]["parent"]
            depth[name] = 1 + column(parent if parent in by_name else first)
        return depth[name]

    nodes = tuple(Node(n, _node_text(r), str(r["role"]), column(n)) for n, r in by_name.items())
    arrows = tuple(
        Arrow(r["parent"] if r["parent"] in by_name else first, n, _arrow_text(r))
        for n, r in by_name.items()
        if n != first
    )
    left = len(g.rows) - len(shown)
    caption = "From left to right as coherence falls; lags are behind the likeliest source."
    return Graph(
        "way",
        "Where it starts and whom it moves",
        nodes,
        arrows,
        caption + (f" {left} more not drawn." if left else ""),
    )


def _node_text(r: Row) -> str:
    role = f"{r['role']} {r['source_pct']:.0f} %" if r["source_pct"] >= 1 else str(r["role"])
    return f"{role}, {number(r['wave_amplitude_pct'])} %"


def _arrow_text(r: Row) -> str:
    lag = r["lag_s"]
    return f"{lag:+.0f} s" if lag is not None else f"{r['coherence']:.2f}"


def heat_map(g: GroupView) -> HeatMap | None:
    """Spectra of the members beneath each other; None where the night kept none."""
    kept = [(r["loop"], json.loads(s)) for r in g.rows[:MOST] if (s := g.loops[r["loop"]]["spectrum"])]
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
    mark = Mark(g.period_s, duration(g.period_s))
    caption = "Depth of colour: level of the error in each band under the loop's own peak, 30 dB to nothing."
    return HeatMap(
        "spectra",
        "Spectra",
        "period [s]",
        periods[::-1],
        tuple(n for n, _ in kept),
        shares[:, ::-1],
        (mark,),
        caption,
    )


def aligned(g: GroupView, trends: Mapping[str, Thinned], only: Sequence[str] = ()) -> Trend | None:
    """PV of the members beneath each other over some periods; None where the trends are too coarse to show any."""
    names = [r["loop"] for r in g.rows if r["loop"] in trends and (not only or r["loop"] in only)]
    names = sorted(names, key=only.index)[:MOST] if only else names[:MOST]
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
        bands.append(Band(f"{name}.PV", "pv", i, low, high))
    top = "" if only else ", the likeliest source on top"
    caption = f"PV [% of span] over {PERIODS:g} periods in the middle of the night{top}."
    title = "Trends, aligned"
    return Trend("aligned", title, lead.time_s, lead.gap, tuple(bands), tuple(names), (), caption)
