"""A value over two axes that count in powers, as inline SVG; colours come from style sheets, texts are escaped."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from reports.map_blocks import Field
from reports.maps import log_ticks
from reports.pages import Floats
from reports.svg import digits, picture, written

LEFT, WIDTH, HEIGHT, FOOT = 62.0, 420.0, 270.0, 40.0
"""Room for the vertical axis, size of the field, room below for the other axis."""
FAINT = 0.12
"""Opacity of the least value."""


def _across(values: Floats, at: float, length: float) -> float:
    """Where a value lies on an axis whose cells are centred on values that rise evenly in logarithms."""
    ends = np.log(values[[0, -1]])
    share = (np.log(at) - ends[0]) / (ends[1] - ends[0])
    return float((0.5 + share * (values.size - 1)) / values.size * length)


def opacities(value: Floats) -> Floats:
    """Opacity of each cell by the logarithm of its value, 0 where there is none; shape as given."""
    known = value[value > 0]
    if not known.size:
        return np.zeros(value.shape)
    low, high = (float(v) for v in np.log(np.quantile(known, [0.02, 0.98])))
    share = (np.log(np.where(value > 0, value, 1.0)) - low) / max(high - low, 0.1)
    return np.where(value > 0, FAINT + (1.0 - FAINT) * np.clip(share, 0.0, 1.0), 0.0)


def _cells(f: Field) -> list[str]:
    """Rectangles of a field, from the top."""
    width, height = WIDTH / f.x.size, HEIGHT / f.y.size
    opacity = opacities(f.value)
    out = []
    for i in range(f.y.size):
        top = HEIGHT - (i + 1) * height
        for j in range(f.x.size):
            kind = "unstable" if f.unstable[i, j] else "calm" if f.calm[i, j] else "swings"
            if kind == "swings" and opacity[i, j] <= 0:
                continue
            place = f'x="{digits(LEFT + j * width)}" y="{digits(top)}"'
            size = f'width="{digits(width + 0.3)}" height="{digits(height + 0.3)}"'
            shade = f' fill-opacity="{opacity[i, j]:.2f}"' if kind == "swings" else ""
            out.append(f'<rect class="cell {kind}" {place} {size}{shade}/>')
    return out


def _axes(f: Field) -> list[str]:
    out = []
    for tick in log_ticks(float(f.x[0]), float(f.x[-1])):
        x = LEFT + _across(f.x, tick, WIDTH)
        out += [f'<path class="grid" d="M{digits(x)},0V{digits(HEIGHT)}"/>']
        out += [written(x, HEIGHT + 15, f"{tick:g}", "middle", "tick")]
    for tick in log_ticks(float(f.y[0]), float(f.y[-1])):
        y = HEIGHT - _across(f.y, tick, HEIGHT)
        out += [f'<path class="grid" d="M{digits(LEFT)},{digits(y)}H{digits(LEFT + WIDTH)}"/>']
        out += [written(LEFT - 6, y + 4, f"{tick:g}", "end", "tick")]
    out.append(written(LEFT + WIDTH / 2, HEIGHT + 32, f.x_label, "middle", "axis"))
    return [*out, written(4, 12, f.y_label, "start", "axis")]


def field(f: Field) -> Markup:
    """Cells coloured by their value, two axes, and named points."""
    body = [*_cells(f), *_axes(f)]
    for place in f.places:
        x, y = LEFT + _across(f.x, place.x, WIDTH), HEIGHT - _across(f.y, place.y, HEIGHT)
        x, y = min(max(x, LEFT), LEFT + WIDTH), min(max(y, 0.0), HEIGHT)
        body.append(f'<circle class="place {place.kind}" cx="{digits(x)}" cy="{digits(y)}" r="4.5"/>')
        end = x > LEFT + 0.75 * WIDTH
        body.append(written(x - 8 if end else x + 8, y + 4, place.label, "end" if end else "start", "placed"))
    return picture(LEFT + WIDTH + 10, HEIGHT + FOOT, body, f.title, "graph", natural=True)
