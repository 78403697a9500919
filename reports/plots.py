"""Curves, changes with intervals, and trends, as SVG."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np

from reports import svg
from reports.pages import Band, Floats, IntervalBar, IntervalChart, Line, Mark, Plot, Trend

PLOT = (520.0, 300.0)
MARGIN = (56.0, 12.0, 12.0, 42.0)
"""Margins left, right, above and below a drawing."""
MOST_POINTS = 1500
ROW = 24.0
LABELS = 110.0
PANEL = (150.0, 56.0, 14.0)
"""Width of a panel's bars, of the figures right of them, and of the distance to the next."""
RIM = 150.0
"""Changes are drawn up to this [%]; the adjacent text gives the exact value."""
TREND, FIRST, OTHER = 1040.0, 200.0, 130.0
"""Width of a trend, and heights of its first panel and of the others."""
BUCKETS = 1040
"""Largest number of drawn buckets of a trend: one per pixel."""
DAY_S = 86400
STEPS_S = (
    *(1, 2, 5, 10, 30, 60, 300, 900, 1800, 3600, 7200, 21600, 43200),
    *(days * DAY_S for days in (1, 2, 7, 28)),
)
"""Possible tick distances of a time axis [s]."""
MOST_TIMES = 9
"""Largest number of ticks of a time axis."""


def _extent(values: list[Floats], pad: float) -> tuple[float, float]:
    """Minimum and maximum of all finite values, with some margin."""
    joined = np.concatenate(values) if values else np.zeros(1)
    joined = joined[np.isfinite(joined)]
    if joined.size == 0:
        return 0.0, 1.0
    low, high = float(joined.min()), float(joined.max())
    space = pad * (high - low) or (0.0 if high > low else 1.0)
    return low - space, high + space


def _axes(p: Plot) -> tuple[svg.Axis, svg.Axis]:
    """Both axes of a plot, with a margin around points but none around lines."""
    joined = any(line.joined for line in p.lines)
    x = [line.x for line in p.lines] + [a.x for a in p.areas]
    y = [line.y for line in p.lines] + [e for a in p.areas for e in (a.low, a.high)]
    y += [np.array(p.reach, dtype=np.float64)]
    logs = {axis: axis in p.log for axis in "xy"}
    x, y = ([np.log10(np.maximum(v, 1e-300)) if logs[a] else v for v in of] for a, of in (("x", x), ("y", y)))
    (width, height), (left, right, top, bottom) = PLOT, MARGIN
    across = svg.Axis(*_extent(x, 0.0 if joined else 0.04), left, width - right, logs["x"])
    return across, svg.Axis(*_extent(y, 0.04), height - bottom, top, logs["y"])


def _few(values: Floats) -> Floats:
    """At most MOST_POINTS values of a line, equally spaced."""
    return values[:: max(math.ceil(values.size / MOST_POINTS), 1)]


def _line(line: Line, x: Floats, y: Floats) -> str:
    there = svg.points(x, y)
    if line.joined:
        return f'<path class="line {line.kind}" d="M{"L".join(there)}"/>' if there else ""
    return f'<path class="dots {line.kind}" d="{"".join(f"M{p}h0" for p in there)}"/>'


def _mark(mark: Mark, x: svg.Axis, ends: tuple[float, float]) -> str:
    """A marked position with its name, on the side with enough space."""
    at = x.at(mark.x)
    anchor, aside = ("start", 4) if at < PLOT[0] * 0.6 else ("end", -4)
    return svg.upright(at, ends, "mark") + svg.written(at + aside, ends[0] + 12, mark.label, anchor, "marked")


def _turned(x: float, y: float, text: str) -> str:
    """The label of a vertical axis."""
    label = svg.written(0, 0, text, "middle", "axis")
    return f'<g transform="translate({svg.digits(x)} {svg.digits(y)}) rotate(-90)">{label}</g>'


def plot(p: Plot) -> svg.Drawing:
    """Lines or points over two axes."""
    x, y = _axes(p)
    across, along = (x.first, x.last), (y.last, y.first)
    body = [
        svg.tick_x(x.at(v), along, _number_or_date(v, p.day), 16) for v in x.ticks(6) if _is_day(v, p.day)
    ]
    body += [svg.tick_y(y.at(v), across, f"{v:.6g}") for v in y.ticks(5)]
    for a in p.areas:
        outline = svg.between(x.places(_few(a.x)), y.places(_few(a.low)), y.places(_few(a.high)))
        body += [f'<path class="area {a.kind}" d="{outline}"/>'] if outline else []
    body += [_line(line, x.places(_few(line.x)), y.places(_few(line.y))) for line in p.lines]
    body += [_mark(mark, x, along) for mark in p.marks]
    named = [(place, x.at(place.x), y.at(place.y)) for place in p.places]
    body += svg.named_places(named, (across[0], along[0], across[1], along[1]))
    body.append(svg.written((x.first + x.last) / 2, PLOT[1] - 6, p.x_label, "middle", "axis"))
    body.append(_turned(13, (y.first + y.last) / 2, p.y_label))
    return svg.Drawing(*PLOT, "".join(body), f"{p.title}: {p.y_label} over {p.x_label}", "plot")


def _is_day(value: float, day: str) -> bool:
    """Whether a tick is at a whole day, if its axis counts days."""
    return not day or value == round(value)


def _number_or_date(value: float, day: str) -> str:
    """Label of a tick: a number, or the date so many days after a day."""
    if not day:
        return f"{value:.6g}"
    at = date.fromisoformat(day) + timedelta(days=round(value))
    return f"{at.day} {at:%b}"


def intervals(chart: IntervalChart) -> list[svg.Drawing]:
    """Changes as bars with intervals: a picture for each label, side by side if there is space, a row for each group,
    without labels whose values are all unknown."""
    rows = list(dict.fromkeys(b.group for b in chart.bars))
    known = [b.label for b in chart.bars if b.value is not None]
    names = "".join(svg.written(0, 42 + ROW * i, row) for i, row in enumerate(rows))
    size = LABELS + sum(PANEL), 46 + ROW * len(rows)
    return [
        svg.Drawing(*size, names + _panel(chart, label, rows), f"{label}, {chart.unit}", "chart small")
        for label in dict.fromkeys(known)
    ]


def _panel(chart: IntervalChart, label: str, rows: list[str]) -> str:
    ends = [x for b in chart.bars for x in (b.low, b.high, b.value) if x is not None and math.isfinite(x)]
    low, high = min([-10.0, *(max(e, -RIM) for e in ends)]), max([10.0, *(min(e, RIM) for e in ends)])
    x, foot = svg.Axis(low, high, LABELS, LABELS + PANEL[0]), 26 + ROW * len(rows)
    body = [svg.written(LABELS, 14, label, "start", "strong")]
    for tick in x.ticks(4):
        body.append(svg.tick_x(x.at(tick), (22, foot), f"{tick:g}", 14, "grid" if tick else "zero"))
    own = [b for b in chart.bars if b.label == label]
    return "".join([*body, *(_interval(b, 38 + ROW * rows.index(b.group), x) for b in own)])


def _interval(bar: IntervalBar, y: float, x: svg.Axis) -> str:
    """A bar from zero to the change, its interval as a line, both cut at the ends; the figure next to it."""
    if bar.value is None or bar.low is None or bar.high is None:
        return svg.written(x.last + PANEL[1], y + 4, "–", "end", "quiet")
    zero, value, low, high = x.places(np.clip([0.0, bar.value, bar.low, bar.high], x.low, x.high))
    left, right = sorted((zero, value))
    body = f'<rect class="bar {bar.kind}" {svg.box(left, y - 6, right - left, 12)}/>'
    ends = f"M{svg.digits(low)},{svg.digits(y - 4)}v8M{svg.digits(high)},{svg.digits(y - 4)}v8"
    whisker = f'<path class="whisker" d="M{svg.digits(low)},{svg.digits(y)}H{svg.digits(high)}{ends}"/>'
    return body + whisker + svg.written(x.last + PANEL[1], y + 4, bar.text, "end", bar.kind)


def trend(t: Trend, zone: str) -> svg.Drawing:
    """Panels over one time axis in a time zone, each signal as the band between minimum and maximum; if a trend opens
    on a span, only that span."""
    if t.opening is not None:
        part = slice(*np.searchsorted(t.time_s, t.opening))
        bands = tuple(replace(b, low=b.low[part], high=b.high[part]) for b in t.bands)
        t = replace(t, time_s=t.time_s[part], gap=t.gap[part], bands=bands)
    start, end = (float(t.time_s[k]) if t.time_s.size else float(k + 1) for k in (0, -1))
    x = svg.Axis(start, max(end, start + 1e-3), MARGIN[0], TREND - 2 * MARGIN[1])
    across, top, body = (x.first, x.last), MARGIN[2], []
    for k, label in enumerate(t.panels):
        foot = top + (OTHER if k else FIRST)
        y = svg.Axis(*_held(t, k), foot, top)
        body += [svg.tick_y(y.at(v), across, f"{v:.6g}") for v in y.ticks(5)]
        body += [svg.upright(x.at(at), (top, foot)) for at, _ in _times(start, end, zone)]
        for a, b in t.spans:
            left, right = x.places(np.clip([a, b], start, end))
            body.append(f'<rect class="span" {svg.box(left, top, right - left, foot - top)}/>')
        body += [_band(band, t, x, y) for band in t.bands if band.panel == k]
        for mark in t.marks:
            body.append(
                _mark(mark, x, (top, foot)) if not k else svg.upright(x.at(mark.x), (top, foot), "mark")
            )
        body.append(_turned(13, (top + foot) / 2, label))
        top = foot + 12
    body += [svg.written(x.at(at), top + 4, text, "middle", "tick") for at, text in _times(start, end, zone)]
    body.append(svg.written((x.first + x.last) / 2, top + 22, zone, "middle", "axis"))
    return svg.Drawing(TREND, top + 30, "".join(body), t.title, "plot")


def _held(t: Trend, panel: int) -> tuple[float, float]:
    """Ends of a panel's axis, at least as far apart as the trend requires."""
    shown = [np.where(t.gap, np.nan, e) for b in t.bands if b.panel == panel for e in (b.low, b.high)]
    low, high = _extent(shown, 0.04)
    more = 0.5 * max((t.least[panel] if panel < len(t.least) else 0.0) - (high - low), 0.0)
    return low - more, high + more


def _band(band: Band, t: Trend, x: svg.Axis, y: svg.Axis) -> str:
    """A signal's outlines, one between two gaps; neighbouring buckets are merged if there are too many."""
    n = t.time_s.size
    edges = np.unique(np.arange(min(BUCKETS, n)) * n // max(min(BUCKETS, n), 1))
    low, high = (np.where(t.gap, np.nan, v) for v in (band.low, band.high))
    low, high, at = np.fmin.reduceat(low, edges), np.fmax.reduceat(high, edges), x.places(t.time_s[edges])
    parts = np.split(np.arange(edges.size), np.flatnonzero(np.diff(np.isfinite(low).astype(int))) + 1)
    outlines = [svg.between(at[i], y.places(low[i]), y.places(high[i])) for i in parts]
    return f'<path class="band {band.kind}" d="{"".join(outlines)}"/>'


def _times(start: float, end: float, zone: str) -> list[tuple[float, str]]:
    """Ticks of a time axis in a time zone, and their labels."""
    step = next((s for s in STEPS_S if (end - start) / s <= MOST_TIMES), STEPS_S[-1])
    clock = ZoneInfo(zone)
    ahead = datetime.fromtimestamp(start, UTC).astimezone(clock).utcoffset()
    offset = ahead.total_seconds() if ahead else 0.0
    whole = range(math.ceil((start + offset) / step), math.floor((end + offset) / step) + 1)
    form = "%H:%M:%S" if step < 60 else "%H:%M"
    out = []
    for at in (k * step - offset for k in whole):
        local = datetime.fromtimestamp(at, UTC).astimezone(clock)
        midnight = step >= 60 and local.hour == local.minute == 0
        out.append((at, f"{local.day} {local:%b}" if step >= DAY_S or midnight else f"{local:{form}}"))
    return out
