"""Pages as plain text, for a terminal or a mail: texts, lists and tables; pictures are left out."""

from __future__ import annotations

import textwrap

from reports.pages import Block, Facts, Listing, Page, Table, Text, Tiles
from reports.visible import visible_parts

WIDTH = 100
"""Characters of a line."""


def _wrapped(text: str, first: str = "", then: str = "") -> list[str]:
    return textwrap.wrap(" ".join(text.split()), WIDTH, initial_indent=first, subsequent_indent=then) or []


def _table(table: Table) -> list[str]:
    """A row as its first cell and, indented below, the others that say something."""
    out = []
    for row in table.rows:
        head, *rest = (cell.text for cell in row)
        out.append(" ".join(head.split()))
        for column, text in zip(table.columns[1:], rest, strict=True):
            if text:
                out += _wrapped(f"{column.title}: {text}", "  ", "    ")
    return [*out, *_wrapped(table.note)]


def _block(block: Block) -> list[str]:
    match block:
        case Table():
            return _table(block)
        case Text():
            return [line for p in block.paragraphs for line in _wrapped(p)]
        case Listing():
            return [line for lead, text in block.items for line in _wrapped(f"{lead} {text}", "- ", "  ")]
        case Facts():
            return [line for term, detail in block.items for line in _wrapped(f"{term}: {detail}", "", "  ")]
        case Tiles():
            return [f"{figure} {what}" for figure, what, _ in block.items]
    return []


def render(page: Page) -> str:
    """A page as plain text."""
    page = visible_parts(page)
    lines = [page.title, "=" * min(len(page.title), WIDTH), *_wrapped(page.subtitle)]
    for section in page.sections:
        lines += ["", section.title, "-" * min(len(section.title), WIDTH)]
        lines += [line for block in section.blocks for line in _block(block)]
    return "\n".join([*lines, "", *_wrapped(page.made)]).rstrip() + "\n"
