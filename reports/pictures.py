"""Pictures of page blocks: their drawings, keys of their colours, and files with one picture each."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from markupsafe import Markup, escape

from reports import maps, plots
from reports.pages import Field, Graph, HeatMap, IntervalChart, Panels, Picture, Plot, TreeMap, Trend
from reports.svg import LETTER, Drawing, digits, written
from reports.texts import visible_parts

ROOM = 1060.0
"""Width of a file with several drawings."""
SPACE, RIM = 14.0, 8.0
"""Space between two drawings, and around all of them."""
LINE = 18.0
"""Height of a line of text."""
FONT = "system-ui, 'Segoe UI', 'Liberation Sans', 'DejaVu Sans', sans-serif"
OWN = (
    "svg text { font-family: %s; } .span { fill: var(--worse); opacity: .12; } "
    ".line.stem { stroke-dasharray: 2 3; stroke-width: 1.8; }"
)
"""Rules that are missing in the style sheet, because pages draw their trends by a script."""


@cache
def asset(name: str) -> str:
    """Text of a style sheet, script or licence."""
    return (files("reports") / "templates" / "assets" / name).read_text("utf-8")


def drawings(block: Picture, zone: str = "UTC", alone: bool = False) -> list[tuple[str, Drawing]]:
    """The drawings of a block, each with a title if there are several; times are in the given time zone.

    alone : whether they are drawn for a separate file.
    """
    match block:
        case Panels():
            return [(p.title, plots.plot(p)) for p in block.plots]
        case IntervalChart():
            return [("", drawn) for drawn in plots.intervals(block)]
        case Plot():
            return [("", plots.plot(block))]
        case Trend():
            return [("", plots.trend(block, zone))]
        case Field():
            return [("", maps.field(block, alone))]
        case HeatMap():
            return [("", maps.heat_map(block))]
        case Graph():
            return [("", maps.graph(block))]
        case TreeMap():
            return [("", maps.tree_map(block))]


def _swatches(block: Picture) -> list[tuple[str, str]]:
    """Each name with its colour sample, 22 wide and 12 high; none for a single line."""
    if isinstance(block, Field | TreeMap):
        kind = "cell" if isinstance(block, Field) else "tile"
        return [(text, f'<rect class="{kind} {k}" width="22" height="12"/>') for k, text in block.keys]
    if isinstance(block, Trend):  # one name for each colour
        first = {band.kind: band for band in reversed(block.bands)}
        named = {band.label: (band.kind, True) for band in block.bands if first[band.kind] is band}
    else:
        shown = block.plots if isinstance(block, Panels) else (block,) if isinstance(block, Plot) else ()
        named = {line.label: (line.kind, line.joined) for p in shown for line in p.lines}
    dots, line = 'class="dots {}" d="M5,6h0M11,6h0M17,6h0"', 'class="line {}" d="M0,6H22"'
    lines = [
        (label, f"<path {(line if joined else dots).format(kind)}/>")
        for label, (kind, joined) in named.items()
    ]
    return lines if len(lines) > 1 else []


def keys(block: Picture) -> Markup:
    """The key of the colours, as a list for a page; empty for a single one."""
    parts = [
        f'<li><svg class="swatch" viewBox="0 0 22 12" aria-hidden="true">{drawn}</svg>{escape(text)}</li>'
        for text, drawn in _swatches(block)
    ]
    return Markup(f'<ul class="legend">{"".join(parts)}</ul>' if parts else "")


def as_file(block: Picture, zone: str = "UTC") -> str:
    """A picture as a self-contained SVG file: title, keys, drawings, and the colours of the style sheet."""
    block = visible_parts(block)
    shown = drawings(block, zone, alone=True)
    width = max([plots.PLOT[0], *(d.width for _, d in shown)])
    wide = ROOM if len(shown) > 1 else width
    body, top = _headed(block, wide)
    drawn, foot = _laid(shown, top, wide)
    inner = re.sub(r"</?a\b[^>]*>", "", "".join([*body, *drawn]))  # a picture next to a text has no links
    box = f"{digits(-RIM)} 0 {digits(wide + 2 * RIM)} {digits(foot)}"
    size = f'width="{digits(wide + 2 * RIM)}" height="{digits(foot)}" viewBox="{box}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{escape(block.title)}">'
    paper = f'<rect x="{digits(-RIM)}" width="100%" height="100%" fill="#fff"/>'
    return f"{head}<style>{_style(inner)}</style>{paper}{inner}</svg>\n"


def _headed(block: Picture, width: float) -> tuple[list[str], float]:
    """Title and keys, and the vertical position of their end."""
    y, x, out = 0.0, 0.0, []
    for line in textwrap.wrap(block.title, int(width / LETTER / 1.15)):
        y += LINE
        out.append(written(0, y, line, kind="strong"))
    swatches, solid = _swatches(block), ' class="solid"' if isinstance(block, Trend) else ""
    y += 6 + LINE * bool(swatches)
    for text, drawn in swatches:
        room = 28 + LETTER * len(text)
        if x > 0 and x + room > width:
            x, y = 0.0, y + LINE
        out.append(f'<g{solid} transform="translate({digits(x)} {digits(y - 10)})">{drawn}</g>')
        out.append(written(x + 28, y, text, kind="tick"))
        x += room + SPACE
    return out, y + 8


def _laid(shown: Sequence[tuple[str, Drawing]], top: float, width: float) -> tuple[list[str], float]:
    """Drawings in rows from the left, and the vertical position of their end."""
    out, x, foot = [], 0.0, top
    for title, d in shown:
        if x > 0 and x + d.width > width:
            x, top = 0.0, foot + SPACE
        head = LINE if title else 0.0
        out += [written(x, top + 12, title, kind="strong")] if title else []
        out.append(
            f'<g class="{d.kind}" transform="translate({digits(x)} {digits(top + head)})">{d.body}</g>'
        )
        x, foot = x + d.width + SPACE, max(foot, top + head + d.height)
    return out, foot + 6


@cache
def _rules() -> tuple[dict[str, str], list[tuple[str, str]]]:
    """Light-mode colours by name, and the style sheet's rules as selector and declarations."""
    sheet = re.sub(r"@media[^{]*\{(?:[^{}]*\{[^{}]*\})*[^{}]*\}", "", asset("page.css"))
    rules = [(s.strip(), d.strip()) for s, d in re.findall(r"([^{}]+)\{([^{}]*)\}", sheet)]
    colours = dict(re.findall(r"--([\w-]+): ([^;]+);", rules[0][1]))
    bands = [(f".band.{kind}", f"fill: {c}; stroke: {c}; stroke-width: .8;") for kind, c in colours.items()]
    own = re.findall(r"([^{}]+)\{([^{}]*)\}", OWN % FONT)
    return colours, [*rules[1:], *bands, *((s.strip(), d.strip()) for s, d in own)]


def _style(drawn: str) -> str:
    """The rules used by a drawing, with light-mode colours."""
    colours, rules = _rules()
    used = {name for held in re.findall(r'class="([^"]*)"', drawn) for name in held.split()}

    def applies(selector: str) -> bool:
        names = [set(re.findall(r"\.([a-z][\w-]*)", part)) for part in selector.split(",")]
        return selector == "svg text" or any(part and part <= used for part in names)

    found = "\n".join(f"{s} {{ {d} }}" for s, d in rules if applies(s)).replace("svg.", ".")
    return re.sub(r"var\(--([\w-]+)\)", lambda m: colours[m[1]], found)
