"""Colour maps, fields over two axes, graphs and treemaps, as SVG."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from markupsafe import escape

from reports import svg
from reports.pages import Field, Floats, Graph, HeatMap, Node, Tile, TreeMap

NAMES, WIDTH, ROW, FOOT = 120.0, 640.0, 20.0, 44.0
"""Layout of a colour map: space for names, width of the map, height of a row, space below for the axis."""
FIELD = (62.0, 420.0, 270.0, 40.0)
"""Layout of a field: space for the vertical axis, width, height, space below for the other axis."""
TITLED = 16.0
"""Vertical position of the name of a field's vertical axis, above the figures."""
FAINT = 0.12
"""Opacity of a field's smallest value."""
BOX = (150.0, 38.0)
GAP = (110.0, 16.0)
"""Width and height of a graph's box, and the distance to the next."""
TREE = (1000.0, 360.0)
HEAD = 17.0
"""Layout of a treemap: width and height, and space for a group's name."""


def heat_map(m: HeatMap) -> svg.Drawing:
    """Rows of cells with a colour that darkens with their share."""
    step, foot = WIDTH / max(m.x.size, 1), ROW * len(m.rows)
    axis = svg.Axis.of_cells(m.x, NAMES, NAMES + WIDTH)
    body = []
    for i, name in enumerate(m.rows):
        body.append(svg.written(NAMES - 8, ROW * i + 14, name, "end"))
        for j in np.flatnonzero(np.isfinite(m.shares[i]) & (m.shares[i] > 0.02)):
            cell = svg.box(NAMES + j * step, ROW * i + 1, step + 0.3, ROW - 2)
            body.append(f'<rect class="heat" {cell} fill-opacity="{min(m.shares[i, j], 1.0):.2f}"/>')
    for tick in svg.log_ticks(float(m.x.min()), float(m.x.max())) if m.x.size > 1 else []:
        body.append(svg.tick_x(axis.at(tick), (0, foot), f"{tick:g}"))
    for mark in m.marks:
        at = axis.at(mark.x)
        body += [
            svg.upright(at, (0, foot), "mark"),
            svg.written(at, foot + 28, mark.label, "middle", "marked"),
        ]
    body.append(svg.written(NAMES + WIDTH / 2, foot + 41, m.x_label, "middle", "axis"))
    return svg.Drawing(NAMES + WIDTH + 10, foot + FOOT, "".join(body), m.title, "chart")


def opacities(value: Floats) -> Floats:
    """Opacity of each cell by the logarithm of its value, 0 if there is none; shape as given."""
    known = value[value > 0]
    if not known.size:
        return np.zeros(value.shape)
    low, high = (float(v) for v in np.log(np.quantile(known, [0.02, 0.98])))
    share = (np.log(np.where(value > 0, value, 1.0)) - low) / max(high - low, 0.1)
    return np.where(value > 0, FAINT + (1.0 - FAINT) * np.clip(share, 0.0, 1.0), 0.0)


def _cells(f: Field) -> list[str]:
    """Rectangles of a field, from the bottom."""
    left, width, height, _ = FIELD
    wide, high = width / f.x.size, height / f.y.size
    opacity = opacities(f.value)
    out = []
    for i, j in np.ndindex(opacity.shape):
        kind = "unstable" if f.unstable[i, j] else "calm" if f.calm[i, j] else "swings"
        if kind == "swings" and opacity[i, j] <= 0:
            continue
        shade = f' fill-opacity="{opacity[i, j]:.2f}"' if kind == "swings" else ""
        cell = svg.box(left + j * wide, height - (i + 1) * high, wide + 0.3, high + 0.3)
        out.append(f'<rect class="cell {kind}" {cell}{shade}/>')
    return out


def field(f: Field, alone: bool = False) -> svg.Drawing:
    """Cells coloured by their value, two axes, and named points; `alone`: without the figure under the axis name."""
    left, width, height, foot = FIELD
    across, along = (left, left + width), (0.0, height)
    x, y = svg.Axis.of_cells(f.x, *across), svg.Axis.of_cells(f.y, height, 0.0)
    body = _cells(f)
    for tick in svg.log_ticks(float(f.x[0]), float(f.x[-1])):
        body.append(svg.tick_x(x.at(tick), along, f"{tick:g}"))
    for tick in svg.log_ticks(float(f.y[0]), float(f.y[-1])):
        down, text = y.at(tick), f"{tick:g}"
        body.append(svg.tick_y(down, across, "" if alone and down < TITLED and len(text) > 3 else text))
    body.append(svg.written(left + width / 2, height + 32, f.x_label, "middle", "axis"))
    body.append(svg.written(4, 12, f.y_label, "start", "axis"))
    held = [(min(max(x.at(p.x), left), left + width), min(max(y.at(p.y), 0.0), height)) for p in f.places]
    named = [(place, *at) for place, at in zip(f.places, held, strict=True)]
    body += svg.named_places(named, (left, 0.0, left + width, height))
    return svg.Drawing(left + width + 10, height + foot, "".join(body), f.title, "graph", natural=True)


def places(g: Graph) -> dict[str, tuple[float, float]]:
    """Upper left corner of every box: columns from left to right, each centred."""
    columns: dict[int, list[Node]] = defaultdict(list)
    for node in g.nodes:
        columns[node.column].append(node)
    most = max(map(len, columns.values()), default=0)
    out = {}
    for at, (_, nodes) in enumerate(sorted(columns.items())):
        top = 0.5 * (most - len(nodes)) * (BOX[1] + GAP[1])
        for i, node in enumerate(nodes):
            out[node.name] = 4 + at * (BOX[0] + GAP[0]), 4 + top + i * (BOX[1] + GAP[1])
    return out


def _arrow(first: tuple[float, float], last: tuple[float, float], text: str) -> str:
    """A curve from one box to another with an arrowhead and a text at its end."""
    a, b, c, d = first[0] + BOX[0], first[1] + BOX[1] / 2, last[0] - 2, last[1] + BOX[1] / 2
    x1, y1, middle, end, x2, y2 = map(svg.digits, (a, b, 0.5 * (a + c), c - 6, c, d))
    curve = f"M{x1},{y1}C{middle},{y1} {middle},{y2} {end},{y2}"
    tip = f'<path class="tip" d="M{x2},{y2}l-8,-4v8Z"/>'
    return f'<path class="line flow" d="{curve}"/>{tip}' + svg.written(c - 10, d - 6, text, "end", "tick")


def graph(g: Graph) -> svg.Drawing:
    """Boxes and arrows."""
    at = places(g)
    body = [_arrow(at[a.first], at[a.last], a.text) for a in g.arrows if a.first in at and a.last in at]
    for node in g.nodes:
        x, y = at[node.name]
        body.append(f'<rect class="box {node.kind}" rx="5" {svg.box(x, y, *BOX)}/>')
        body.append(svg.written(x + 8, y + 16, node.name, "start", "strong"))
        body.append(svg.written(x + 8, y + 31, node.text, "start", "tick"))
    width, height = (max((place[k] for place in at.values()), default=0.0) + BOX[k] + 4 for k in (0, 1))
    return svg.Drawing(width, height, "".join(body), g.title, "graph", natural=True)


class Room(NamedTuple):
    """A rectangle: left, top, width, height."""

    x: float
    y: float
    w: float
    h: float


def squarified(sizes: Sequence[float], room: Room) -> list[Room]:
    """Rectangles with areas proportional to sizes (above zero, the largest first), nearly square, in a rectangle."""
    total = sum(sizes)
    areas = [s * room.w * room.h / total for s in sizes] if total > 0 else []
    out: list[Room] = []
    while areas:
        row = _row(areas, min(room.w, room.h))
        out += (placed := _laid(areas[:row], room))[0]
        room, areas = placed[1], areas[row:]
    return out


def _worst(areas: Sequence[float], side: float) -> float:
    """The worst aspect ratio of a row of rectangles along a side."""
    total = sum(areas)
    return max(side**2 * max(areas) / total**2, total**2 / (side**2 * min(areas)))


def _row(areas: Sequence[float], side: float) -> int:
    """Number of next rectangles in a row for which the worst aspect ratio does not grow."""
    count = 1
    while count < len(areas) and _worst(areas[: count + 1], side) <= _worst(areas[:count], side):
        count += 1
    return count


def _laid(areas: Sequence[float], room: Room) -> tuple[list[Room], Room]:
    """A row along the shorter side of a rectangle, and the remaining rectangle."""
    if room.w < room.h:  # the same for the transposed rectangle
        row, left = _laid(areas, Room(room.y, room.x, room.h, room.w))
        return [Room(r.y, r.x, r.h, r.w) for r in row], Room(left.y, left.x, left.h, left.w)
    out, at = [], room.y
    width = sum(areas) / room.h
    for area in areas:
        out.append(Room(room.x, at, width, area / width))
        at += area / width
    return out, Room(room.x + width, room.y, max(room.w - width, 1e-9), room.h)


def laid_out(m: TreeMap, width: float, height: float) -> list[tuple[str, Room, list[tuple[Tile, Room]]]]:
    """Each group's name and rectangle, and its tiles with theirs, largest first, without tiles of size zero."""
    sized = [(name, [t for t in tiles if t.size > 0]) for name, tiles in m.groups]
    groups = sorted(((n, t) for n, t in sized if t), key=lambda g: -sum(t.size for t in g[1]))
    rooms = squarified([sum(t.size for t in tiles) for _, tiles in groups], Room(0.0, 0.0, width, height))
    out = []
    for (name, tiles), room in zip(groups, rooms, strict=True):
        tiles = sorted(tiles, key=lambda t: -t.size)
        inner = Room(room.x + 1, room.y + HEAD, max(room.w - 2, 1.0), max(room.h - HEAD - 1, 1.0))
        out.append((name, room, list(zip(tiles, squarified([t.size for t in tiles], inner), strict=True))))
    return out


def fitting(text: str, width: float) -> str:
    """A text cut to a width, '' if fewer than four letters fit."""
    most = int((width - 6) / svg.LETTER)
    return text if len(text) <= most else text[: most - 1] + "…" if most >= 4 else ""


def tree_map(m: TreeMap) -> svg.Drawing:
    """The treemap, each tile with a tooltip."""
    body = []
    for name, room, tiles in laid_out(m, *TREE):
        body.append(svg.written(room.x + 3, room.y + 13, fitting(name, room.w), kind="strong"))
        body += [_tile(t, p) for t, p in tiles]
    return svg.Drawing(*TREE, "".join(body), m.title, "chart treemap", role="group")


def _tile(t: Tile, p: Room) -> str:
    title = f"<title>{escape(t.text)}</title>"
    drawn = f'<rect class="tile {escape(t.kind)}" {svg.box(*p)}>{title}</rect>'
    if p.h >= 16:
        drawn += svg.written(p.x + 4, p.y + 13, fitting(t.name, p.w), kind="on")
    return f'<a href="{escape(t.href)}">{drawn}</a>' if t.href else drawn
