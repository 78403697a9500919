"""Colour maps and graphs as inline SVG; as in svg.py, colours come from style sheets and texts are escaped."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

from reports.map_blocks import Graph, HeatMap, Node
from reports.svg import digits, picture, written

NAMES, WIDTH, ROW, FOOT = 120.0, 640.0, 20.0, 44.0
"""Of a colour map: room for names, width of the map, height of a row, room below for the axis."""
BOX = (150.0, 38.0)
GAP = (110.0, 16.0)
"""Width and height of a graph's box, and the room to the next."""


def log_ticks(low: float, high: float) -> list[float]:
    """Ones, twos and fives of every power of ten between two values; where there are many, powers alone."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    found = [m * 10.0**k for k in powers for m in (1, 2, 5) if low <= m * 10.0**k <= high]
    return found if len(found) <= 9 else [t for t in found if round(math.log10(t), 9).is_integer()]


def heat_map(m: HeatMap) -> Markup:
    """Rows of cells whose colour is the deeper, the larger their share."""
    columns = m.x.size
    step = WIDTH / max(columns, 1)
    body = []
    for i, name in enumerate(m.rows):
        body.append(written(NAMES - 8, ROW * i + 14, name, "end"))
        for j in np.flatnonzero(np.isfinite(m.shares[i]) & (m.shares[i] > 0.02)):
            place = f'x="{digits(NAMES + j * step)}" y="{digits(ROW * i + 1)}"'
            size = f'width="{digits(step + 0.3)}" height="{digits(ROW - 2)}"'
            body.append(f'<rect class="heat" {place} {size} fill-opacity="{min(m.shares[i, j], 1.0):.2f}"/>')
    foot = ROW * len(m.rows)
    ends = np.log(m.x[[0, -1]]) if columns > 1 else np.array([0.0, 1.0])

    def across(value: float) -> float:
        share = (math.log(value) - ends[0]) / (ends[1] - ends[0])
        return NAMES + (0.5 + share * (columns - 1)) * step

    for tick in log_ticks(*sorted((float(m.x[0]), float(m.x[-1])))) if columns > 1 else []:
        body.append(f'<path class="grid" d="M{digits(across(tick))},0V{digits(foot)}"/>')
        body.append(written(across(tick), foot + 15, f"{tick:g}", "middle", "tick"))
    for mark in m.marks:
        body.append(f'<path class="mark" d="M{digits(across(mark.x))},0V{digits(foot)}"/>')
        body.append(written(across(mark.x), foot + 28, mark.label, "middle", "marked"))
    body.append(written(NAMES + WIDTH / 2, foot + 41, m.x_label, "middle", "axis"))
    return picture(NAMES + WIDTH + 10, foot + FOOT, body, m.title, "chart")


def places(g: Graph) -> dict[str, tuple[float, float]]:
    """Upper left corner of every box: columns from left to right, each centred."""
    by_column: dict[int, list[Node]] = {}
    for node in g.nodes:
        by_column.setdefault(node.column, []).append(node)
    most = max((len(nodes) for nodes in by_column.values()), default=0)
    out = {}
    for at, column in enumerate(sorted(by_column)):
        nodes = by_column[column]
        top = 0.5 * (most - len(nodes)) * (BOX[1] + GAP[1])
        for i, node in enumerate(nodes):
            out[node.name] = 4 + at * (BOX[0] + GAP[0]), 4 + top + i * (BOX[1] + GAP[1])
    return out


def _arrow(first: tuple[float, float], last: tuple[float, float], text: str) -> list[str]:
    """A curve from one place to another with a tip and a text at its end."""
    (a, b), (c, d) = first, last
    middle = digits(0.5 * (a + c))
    curve = f"M{digits(a)},{digits(b)}C{middle},{digits(b)} {middle},{digits(d)} {digits(c - 6)},{digits(d)}"
    tip = f"M{digits(c)},{digits(d)}l-8,-4v8Z"
    drawn = f'<path class="line flow" d="{curve}"/><path class="tip" d="{tip}"/>'
    return [drawn, written(c - 10, d - 6, text, "end", "tick")]


def graph(g: Graph) -> Markup:
    """Boxes and arrows."""
    at = places(g)
    body = []
    for arrow in g.arrows:
        if arrow.first in at and arrow.last in at:
            (x1, y1), (x2, y2) = at[arrow.first], at[arrow.last]
            body += _arrow((x1 + BOX[0], y1 + BOX[1] / 2), (x2 - 2, y2 + BOX[1] / 2), arrow.text)
    for node in g.nodes:
        x, y = at[node.name]
        place = f'x="{digits(x)}" y="{digits(y)}" width="{digits(BOX[0])}" height="{digits(BOX[1])}"'
        body.append(f'<rect class="box {node.kind}" rx="5" {place}/>')
        body.append(written(x + 8, y + 16, node.name, "start", "strong"))
        body.append(written(x + 8, y + 31, node.text, "start", "tick"))
    width = max((x for x, _ in at.values()), default=0.0) + BOX[0] + 4
    height = max((y for _, y in at.values()), default=0.0) + BOX[1] + 4
    return picture(width, height, body, g.title, "graph", natural=True)
