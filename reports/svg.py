"""Small pictures as inline SVG: sparklines, cause bars, changes with intervals, curves.

Colours come from style sheets by class, so that light, dark and print need one picture. Texts are escaped.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from markupsafe import Markup, escape

from reports.map_blocks import Mark
from reports.pages import Area, Bars, Floats, IntervalBar, IntervalChart, Line, Panels, Plot, Sparkline, Trend

SPARK = (120.0, 26.0)
ROW = 24.0
LABELS = 110.0
PANEL = (150.0, 56.0, 14.0)
"""Width of a panel's bars, of the figures right of them, and of the space to the next."""
PLOT = (520.0, 300.0)
MARGIN = (56.0, 12.0, 12.0, 42.0)
MOST_POINTS = 1500


def digits(x: float) -> str:
    """A place in the picture, with as many digits as are seen."""
    return f"{x:.1f}".rstrip("0").rstrip(".")


def picture(
    width: float,
    height: float,
    body: Iterable[str],
    label: str,
    kind: str,
    natural: bool = False,
    role: str = "img",
) -> Markup:
    """Drawn parts as a picture with a text for who cannot see it; a `natural` one does not grow with the page.

    role : img, or group for one whose parts are links
    """
    size = f' width="{digits(width)}"' if natural else ""
    head = (
        f'<svg class="{kind}"{size} viewBox="0 0 {digits(width)} {digits(height)}" role="{role}" aria-label="'
    )
    return Markup(head) + escape(label) + Markup('">' + "".join(body) + "</svg>")


def written(x: float, y: float, text: str, anchor: str = "start", kind: str = "") -> str:
    """A text as SVG."""
    return (
        f'<text x="{digits(x)}" y="{digits(y)}" text-anchor="{anchor}" class="{kind}">{escape(text)}</text>'
    )


def sparkline(s: Sparkline) -> Markup:
    """A trend of a cell's size: the area between least and greatest."""
    known = np.isfinite(s.low) & np.isfinite(s.high)
    if not known.any():
        return Markup("")
    width, height = SPARK
    low, high = float(s.low[known].min()), float(s.high[known].max())
    scale = (height - 4) / max(high - low, 1e-9)
    x = np.linspace(0, width, s.low.size)[known]
    top = [
        f"{digits(a)},{digits(height - 2 - (b - low) * scale)}" for a, b in zip(x, s.high[known], strict=True)
    ]
    foot = [
        f"{digits(a)},{digits(height - 2 - (b - low) * scale)}" for a, b in zip(x, s.low[known], strict=True)
    ]
    path = "M" + "L".join(top) + "L" + "L".join(reversed(foot)) + "Z"
    return picture(width, height, [f'<path d="{path}"/>'], "PV of the night", "spark")


def _rail(name: str, share: float, y: float) -> str:
    full = f'<rect class="rail" x="0" y="{digits(y)}" width="60" height="4"/>'
    held = f'<rect class="{escape(name)}" x="0" y="{digits(y)}" width="{digits(0.6 * min(share, 100))}" height="4"/>'
    return full + held


def bars(b: Bars) -> Markup:
    """Shares of 100, one thin bar each, under one another."""
    label = ", ".join(f"{name} {share:.0f} %" for name, share in b.shares)
    body = [_rail(name, share, 6 * i + 1) for i, (name, share) in enumerate(b.shares)]
    return picture(60, 6.0 * len(b.shares), body, label, "bars")


def nice_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round numbers from low to high, at most `most` steps of 1, 2 or 5 times a power of ten."""
    span = max(high - low, 1e-12)
    raw = span / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= raw * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def _reach(chart: IntervalChart) -> tuple[float, float]:
    ends = [x for b in chart.bars for x in (b.low, b.high, b.value) if x is not None and math.isfinite(x)]
    return min([-10.0, *(max(e, -150.0) for e in ends)]), max([10.0, *(min(e, 150.0) for e in ends)])


def _interval(bar: IntervalBar, y: float, at: Floats, reach: tuple[float, float, float]) -> str:
    """A bar from zero to the change, its interval as a line, both cut at the ends; the figure beside it."""
    if bar.value is None or bar.low is None or bar.high is None:
        return written(at[2] + PANEL[1], y + 4, "–", "end", "quiet")
    zero, value, low, high = np.interp([0.0, bar.value, bar.low, bar.high], reach, at)
    left, right = sorted((zero, value))
    place = f'x="{digits(left)}" y="{digits(y - 6)}" width="{digits(right - left)}" height="12"'
    body = f'<rect class="bar {bar.kind}" {place}/>'
    ends = f"M{digits(low)},{digits(y - 4)}v8M{digits(high)},{digits(y - 4)}v8"
    whisker = f'<path class="whisker" d="M{digits(low)},{digits(y)}H{digits(high)}{ends}"/>'
    return body + whisker + written(at[2] + PANEL[1], y + 4, bar.text, "end", bar.kind)


def _panel(chart: IntervalChart, label: str, left: float, rows: list[str]) -> list[str]:
    low, high = _reach(chart)
    at = np.array([left, left + PANEL[0] * low / (low - high), left + PANEL[0]])
    foot = 26 + ROW * len(rows)
    body = [written(left, 14, label, "start", "strong")]
    for tick in nice_ticks(low, high, 4):
        x = float(np.interp(tick, [low, 0, high], at))
        body.append(f'<path class="{"zero" if tick == 0 else "grid"}" d="M{digits(x)},22V{digits(foot)}"/>')
        body.append(written(x, foot + 14, f"{tick:g}", "middle", "tick"))
    bars_ = [b for b in chart.bars if b.label == label]
    return [*body, *(_interval(b, 38 + ROW * rows.index(b.group), at, (low, 0.0, high)) for b in bars_)]


def intervals(chart: IntervalChart) -> Markup:
    """Changes as bars with intervals: a picture for each label, side by side as room allows, a row for each group;
    labels of which nothing is known are left out."""
    rows = list(dict.fromkeys(b.group for b in chart.bars))
    known = [b.label for b in chart.bars if b.value is not None]
    names = [written(0, 42 + ROW * i, row, "start", "") for i, row in enumerate(rows)]
    size = LABELS + sum(PANEL), 46 + ROW * len(rows)
    drawn = [
        picture(*size, [*names, *_panel(chart, label, LABELS, rows)], f"{label}, {chart.unit}", "chart small")
        for label in dict.fromkeys(known)
    ]
    return Markup("").join(drawn)


def _extent(values: list[Floats], pad: float) -> tuple[float, float]:
    joined = np.concatenate(values) if values else np.zeros(1)
    joined = joined[np.isfinite(joined)]
    if joined.size == 0:
        return 0.0, 1.0
    low, high = float(joined.min()), float(joined.max())
    space = pad * (high - low) or (0.0 if high > low else 1.0)
    return low - space, high + space


def _line(line: Line, x: Floats, y: Floats) -> str:
    pairs = zip(x, y, strict=True)
    points = [f"{digits(a)},{digits(b)}" for a, b in pairs if math.isfinite(a) and math.isfinite(b)]
    if line.joined:
        return f'<path class="line {line.kind}" d="M{"L".join(points)}"/>' if points else ""
    return f'<path class="dots {line.kind}" d="{"".join(f"M{p}h0" for p in points)}"/>'


def _area(a: Area, x: Floats, low: Floats, high: Floats) -> str:
    """What lies between two lines."""
    known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    there = [f"{digits(p)},{digits(q)}" for p, q in zip(x[known], high[known], strict=True)]
    back = [f"{digits(p)},{digits(q)}" for p, q in zip(x[known], low[known], strict=True)]
    return (
        f'<path class="area {a.kind}" d="M{"L".join(there)}L{"L".join(reversed(back))}Z"/>' if there else ""
    )


def _decades(low: float, high: float) -> list[float]:
    """Powers of ten between two logarithms; where there are under two, ones, twos and fives as well."""
    found = [float(k) for k in range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)]
    if len(found) >= 2:
        return found[:: max(len(found) // 5, 1)]
    around = range(math.floor(low), math.ceil(high) + 1)
    finer = [k + math.log10(m) for k in around for m in (1, 2, 5)]
    return [f for f in finer if low - 1e-9 <= f <= high + 1e-9]


class _Frame:
    """Where data lie in a plot; along a logarithmic axis all places are logarithms."""

    def __init__(self, p: Plot) -> None:
        joined = any(line.joined for line in p.lines)
        self.log = p.log
        across = [line.x for line in p.lines] + [a.x for a in p.areas]
        along = [line.y for line in p.lines] + [e for a in p.areas for e in (a.low, a.high)]
        along.append(np.array(p.reach, dtype=np.float64))
        self.x = _extent([self._scaled(x, "x") for x in across], 0.0 if joined else 0.04)
        self.y = _extent([self._scaled(y, "y") for y in along], 0.04)
        (self.width, self.height), (self.left, right, self.top, bottom) = PLOT, MARGIN
        self.right, self.foot = self.width - right, self.height - bottom

    def _scaled(self, x: Floats, axis: str) -> Floats:
        return np.log10(np.maximum(x, 1e-300)) if axis in self.log else x

    def px(self, x: Floats) -> Floats:
        """Horizontal place."""
        x = self._scaled(x, "x")
        return self.left + (x - self.x[0]) / (self.x[1] - self.x[0]) * (self.right - self.left)

    def py(self, y: Floats) -> Floats:
        """Vertical place."""
        y = self._scaled(y, "y")
        return self.foot - (y - self.y[0]) / (self.y[1] - self.y[0]) * (self.foot - self.top)

    def _ticks(self, axis: str, ends: tuple[float, float], most: int) -> list[float]:
        if axis in self.log:
            return [10.0**k for k in _decades(*ends)]
        return nice_ticks(*ends, most)

    def grid(self) -> list[str]:
        """Lines and figures of both axes."""
        body = []
        for tick in self._ticks("x", self.x, 6):
            x = float(self.px(np.array(tick)))
            body.append(f'<path class="grid" d="M{digits(x)},{digits(self.top)}V{digits(self.foot)}"/>')
            body.append(written(x, self.foot + 16, f"{tick:.6g}", "middle", "tick"))
        for tick in self._ticks("y", self.y, 5):
            y = float(self.py(np.array(tick)))
            body.append(f'<path class="grid" d="M{digits(self.left)},{digits(y)}H{digits(self.right)}"/>')
            body.append(written(self.left - 6, y + 4, f"{tick:.6g}", "end", "tick"))
        return body

    def mark(self, mark: Mark) -> list[str]:
        """A marked place with its name, on the side where there is room."""
        x = float(self.px(np.array(mark.x)))
        anchor, aside = ("start", 4) if x < self.width * 0.6 else ("end", -4)
        line = f'<path class="mark" d="M{digits(x)},{digits(self.top)}V{digits(self.foot)}"/>'
        return [line, written(x + aside, self.top + 12, mark.label, anchor, "marked")]


def plot(p: Plot) -> Markup:
    """Lines or points over two axes."""
    frame = _Frame(p)
    body = frame.grid()
    for a in p.areas:
        step = max(math.ceil(a.x.size / MOST_POINTS), 1)
        x, low, high = frame.px(a.x[::step]), frame.py(a.low[::step]), frame.py(a.high[::step])
        body.append(_area(a, x, low, high))
    for line in p.lines:
        step = max(math.ceil(line.x.size / MOST_POINTS), 1)
        body.append(_line(line, frame.px(line.x[::step]), frame.py(line.y[::step])))
    for mark in p.marks:
        body += frame.mark(mark)
    body.append(written((frame.left + frame.right) / 2, frame.height - 6, p.x_label, "middle", "axis"))
    turned = f'<g transform="translate(13 {digits((frame.top + frame.foot) / 2)}) rotate(-90)">'
    body.append(f"{turned}{written(0, 0, p.y_label, 'middle', 'axis')}</g>")
    return picture(frame.width, frame.height, body, f"{p.title}: {p.y_label} over {p.x_label}", "plot")


def _named(block: Plot | Panels | Trend) -> dict[str, tuple[str, bool]]:
    """Colour of each name, and whether its points are joined; one name for each colour of a trend."""
    if isinstance(block, Trend):
        first = {band.kind: band for band in reversed(block.bands)}
        return {band.label: (band.kind, True) for band in block.bands if first[band.kind] is band}
    plots = block.plots if isinstance(block, Panels) else (block,)
    return {line.label: (line.kind, line.joined) for p in plots for line in p.lines}


def keys(block: Plot | Panels | Trend) -> Markup:
    """Which line is which, one entry a name; nothing where there is one line alone."""
    named = _named(block)
    if len(named) < 2:
        return Markup("")
    parts = []
    for label, (colour, joined) in named.items():
        path = "M0,6H22" if joined else "M5,6h0M11,6h0M17,6h0"
        kind = "line" if joined else "dots"
        drawn = f'<path class="{kind} {colour}" d="{path}"/>'
        swatch = f'<svg class="swatch" viewBox="0 0 22 12" aria-hidden="true">{drawn}</svg>'
        parts.append(f"<li>{swatch}{escape(label)}</li>")
    return Markup('<ul class="legend">' + "".join(parts) + "</ul>")
