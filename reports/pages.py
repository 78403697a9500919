"""What a page is: frozen data, texts already chosen, numbers already computed; rendered to HTML or Markdown
elsewhere.

Every text may hold anything that a plant writes; the renderers escape it. Arrays are float64, shape as said.
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
    """A small trend: least and greatest of each bucket [any unit], shape (b,) each; NaN where there is
    none."""

    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell: its text and, where it is a number, the number itself, for sorting and for CSV.

    kind : name of a colour (better, worse, unclear, incomparable, valve, tuning, load), or ''
    href : where the text leads, relative to the page, or ''
    """

    text: str
    number: float | None = None
    kind: str = ""
    href: str = ""
    figure: Sparkline | None = None


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its key in CSV, its heading, whether it holds numbers, what it means.

    wide : its texts may wrap; csv_only : it stands in the CSV alone
    """

    key: str
    title: str
    numeric: bool = False
    hint: str = ""
    wide: bool = False
    csv_only: bool = False


MOST_ROWS = 3000
"""Rows of a table on a page; ours: of a hundred thousand a browser makes a page of minutes, and nobody reads them."""


@dataclass(frozen=True, slots=True)
class Named:
    """What a block has that is referred to: its name in files and addresses, and its title."""

    name: str
    title: str


@dataclass(frozen=True, slots=True)
class Table(Named):
    """A table; `facets`: keys of columns whose values filter it; `cards`: on a phone a card a row;
    `beside`: the page on which rows are laid beside each other, '' for none."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    searchable: bool = False
    facets: tuple[str, ...] = ()
    cards: bool = False
    beside: str = ""

    @property
    def shown(self) -> tuple[tuple[Cell, ...], ...]:
        """The rows that a page shows."""
        return self.rows[:MOST_ROWS]

    @property
    def more(self) -> str:
        """What is said where there are more; empty where all are shown."""
        if len(self.rows) <= MOST_ROWS:
            return ""
        return f"The first {MOST_ROWS:,} of {len(self.rows):,} rows; its CSV holds all."


@dataclass(frozen=True, slots=True)
class IntervalBar:
    """One change with its interval [in the chart's unit]; None where it cannot be told."""

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
    """A place on the horizontal axis with its name."""

    x: float
    label: str


@dataclass(frozen=True, slots=True)
class Place:
    """A point of a field with its name; `kind` names its colour."""

    x: float
    y: float
    label: str
    kind: str


@dataclass(frozen=True, slots=True)
class Area:
    """What lies between two lines, shape (n,) each; `kind` names its colour."""

    x: Floats
    low: Floats
    high: Floats
    kind: str = "pv"


@dataclass(frozen=True, slots=True)
class Plot(Named):
    """Lines and points over two axes, with areas under them and marks.

    log : axes that count in powers of ten, of "x" and "y"; all that lies on them is above zero; reach : values that
    the vertical axis holds at least, so that small things look small; day : the date of 0 (ISO) where the horizontal
    axis counts days, which then shows dates
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
    """Small plots of one figure, side by side as room allows, with one key for all."""

    plots: tuple[Plot, ...]
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Band:
    """A thinned signal: least and greatest of each bucket, shape (b,), and the panel (0 is the upmost) it is in."""

    label: str
    kind: str
    panel: int
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Trend(Named):
    """Signals over time on linked axes.

    time_s : start of each bucket [s since 1970-01-01 UTC], rising, shape (b,); gap : True where nothing is
    shown; spans : first and last time [s] of spans that are marked; opening : first and last time [s] shown at
    first, all where None; least : height of each panel's axis at least [its unit], so that small things look small
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
    """Trends of which a reader shows up to `most` under each other on one time axis; ours: as a screen holds."""

    trends: tuple[Trend, ...]
    caption: str = ""
    most: int = 6


@dataclass(frozen=True, slots=True)
class HeatMap(Named):
    """Rows of shares as colours over one axis that counts in powers.

    x : middle of each column, rising evenly in logarithms, shape (b,); rows : names; shares : 0 (nothing) to 1 (full
    colour), NaN where there is none, shape (rows, b); marks lie on the axis
    """

    x_label: str
    x: Floats
    rows: tuple[str, ...]
    shares: Floats
    marks: tuple[Mark, ...] = ()
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Field(Named):
    """A value over two axes that count in powers.

    x, shape (n,), and y, shape (m,), rising evenly in logarithms; value, shape (m, n), coloured by its logarithm, 0
    where there is none; calm and unstable, bool, shape (m, n), with colours of their own; keys names the colours
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
    """A box of a graph: its name, a line under it, its colour, and in which column it stands (0 is the first)."""

    name: str
    text: str
    kind: str
    column: int


@dataclass(frozen=True, slots=True)
class Arrow:
    """From one box to another, with a text."""

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
    """A rectangle of a map: its name, size [any unit] and colour, a text for who points at it, where it leads."""

    name: str
    size: float
    kind: str
    text: str
    href: str = ""


@dataclass(frozen=True, slots=True)
class TreeMap(Named):
    """Rectangles as large as what they stand for, those of a group together under its name; `keys` names the colours:
    (kind, what it is)."""

    groups: tuple[tuple[str, tuple[Tile, ...]], ...]
    keys: tuple[tuple[str, str], ...] = ()
    caption: str = ""


@dataclass(frozen=True, slots=True)
class WhatIf(Named):
    """A loop to be tried with other settings in the page itself.

    model : process, valve, law, units and named settings as JSON (analyzer.pages.compared); load : what adds to PV at
    each scan [% PV], shape (n,)
    """

    model: str
    load: Floats
    caption: str = ""


MOST_LEVEL = 65534
"""Levels of a signal that a page holds, in 16 bits, one of which says that nothing is known."""
LEVELS = 65000.0
"""Levels that a signal covers at most: some are left so that one which is held is held again without loss."""


def levels(low: float, high: float) -> tuple[float, float]:
    """The lowest level and the step in which a page holds a signal between two values, in its own unit.

    The step is a power of two and the lowest level a multiple of it: then each level is exact in binary, and a signal
    that has been held once is the same to the last digit when it is held again. A stem at the edge of its play makes
    travel of a last digit.
    """
    if not high > low:
        return low, 1.0
    step = 2.0 ** math.ceil(math.log2((high - low) / LEVELS) - 1e-3)
    return math.floor(low / step) * step, step


def as_held(x: Floats) -> Floats:
    """A signal, shape (n,), as a page holds it, so that what is told of it is what the page computes."""
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
    """Terms and what is known of them."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Tiles:
    """A few figures that sum a page up: (figure, what it is, colour)."""

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


def there(*parts: T | None) -> tuple[T, ...]:
    """The parts of a page that there are: those that are None are left out."""
    return tuple(part for part in parts if part is not None)


def section(title: str, *blocks: Block | None, closed: bool = False) -> Section | None:
    """A section of the blocks that there are; None without any."""
    shown: tuple[Block, ...] = there(*blocks)
    return Section(title, shown, closed) if shown else None


@dataclass(frozen=True, slots=True)
class Page:
    """A page: its file name without ending, its title, one line under it, sections, and links (text,
    href).

    made : what it was made of and when, shown small in its head; zone : time zone of the times on its axes;
    choices : pages of the same kind, one of which is chosen (text, href), '' being this one
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
