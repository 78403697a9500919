"""Parts of a page that are maps: colours over an axis, boxes with arrows, rectangles as large as their loss."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mark:
    """A place on the horizontal axis with its name."""

    x: float
    label: str


@dataclass(frozen=True, slots=True)
class HeatMap:
    """Rows of shares as colours over one axis that counts in powers.

    x : middle of each column, rising evenly in logarithms, shape (b,); rows : names; shares : 0 (nothing) to 1 (full
    colour), NaN where there is none, shape (rows, b); marks lie on the axis
    """

    name: str
    title: str
    x_label: str
    x: Floats
    rows: tuple[str, ...]
    shares: Floats
    marks: tuple[Mark, ...] = ()
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Place:
    """A point of a field with its name; `kind` names its colour."""

    x: float
    y: float
    label: str
    kind: str


@dataclass(frozen=True, slots=True)
class Field:
    """A value over two axes that count in powers.

    x, shape (n,), and y, shape (m,), rising evenly in logarithms; value, shape (m, n), coloured by its logarithm, 0
    where there is none; calm and unstable, bool, shape (m, n), with colours of their own; keys names the colours
    """

    name: str
    title: str
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
class Graph:
    """Boxes with arrows between them, drawn from left to right."""

    name: str
    title: str
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
class TileGroup:
    """Rectangles that lie together, under a name."""

    name: str
    tiles: tuple[Tile, ...]


@dataclass(frozen=True, slots=True)
class TreeMap:
    """Groups of rectangles as large as what they stand for; `keys` names the colours: (kind, what it is)."""

    name: str
    title: str
    groups: tuple[TileGroup, ...]
    keys: tuple[tuple[str, str], ...] = ()
    caption: str = ""
