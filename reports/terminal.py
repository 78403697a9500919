"""Rows of cells as a table for a terminal: aligned, one column wrapped, quick for lists of a plant's every loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.cells import cell_len, chop_cells, set_cell_size

GAP = "  "
"""Between two columns."""
LEAST = 20
"""Characters of a line of a wrapped cell at least, however narrow the terminal."""


@dataclass(frozen=True, slots=True)
class Heading:
    """A column: its title, whether its cells stand at the right, and whether they are wrapped (one at most)."""

    title: str
    right: bool = False
    wrapped: bool = False


def table(
    headings: Sequence[Heading], rows: Sequence[Sequence[str]], width: int
) -> tuple[str, list[list[str]]]:
    """The line of headings, and of each row its lines.

    Parameters
    ----------
    headings : sequence of Heading
    rows : sequence of rows
        A cell for each heading.
    width : int
        Characters of a line; columns that are not wrapped are never cut, and may make it longer.
    """
    sizes = [
        max(map(cell_len, (h.title, *(row[k] for row in rows))), default=0) for k, h in enumerate(headings)
    ]
    others = sum(size for size, h in zip(sizes, headings, strict=True) if not h.wrapped)
    room = max(width - others - len(GAP) * (len(headings) - 1) - 2, LEAST)
    sizes = [min(size, room) if h.wrapped else size for size, h in zip(sizes, headings, strict=True)]
    head = _line([h.title for h in headings], headings, sizes)
    return head, [_lines(row, headings, sizes, room) for row in rows]


def _lines(row: Sequence[str], headings: Sequence[Heading], sizes: Sequence[int], room: int) -> list[str]:
    folded = [_folded(cell, room) if h.wrapped else [cell] for cell, h in zip(row, headings, strict=True)]
    return [
        _line([cell[k] if k < len(cell) else "" for cell in folded], headings, sizes)
        for k in range(max(map(len, folded)))
    ]


def _folded(text: str, width: int) -> list[str]:
    """The lines of a wrapped cell, by what they take on the screen; a word longer than a line is parted."""
    if cell_len(text) <= width:
        return [text]
    lines = [""]
    for word in (part for whole in text.split() for part in chop_cells(whole, width)):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if cell_len(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def _line(cells: Sequence[str], headings: Sequence[Heading], sizes: Sequence[int]) -> str:
    padded = (_padded(cell, h.right, size) for cell, h, size in zip(cells, headings, sizes, strict=True))
    return f" {GAP.join(padded)}".rstrip()


def _padded(text: str, right: bool, size: int) -> str:
    if text.isascii():
        return text.rjust(size) if right else text.ljust(size)
    return " " * (size - cell_len(text)) + text if right else set_cell_size(text, size)
