"""Pictures for Markdown and print, drawn with matplotlib from the same page data as HTML."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from reports import map_charts
from reports.map_blocks import Field, Graph, HeatMap, TreeMap
from reports.pages import IntervalChart, Panels, Picture, Plot, Trend
from reports.visible import visible_parts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    "better": "#1b7a4b",
    "worse": "#b3361c",
    "unclear": "#9aa3a8",
    "incomparable": "#c9ad62",
    "sp": "#8a949a",
    "pv": "#0b5c8a",
    "op": "#a0521d",
    "recorded": "#2a3238",
    "baseline": "#d97706",
    "model": "#1f6fb4",
    "brought": "#8e44ad",
    "stuck": "#b3361c",
    "edge": "#7fa9cd",
}
"""As the style sheet's in light."""
DASHES = {"baseline": "--", "edge": ":"}
"""Lines that are not solid."""
ACROSS = 3
"""Small plots side by side."""
RIM = 150.0
"""Changes are drawn to this [%]; the text beside says more."""


def plain(text: str) -> str:
    """Text that matplotlib does not take for mathematics."""
    return text.replace("$", r"\$")


def _figure(width: float, height: float, rows: int = 1, **more: Any) -> tuple[Figure, list[Axes]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 1, squeeze=False, **more)
    for ax in axes[:, 0]:
        _styled(ax)
    return figure, list(axes[:, 0])


def _styled(ax: Axes) -> None:
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(color="#dde1e2", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(labelsize=8, colors="#5d6970")


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=110, metadata={"Software": None})
    return out.getvalue()


def _day(time_s: float) -> float:
    """A time as matplotlib's axes count it: days since 1970-01-01."""
    return time_s / 86400.0


def draw(block: Picture) -> bytes:
    """A picture as PNG."""
    block = visible_parts(block)
    if isinstance(block, HeatMap):
        return map_charts.heat_map(block)
    if isinstance(block, Field):
        return map_charts.field(block)
    if isinstance(block, TreeMap):
        return map_charts.tree_map(block)
    if isinstance(block, Graph):
        return map_charts.graph(block)
    if isinstance(block, Trend):
        return trend(block)
    if isinstance(block, Panels):
        return panels(block)
    return plot(block) if isinstance(block, Plot) else intervals(block)


def trend(t: Trend) -> bytes:
    """Panels over one time axis, each signal as the band between least and greatest."""
    rows = len(t.panels)
    figure, axes = _figure(9.5, 1.2 + 1.6 * rows, rows, sharex=True, height_ratios=(3, *[2] * (rows - 1)))
    stamps = (1000.0 * t.time_s).astype("datetime64[ms]")
    for band in t.bands:
        ax, colour = axes[band.panel], COLOURS[band.kind]
        low, high = np.where(t.gap, np.nan, band.low), np.where(t.gap, np.nan, band.high)
        ax.fill_between(stamps, low, high, color=colour, linewidth=0.7, label=plain(band.label))
    for ax, label in zip(axes, t.panels, strict=True):
        ax.set_ylabel(plain(label), fontsize=8)
        ax.legend(loc="upper right", fontsize=8, frameon=False, ncols=3)
        for first, last in t.spans:
            ax.axvspan(_day(first), _day(last), color=COLOURS["worse"], alpha=0.12, linewidth=0)
        for mark in t.marks:
            ax.axvline(_day(mark.x), color=COLOURS["worse"], linestyle="--", linewidth=1)
    for mark in t.marks:
        axes[0].annotate(
            plain(mark.label),
            (_day(mark.x), 1.0),
            xycoords=("data", "axes fraction"),
            fontsize=8,
        )
    axes[0].set_title(plain(t.title), fontsize=10, loc="left", pad=14)
    return _png(figure)


def plot(p: Plot) -> bytes:
    """Lines or points over two axes."""
    figure, (ax,) = _figure(5.4, 3.3)
    _onto(ax, p)
    if len({line.label for line in p.lines}) > 1:
        ax.legend(fontsize=7, frameon=False)
    ax.set_title(plain(p.title), fontsize=10, loc="left", pad=14)
    return _png(figure)


def panels(block: Panels) -> bytes:
    """Small plots three in a row, with one key."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(block.plots) // ACROSS)
    figure = Figure(figsize=(10.5, 2.7 * rows + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, ACROSS, squeeze=False).ravel()
    known: dict[str, Any] = {}
    for ax, p in zip(axes, block.plots, strict=False):
        _styled(ax)
        _onto(ax, p)
        ax.set_title(plain(p.title), fontsize=9, loc="left")
        known.update(dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True)))
    for ax in axes[len(block.plots) :]:
        ax.set_axis_off()
    figure.legend(
        list(known.values()), list(known), loc="outside upper right", ncols=4, fontsize=8, frameon=False
    )
    return _png(figure)


def _onto(ax: Axes, p: Plot) -> None:
    """Areas, lines, marks and labels of a plot."""
    for a in p.areas:
        ax.fill_between(a.x, a.low, a.high, color=COLOURS[a.kind], alpha=0.2, linewidth=0)
    for line in p.lines:
        style: dict[str, Any] = (
            {"linewidth": 1.2, "linestyle": DASHES.get(line.kind, "-")}
            if line.joined
            else {"linestyle": "none", "marker": ".", "markersize": 2, "alpha": 0.5}
        )
        ax.plot(line.x, line.y, color=COLOURS[line.kind], label=plain(line.label), **style)
    for mark in p.marks:
        ax.axvline(mark.x, color=COLOURS["worse"], linestyle="--", linewidth=1)
        ax.annotate(plain(mark.label), (mark.x, 1.0), xycoords=("data", "axes fraction"), fontsize=8)
    if p.reach and p.lines and len(p.lines[0].x):
        ax.update_datalim([(p.lines[0].x[0], y) for y in p.reach], updatex=False)
        ax.autoscale_view()
    if "x" in p.log:
        ax.set_xscale("log")
    if "y" in p.log:
        ax.set_yscale("log")
    ax.set_xlabel(plain(p.x_label), fontsize=8)
    ax.set_ylabel(plain(p.y_label), fontsize=8)


def intervals(chart: IntervalChart) -> bytes:
    """Changes as bars with intervals, grouped."""
    figure, (ax,) = _figure(7.6, 0.8 + 0.23 * (len(chart.bars) + len({b.group for b in chart.bars})))
    y, labels, group = 0.0, [], None
    for bar in chart.bars:
        if bar.group != group:
            group = bar.group
            labels.append((y, plain(group), "bold"))
            y -= 1
        labels.append((y, plain(bar.label), "normal"))
        if bar.value is not None and bar.low is not None and bar.high is not None:
            ends = np.clip([bar.value, bar.low, bar.high], -RIM, RIM)
            ax.barh(y, ends[0], color=COLOURS[bar.kind], height=0.62)
            ax.plot(ends[1:], [y, y], color="#1d2429", linewidth=1)
        ax.annotate(plain(bar.text), (1.01, y), xycoords=("axes fraction", "data"), fontsize=7, va="center")
        y -= 1
    ax.set_yticks([k[0] for k in labels], [k[1] for k in labels], fontsize=8)
    for tick, (_, _, weight) in zip(ax.get_yticklabels(), labels, strict=True):
        tick.set_fontweight(weight)
    ax.axvline(0, color="#5d6970", linewidth=0.8)
    ax.set_xlabel(plain(chart.unit), fontsize=8)
    ax.set_title(plain(chart.title), fontsize=10, loc="left")
    ax.grid(visible=False, axis="y")
    return _png(figure)
