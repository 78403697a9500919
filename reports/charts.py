"""Pictures for Markdown and print, drawn with matplotlib from the same page data as HTML."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from reports.pages import IntervalChart, Plot, Trend

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
}
"""As the style sheet's in light."""
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
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(color="#dde1e2", linewidth=0.6)
        ax.set_axisbelow(True)
        ax.tick_params(labelsize=8, colors="#5d6970")
    return figure, list(axes[:, 0])


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=110, metadata={"Software": None})
    return out.getvalue()


def _day(time_s: float) -> float:
    """A time as matplotlib's axes count it: days since 1970-01-01."""
    return time_s / 86400.0


def draw(block: Trend | Plot | IntervalChart) -> bytes:
    """A picture as PNG."""
    if isinstance(block, Trend):
        return trend(block)
    return plot(block) if isinstance(block, Plot) else intervals(block)


def trend(t: Trend) -> bytes:
    """Two panels over one time axis, each signal as the band between least and greatest."""
    figure, axes = _figure(9.5, 4.4, 2, sharex=True, height_ratios=(3, 2))
    stamps = t.time_s.astype("datetime64[s]")
    for band in t.bands:
        ax, colour = axes[band.panel], COLOURS[band.kind]
        low, high = np.where(t.gap, np.nan, band.low), np.where(t.gap, np.nan, band.high)
        ax.fill_between(stamps, low, high, color=colour, linewidth=0.7, label=plain(band.label))
    for ax, label in zip(axes, t.panels, strict=True):
        ax.set_ylabel(plain(label), fontsize=8)
        ax.legend(loc="upper right", fontsize=8, frameon=False, ncols=3)
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
    for line in p.lines:
        style = (
            {"linewidth": 1.2}
            if line.joined
            else {"linestyle": "none", "marker": ".", "markersize": 2, "alpha": 0.5}
        )
        ax.plot(line.x, line.y, color=COLOURS[line.kind], label=plain(line.label), **style)
    for mark in p.marks:
        ax.axvline(mark.x, color=COLOURS["worse"], linestyle="--", linewidth=1)
        ax.annotate(plain(mark.label), (mark.x, 1.0), xycoords=("data", "axes fraction"), fontsize=8)
    ax.set_xlabel(plain(p.x_label), fontsize=8)
    ax.set_ylabel(plain(p.y_label), fontsize=8)
    ax.set_title(plain(p.title), fontsize=10, loc="left", pad=14)
    return _png(figure)


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
