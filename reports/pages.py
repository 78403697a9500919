"""The data of a page: frozen, with final texts and numbers; rendered to HTML or Markdown elsewhere.

Any text may contain anything that a plant writes; the renderers escape it. Arrays are float64, shapes as given. All
parts of a page are in this one file, because two renderers have to know each of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
Floats = NDArray[np.float64]
Masks = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Sparkline:
    """A small trend: minimum and maximum of each bucket [any unit], shape (b,) each; NaN for none."""

    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell: its text and, for a number, the number itself, for sorting and for CSV.

    kind : name of a colour (better, worse, unclear, incomparable, valve, tuning, load), or ''
    href : target of the text, relative to the page, or ''
    """

    text: str
    number: float | None = None
    kind: str = ""
    href: str = ""
    figure: Sparkline | None = None


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its key in CSV, its heading, whether it contains numbers, and its meaning.

    wide : its texts may wrap; csv_only : only in the CSV
    """

    key: str
    title: str
    numeric: bool = False
    hint: str = ""
    wide: bool = False
    csv_only: bool = False


MOST_ROWS = 3000
"""Maximum rows of a table on a page; ours: with a hundred thousand a browser needs minutes, and nobody reads them."""


@dataclass(frozen=True, slots=True)
class Named:
    """Identity of a referenced block: its name in files and addresses, and its title."""

    name: str
    title: str


@dataclass(frozen=True, slots=True)
class Table(Named):
    """A table; `facets`: keys of columns whose values filter it; `cards`: on a phone one card per row; `beside`: the
    page on which rows are compared side by side, '' for none."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    searchable: bool = False
    facets: tuple[str, ...] = ()
    cards: bool = False
    beside: str = ""

    @property
    def shown(self) -> tuple[tuple[Cell, ...], ...]:
        """The rows shown on a page."""
        return self.rows[:MOST_ROWS]

    @property
    def more(self) -> str:
        """Text on the number of further rows; empty if all are shown."""
        if len(self.rows) <= MOST_ROWS:
            return ""
        return f"The first {MOST_ROWS:,} of {len(self.rows):,} rows; its CSV holds all."


@dataclass(frozen=True, slots=True)
class IntervalBar:
    """One change with its interval [in the chart's unit]; None if unknown."""

    group: str
    label: str
    value: float | None
    low: float | None
    high: float | None
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class IntervalChart(Named):
    """Changes as bars with intervals, grouped."""

    unit: str
    bars: tuple[IntervalBar, ...]
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Line:
    """A line (joined) or a cloud of points, shape (n,) each."""

    label: str
    x: Floats
    y: Floats
    joined: bool = True
    kind: str = "pv"


@dataclass(frozen=True, slots=True)
class Mark:
    """A position on the horizontal axis with its name."""

    x: float
    label: str


@dataclass(frozen=True, slots=True)
class Place:
    """A point of a field with its name; `kind` is the name of its colour."""

    x: float
    y: float
    label: str
    kind: str


@dataclass(frozen=True, slots=True)
class Area:
    """The area between two lines, shape (n,) each; `kind` is the name of its colour."""

    x: Floats
    low: Floats
    high: Floats
    kind: str = "pv"


@dataclass(frozen=True, slots=True)
class Plot(Named):
    """Lines and points over two axes, with areas under them and marks.

    log : logarithmic axes, of "x" and "y"; all their values are above zero; reach : values that the vertical axis
    always includes, so that small changes look small; day : the date of 0 (ISO) if the horizontal axis counts days,
    which then shows dates
    """

    x_label: str
    y_label: str
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...] = ()
    caption: str = ""
    areas: tuple[Area, ...] = ()
    log: str = ""
    reach: tuple[float, ...] = ()
    places: tuple[Place, ...] = ()
    day: str = ""


@dataclass(frozen=True, slots=True)
class Panels(Named):
    """Small plots of one figure, side by side if there is space, with one common key."""

    plots: tuple[Plot, ...]
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Band:
    """A decimated signal: minimum and maximum of each bucket, shape (b,), and its panel (0 is the top one)."""

    label: str
    kind: str
    panel: int
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Trend(Named):
    """Signals over time on linked axes.

    time_s : start of each bucket [s since 1970-01-01 UTC], rising, shape (b,); gap : True where nothing is shown;
    spans : first and last time [s] of marked spans; opening : first and last time [s] shown initially, all if None;
    least : minimum height of each panel's axis [its unit], so that small changes look small
    """

    time_s: Floats
    gap: Masks
    bands: tuple[Band, ...]
    panels: tuple[str, ...]
    marks: tuple[Mark, ...] = ()
    caption: str = ""
    spans: tuple[tuple[float, float], ...] = ()
    opening: tuple[float, float] | None = None
    least: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Beside(Named):
    """Trends of which a reader can show up to `most` below each other on one time axis; ours: as many as
    fit on a screen."""

    trends: tuple[Trend, ...]
    caption: str = ""
    most: int = 6


@dataclass(frozen=True, slots=True)
class HeatMap(Named):
    """Rows of shares as colours over one logarithmic axis.

    x : centre of each column, equally spaced in logarithms, shape (b,); rows : names; shares : 0 (nothing) to 1 (full
    colour), NaN if there is none, shape (rows, b); marks are on the axis
    """

    x_label: str
    x: Floats
    rows: tuple[str, ...]
    shares: Floats
    marks: tuple[Mark, ...] = ()
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Field(Named):
    """A value over two logarithmic axes.

    x, shape (n,), and y, shape (m,), equally spaced in logarithms; value, shape (m, n), coloured by its logarithm, 0
    if there is none; calm and unstable, bool, shape (m, n), with their own colours; keys names the colours
    """

    x_label: str
    y_label: str
    x: Floats
    y: Floats
    value: Floats
    calm: NDArray[np.bool_]
    unstable: NDArray[np.bool_]
    places: tuple[Place, ...] = ()
    keys: tuple[tuple[str, str], ...] = ()
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Node:
    """A box of a graph: its name, a line under it, its colour, and its column (0 is the first)."""

    name: str
    text: str
    kind: str
    column: int


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow from one box to another, with a text."""

    first: str
    last: str
    text: str = ""


@dataclass(frozen=True, slots=True)
class Graph(Named):
    """Boxes with arrows between them, drawn from left to right."""

    nodes: tuple[Node, ...]
    arrows: tuple[Arrow, ...]
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Tile:
    """A rectangle of a treemap: its name, size [any unit] and colour, tooltip, and link."""

    name: str
    size: float
    kind: str
    text: str
    href: str = ""


@dataclass(frozen=True, slots=True)
class TreeMap(Named):
    """Rectangles with areas proportional to a value, grouped under the group's name; `keys` names the colours: (kind,
    meaning)."""

    groups: tuple[tuple[str, tuple[Tile, ...]], ...]
    keys: tuple[tuple[str, str], ...] = ()
    caption: str = ""


@dataclass(frozen=True, slots=True)
class WhatIf(Named):
    """A loop that the reader can simulate with other settings in the page.

    model : process, valve, law, units and named settings as JSON (analyzer.pages.compared); load : what adds to PV at
    each scan [% PV], shape (n,)
    """

    model: str
    load: Floats
    caption: str = ""


MOST_LEVEL = 65534
"""Highest level of a signal on a page, in 16 bits; one further code means unknown."""
LEVELS = 65000.0
"""Largest number of levels of a signal: some are kept free so that a stored signal is stored again without loss."""


def levels(low: float, high: float) -> tuple[float, float]:
    """The lowest level and the step with which a page stores a signal between two values, in its own unit.

    The step is a power of two and the lowest level a multiple of it: then each level is exact in binary, and a stored
    signal is identical when it is stored again. At the edge of the backlash, a difference in the last digit can cause
    stem travel.
    """
    if not high > low:
        return low, 1.0
    step = 2.0 ** math.ceil(math.log2((high - low) / LEVELS) - 1e-3)
    return math.floor(low / step) * step, step


def as_held(x: Floats) -> Floats:
    """A signal, shape (n,), as stored on a page, so that reported figures are those that the page computes."""
    if x.size == 0:
        return x
    low, step = levels(float(x.min()), float(x.max()))
    return low + step * np.round((x - low) / step)  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class Text:
    """Paragraphs."""

    paragraphs: tuple[str, ...]
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Listing:
    """Items of a list, each with an optional lead in bold."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Facts:
    """Terms and their values."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Tiles:
    """Key figures of a page: (figure, meaning, colour)."""

    items: tuple[tuple[str, str, str], ...]


Picture = IntervalChart | Plot | Panels | Trend | HeatMap | Field | Graph | TreeMap
"""Blocks that are drawn."""
Block = Table | Picture | WhatIf | Beside | Text | Listing | Facts | Tiles


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a page under a heading; `closed` ones open on demand."""

    title: str
    blocks: tuple[Block, ...]
    closed: bool = False


def without_none(*parts: T | None) -> tuple[T, ...]:
    """The given parts of a page, without those that are None."""
    return tuple(part for part in parts if part is not None)


def section(title: str, *blocks: Block | None, closed: bool = False) -> Section | None:
    """A section of the given blocks, without those that are None; None if empty."""
    shown: tuple[Block, ...] = without_none(*blocks)
    return Section(title, shown, closed) if shown else None


@dataclass(frozen=True, slots=True)
class Page:
    """A page: its file name without ending, its title, one line under it, sections, and links (text, href).

    made : source and time of its content, shown small in its head; zone : time zone of the times on its axes; choices
    : pages of the same kind to choose from (text, href), '' being this one
    """

    name: str
    title: str
    subtitle: str
    sections: tuple[Section, ...]
    links: tuple[tuple[str, str], ...] = ()
    footer: str = ""
    made: str = ""
    zone: str = "UTC"
    choices: tuple[tuple[str, str], ...] = ()

    def tables(self) -> tuple[Table, ...]:
        """All tables of the page."""
        return tuple(b for s in self.sections for b in s.blocks if isinstance(b, Table))
