"""Colour maps and graphs for Markdown and print, drawn with matplotlib from the same page data as HTML."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from reports.map_blocks import Field, Graph, HeatMap, TreeMap
from reports.maps import BOX, places
from reports.treemap import HEIGHT, WIDTH, fitting, laid_out

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EDGES = {"source": "#b3361c", "follower": "#2b75a8", "candidate": "#b98900"}
"""As the style sheet's in light."""
FILLS = {"valve": "#c2511b", "tuning": "#b98900", "load": "#2b75a8", "unclear": "#6d777d", "calm": "#dfe7e3"}


def _figure(width: float, height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=110, metadata={"Software": None})
    return out.getvalue()


def _plain(text: str) -> str:
    return text.replace("$", r"\$")


def heat_map(m: HeatMap) -> bytes:
    """Rows of colours over a logarithmic axis."""
    figure = _figure(8.5, 1.2 + 0.28 * len(m.rows))
    ax = figure.subplots()
    step = (m.x[-1] / m.x[0]) ** (0.5 / max(m.x.size - 1, 1))
    edges = np.concatenate((m.x / step, m.x[-1:] * step))
    ax.pcolormesh(edges, np.arange(len(m.rows) + 1), m.shares, cmap="Blues", vmin=0, vmax=1)
    ax.set_xscale("log")
    ax.set_yticks(np.arange(len(m.rows)) + 0.5, [_plain(r) for r in m.rows], fontsize=8)
    ax.invert_yaxis()
    for mark in m.marks:
        ax.axvline(mark.x, color=EDGES["source"], linestyle="--", linewidth=1)
        ax.annotate(_plain(mark.label), (mark.x, 1.0), xycoords=("data", "axes fraction"), fontsize=8)
    ax.set_xlabel(_plain(m.x_label), fontsize=8)
    ax.set_title(_plain(m.title), fontsize=10, loc="left", pad=14)
    return _png(figure)


def field(f: Field) -> bytes:
    """Colours over two logarithmic axes, with named points."""
    from matplotlib.colors import ListedColormap, LogNorm

    figure = _figure(6.0, 4.4)
    ax = figure.subplots()
    known = f.value[f.value > 0]
    low, high = (float(v) for v in np.quantile(known, [0.02, 0.98])) if known.size else (1.0, 10.0)
    norm = LogNorm(max(low, 1e-9), max(high, 2.0 * low, 1e-8))
    shown = np.where(f.value > 0, f.value, np.nan)
    ax.pcolormesh(f.x, f.y, shown, cmap="YlOrBr", shading="nearest", norm=norm)
    for mask, colour in ((f.calm, "#bfe3c6"), (f.unstable, FILLS["valve"])):
        ax.pcolormesh(f.x, f.y, np.where(mask, 1.0, np.nan), cmap=ListedColormap([colour]), shading="nearest")
    for place in f.places:
        ax.plot(place.x, place.y, "o", color="#2a3238", markersize=5)
        ax.annotate(
            _plain(place.label), (place.x, place.y), xytext=(6, 4), textcoords="offset points", fontsize=8
        )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel(_plain(f.x_label), fontsize=8)
    ax.set_ylabel(_plain(f.y_label), fontsize=8)
    ax.set_title(_plain(f.title), fontsize=10, loc="left", pad=14)
    return _png(figure)


def graph(g: Graph) -> bytes:
    """Boxes and arrows."""
    at = places(g)
    width = max((x for x, _ in at.values()), default=0.0) + BOX[0] + 8
    height = max((y for _, y in at.values()), default=0.0) + BOX[1] + 8
    figure = _figure(width / 90, height / 90 + 0.4)
    ax = figure.subplots()
    ax.set(xlim=(0, width), ylim=(height, 0))
    ax.set_axis_off()
    for arrow in g.arrows:
        (x1, y1), (x2, y2) = at[arrow.first], at[arrow.last]
        ends = (x1 + BOX[0], y1 + BOX[1] / 2), (x2, y2 + BOX[1] / 2)
        ax.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "-|>", "color": "#5d6970"})
        ax.text(ends[1][0] - 12, ends[1][1] - 4, _plain(arrow.text), fontsize=7, ha="right", color="#5d6970")
    for node in g.nodes:
        x, y = at[node.name]
        style = {"edgecolor": EDGES.get(node.kind, "#9aa3a8"), "facecolor": "white", "linewidth": 1.4}
        ax.add_patch(_rectangle(x, y, style))
        ax.text(x + 8, y + 15, _plain(node.name), fontsize=8, weight="bold")
        ax.text(x + 8, y + 30, _plain(node.text), fontsize=7, color="#5d6970")
    ax.set_title(_plain(g.title), fontsize=10, loc="left")
    return _png(figure)


def _rectangle(x: float, y: float, style: dict[str, object]):  # type: ignore[no-untyped-def]
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), BOX[0], BOX[1], **style)  # type: ignore[arg-type]


def tree_map(m: TreeMap) -> bytes:
    """Rectangles in groups, with the names that fit."""
    from matplotlib.patches import Rectangle

    figure = _figure(10.0, 4.0)
    ax = figure.subplots()
    for name, room, tiles in laid_out(m, WIDTH, HEIGHT):
        ax.text(room.x + 3, room.y + 13, _plain(fitting(name, room.w)), fontsize=8, weight="bold")
        for tile, at in tiles:
            fill = FILLS.get(tile.kind, FILLS["unclear"])
            ax.add_patch(Rectangle((at.x, at.y), at.w, at.h, facecolor=fill, edgecolor="white", linewidth=1))
            if at.h >= 16:
                colour = "#1d2429" if tile.kind == "calm" else "white"
                ax.text(at.x + 4, at.y + 12, _plain(fitting(tile.name, at.w)), fontsize=6.5, color=colour)
    ax.set(xlim=(0, WIDTH), ylim=(HEIGHT, 0))
    ax.axis("off")
    ax.set_title(_plain(m.title), fontsize=10, loc="left")
    ax.legend(
        [Rectangle((0, 0), 1, 1, facecolor=FILLS.get(k, FILLS["unclear"])) for k, _ in m.keys],
        [_plain(text) for _, text in m.keys],
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        ncols=5,
        fontsize=7,
        frameon=False,
    )
    return _png(figure)
