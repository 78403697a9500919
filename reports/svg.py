"""Elements of all pictures: texts, axes with their ticks, paths, and the finished drawing, as SVG.

Colours come from the style sheet by class, so that light, dark and print need one picture. Texts are escaped.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from reports.pages import Floats, Place, Sparkline

SPARK = (120.0, 26.0)
LETTER = 6.6
"""Approximate width of a letter of a tick label."""
POINT = 4.5
"""Radius of a named point."""
LABEL_POSITIONS = tuple(
    (down, across, side)
    for down in (4.0, -9.0, 17.0, -22.0, 30.0)
    for across, side in ((8.0, "start"), (-8.0, "end"), (0.0, "middle"))
    if (down, side) != (4.0, "middle")
)
"""Possible positions of a point's name: down, across, and its anchor; the first free one is used."""
ANCHORED = {"start": 0.0, "middle": 0.5, "end": 1.0}
"""Part of a text's width that is left of its position."""
Corners = tuple[float, float, float, float]
"""Left, top, right and bottom of a rectangle."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """A picture of drawn parts, with an alternative text.

    kind : class of the style sheet; natural : it does not grow with the page; role : img, or group if its parts are
    links
    """

    width: float
    height: float
    body: str
    label: str
    kind: str
    natural: bool = False
    role: str = "img"

    def __html__(self) -> str:
        size = f' width="{digits(self.width)}"' if self.natural else ""
        box = f'viewBox="0 0 {digits(self.width)} {digits(self.height)}"'
        head = f'<svg class="{self.kind}"{size} {box} role="{self.role}" aria-label="{escape(self.label)}">'
        return f"{head}{self.body}</svg>"


@dataclass(frozen=True, slots=True)
class Axis:
    """Mapping of values to positions: `low` at `first`, `high` at `last`; both as logarithms on a log axis."""

    low: float
    high: float
    first: float
    last: float
    log: bool = False

    @classmethod
    def of_cells(cls, values: Floats, first: float, last: float) -> Axis:
        """The axis of cells of equal width, centred on values equally spaced in logarithms."""
        low, high = (float(v) for v in np.log10(values[[0, -1]]))
        half = 0.5 * (high - low) / (values.size - 1) if values.size > 1 else 0.5
        return cls(low - half, high + half, first, last, True)

    def places(self, values: Floats) -> Floats:
        """Positions of values, shape as given."""
        scaled = np.log10(np.maximum(values, 1e-300)) if self.log else values
        return self.first + (scaled - self.low) / (self.high - self.low) * (self.last - self.first)

    def at(self, value: float) -> float:
        """Position of one value."""
        return float(self.places(np.array(value)))

    def ticks(self, most: int) -> list[float]:
        """Round values between its ends, about `most`; powers of ten on a logarithmic axis."""
        if self.log:
            return log_ticks(10.0**self.low, 10.0**self.high, fine=False)
        return nice_ticks(self.low, self.high, most)


def digits(x: float) -> str:
    """A coordinate in the picture, with the visible number of digits."""
    return f"{x:.1f}".rstrip("0").rstrip(".")


def written(x: float, y: float, text: str, anchor: str = "start", kind: str = "") -> str:
    """A text as SVG."""
    place = f'x="{digits(x)}" y="{digits(y)}"'
    return f'<text {place} text-anchor="{anchor}" class="{kind}">{escape(text)}</text>'


def box(x: float, y: float, width: float, height: float) -> str:
    """Position and size of a rectangle, as attributes."""
    return f'x="{digits(x)}" y="{digits(y)}" width="{digits(width)}" height="{digits(height)}"'


def upright(x: float, ends: tuple[float, float], kind: str = "grid") -> str:
    """A line from the top to the bottom of a picture."""
    return f'<path class="{kind}" d="M{digits(x)},{digits(ends[0])}V{digits(ends[1])}"/>'


def tick_x(x: float, ends: tuple[float, float], text: str, below: float = 15.0, kind: str = "grid") -> str:
    """A grid line with its figure below it."""
    return upright(x, ends, kind) + written(x, ends[1] + below, text, "middle", "tick")


def tick_y(y: float, ends: tuple[float, float], text: str) -> str:
    """A grid line with its figure at its left."""
    line = f'<path class="grid" d="M{digits(ends[0])},{digits(y)}H{digits(ends[1])}"/>'
    return line + written(ends[0] - 6, y + 4, text, "end", "tick")


def points(x: Iterable[float], y: Iterable[float]) -> list[str]:
    """Points of a path, without those that are not finite."""
    pairs = zip(x, y, strict=True)
    return [f"{digits(a)},{digits(b)}" for a, b in pairs if math.isfinite(a) and math.isfinite(b)]


def between(x: Floats, low: Floats, high: Floats) -> str:
    """The outline of the area between two lines, '' if nothing is known."""
    known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    there, back = points(x[known], high[known]), points(x[known], low[known])
    return f"M{'L'.join(there)}L{'L'.join(reversed(back))}Z" if there else ""


def named_places(points: Sequence[tuple[Place, float, float]], room: Corners) -> list[str]:
    """Points with their names, each name where it covers no other name or point and stays inside `room`."""
    taken = [(x - POINT, y - POINT, x + POINT, y + POINT) for _, x, y in points]
    out = []
    for place, x, y in points:
        wide, spots = LETTER * len(place.label), []
        for k, (dy, dx, side) in enumerate(LABEL_POSITIONS):
            left, down = x + dx - wide * ANCHORED[side], y + dy
            label_box = (left, down - 10.0, left + wide, down + 3.0)
            outside = (label_box[2] - label_box[0]) * (label_box[3] - label_box[1]) - _covered(
                label_box, [room]
            )
            bad = _covered(label_box, taken) + outside
            spots.append((bad, k, label_box, (x + dx, down, place.label, side, "placed")))
        _, _, label_box, text = min(spots)
        taken.append(label_box)
        out.append(f'<circle class="place {place.kind}" cx="{digits(x)}" cy="{digits(y)}" r="{POINT}"/>')
        out.append(written(*text))
    return out


def _covered(own: Corners, others: Iterable[Corners]) -> float:
    """Area that a rectangle shares with others."""
    sides = ((min(own[2], o[2]) - max(own[0], o[0]), min(own[3], o[3]) - max(own[1], o[1])) for o in others)
    return sum(max(w, 0.0) * max(h, 0.0) for w, h in sides)


def nice_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round numbers from low to high, at most `most` steps of 1, 2 or 5 times a power of ten."""
    raw = max(high - low, 1e-12) / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= raw * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def log_ticks(low: float, high: float, fine: bool = True) -> list[float]:
    """Ones, twos and fives of every power of ten between two values; only powers if there are many, or if a coarse
    axis includes two of them."""
    low, high = low * (1 - 1e-9), high * (1 + 1e-9)
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    powers = [10.0**k for k in exponents if low <= 10.0**k <= high]
    if not fine and len(powers) >= 2:
        return powers[:: max(len(powers) // 5, 1)]
    found = [m * 10.0**k for k in exponents for m in (1, 2, 5) if low <= m * 10.0**k <= high]
    return found if len(found) <= 9 else powers


def sparkline(s: Sparkline) -> Drawing | Markup:
    """A trend of a cell's size: the area between least and greatest."""
    known = np.isfinite(s.low) & np.isfinite(s.high)
    if not known.any():
        return Markup("")
    width, height = SPARK
    low, high = float(s.low[known].min()), float(s.high[known].max())
    scale = (height - 4) / max(high - low, 1e-9)
    x = np.linspace(0, width, s.low.size)
    foot, top = (height - 2 - (y - low) * scale for y in (s.low, s.high))
    return Drawing(width, height, f'<path d="{between(x, foot, top)}"/>', "PV of the night", "spark")
