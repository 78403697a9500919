"""Rectangles as large as what they stand for, in groups: squarified (Bruls, Huizing, van Wijk 2000), as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup, escape

from reports.map_blocks import Tile, TreeMap
from reports.svg import digits, picture, written

WIDTH, HEIGHT = 1000.0, 360.0
HEAD = 17.0
"""Room for a group's name."""
LETTER = 6.6
"""Width of a letter at the size of a tile's name, about."""


@dataclass(frozen=True, slots=True)
class Place:
    """A rectangle: left, top, width, height."""

    x: float
    y: float
    w: float
    h: float


def squarified(sizes: Sequence[float], room: Place) -> list[Place]:
    """Rectangles of areas in proportion to sizes (above zero, the largest first), as square as can be, in a room."""
    total = sum(sizes)
    areas = [s * room.w * room.h / total for s in sizes] if total > 0 else []
    out: list[Place] = []
    while areas:
        row = _row(areas, min(room.w, room.h))
        out += (placed := _laid(areas[:row], room))[0]
        room, areas = placed[1], areas[row:]
    return out


def _worst(areas: Sequence[float], side: float) -> float:
    """The worst ratio of sides of a row of rectangles along a side."""
    total = sum(areas)
    return max(side**2 * max(areas) / total**2, total**2 / (side**2 * min(areas)))


def _row(areas: Sequence[float], side: float) -> int:
    """How many of the next rectangles make a row whose worst ratio does not grow."""
    count = 1
    while count < len(areas) and _worst(areas[: count + 1], side) <= _worst(areas[:count], side):
        count += 1
    return count


def _laid(areas: Sequence[float], room: Place) -> tuple[list[Place], Place]:
    """A row along the shorter side of a room, and the room that is left."""
    total, out, at = sum(areas), [], 0.0
    if room.w >= room.h:
        width = total / room.h
        for area in areas:
            out.append(Place(room.x, room.y + at, width, area / width))
            at += area / width
        return out, Place(room.x + width, room.y, max(room.w - width, 1e-9), room.h)
    height = total / room.w
    for area in areas:
        out.append(Place(room.x + at, room.y, area / height, height))
        at += area / height
    return out, Place(room.x, room.y + height, room.w, max(room.h - height, 1e-9))


def laid_out(m: TreeMap, width: float, height: float) -> list[tuple[str, Place, list[tuple[Tile, Place]]]]:
    """Each group's name and room, and its tiles with theirs, the largest first; tiles without size are left out."""
    groups = [(g.name, [t for t in g.tiles if t.size > 0]) for g in m.groups]
    groups = sorted(((n, t) for n, t in groups if t), key=lambda g: -sum(t.size for t in g[1]))
    rooms = squarified([sum(t.size for t in tiles) for _, tiles in groups], Place(0.0, 0.0, width, height))
    out = []
    for (name, tiles), room in zip(groups, rooms, strict=True):
        tiles = sorted(tiles, key=lambda t: -t.size)
        inner = Place(room.x + 1, room.y + HEAD, max(room.w - 2, 1.0), max(room.h - HEAD - 1, 1.0))
        out.append((name, room, list(zip(tiles, squarified([t.size for t in tiles], inner), strict=True))))
    return out


def fitting(text: str, width: float) -> str:
    """A text cut to a width, '' where not even four letters fit."""
    most = int((width - 6) / LETTER)
    return text if len(text) <= most else text[: most - 1] + "…" if most >= 4 else ""


def tree_map(m: TreeMap) -> Markup:
    """The map as SVG, each tile with its text for who points at it."""
    body = []
    for name, room, tiles in laid_out(m, WIDTH, HEIGHT):
        body.append(written(room.x + 3, room.y + 13, fitting(name, room.w), kind="strong"))
        body += [_tile(t, p) for t, p in tiles]
    return picture(WIDTH, HEIGHT, body, m.title, "chart treemap", role="group")


def _tile(t: Tile, p: Place) -> str:
    place = f'x="{digits(p.x)}" y="{digits(p.y)}" width="{digits(p.w)}" height="{digits(p.h)}"'
    drawn = f'<rect class="tile {escape(t.kind)}" {place}><title>{escape(t.text)}</title></rect>'
    if p.h >= 16:
        drawn += written(p.x + 4, p.y + 13, fitting(t.name, p.w), kind="on")
    return f'<a href="{escape(t.href)}">{drawn}</a>' if t.href else drawn
