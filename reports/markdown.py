"""Pages as Markdown, with pictures in separate files: for a wiki or a merge request."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from reports import pages as parts
from reports.texts import visible

MARKS = re.compile(r"([\\`*_\[\]#!|~$])")
STARTS = re.compile(r"^(\d+(?=[.)](?:\s|$))|(?=[-+:](?:\s|$)|=+$|-+$))")
ADDRESSES = re.compile(r"(?i)\b(?:(https?|ftp|mailto|www)(?=[:.])|(javascript|vbscript|data|file)(?=:\S))")
"""Texts that become a link, or that a careless renderer runs; a word before a colon and a space is kept."""


def escaped(text: str) -> str:
    """Escape a text: no markup, no HTML, no line breaks, no links, no mentions of users."""
    text = visible(" ".join(text.split()))
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    text = STARTS.sub(r"\1\\", MARKS.sub(r"\\\1", text))
    return ADDRESSES.sub(r"\g<0>&#8203;", text).replace("@", "&#64;")


def _cell(cell: parts.Cell) -> str:
    text, href = escaped(cell.text), re.sub(r"\.html\Z", ".md", cell.href)
    return f"[{text}]({href})" if href and text else text


def rows_of_table(head: Sequence[str], rows: Iterable[Iterable[str]], rules: Sequence[str] = ()) -> list[str]:
    """The lines of a table with escaped cells; rules : alignment of each column, left by default."""
    drawn = f"|{'|'.join(rules or ['---'] * len(head))}|"
    return [f"| {' | '.join(head)} |", drawn, *(f"| {' | '.join(row)} |" for row in rows)]


def _table(table: parts.Table) -> list[str]:
    shown = [i for i, c in enumerate(table.columns) if c.key != "trend" and not c.csv_only]
    head = [escaped(table.columns[i].title) for i in shown]
    body = ([_cell(row[i]) for i in shown] for row in table.rows)
    lines = rows_of_table(head, body, ["--:" if table.columns[i].numeric else "---" for i in shown])
    title = [f"**{escaped(table.title)}**", ""] if table.title else []
    note = ["", escaped(table.note)] if table.note else []
    return [*title, *lines, *note]


def _block(block: parts.Block, folder: str) -> list[str]:
    match block:
        case parts.Table():
            return _table(block)
        case parts.Text():
            return [line for p in block.paragraphs for line in (escaped(p), "")][:-1]
        case parts.Listing():
            return [
                f"- {f'**{escaped(lead)}** ' if lead else ''}{escaped(text)}" for lead, text in block.items
            ]
        case parts.Facts():
            return [f"- {escaped(term)}: {escaped(detail)}" for term, detail in block.items]
        case parts.Tiles():
            return [f"- **{escaped(figure)}** {escaped(what)}" for figure, what, _ in block.items]
        case parts.WhatIf() | parts.Beside():
            return []
        case _:
            if not folder:
                return []
            caption = ["", escaped(block.caption)] if block.caption else []
            return [f"![{escaped(block.title)}]({folder}/{block.name}.svg)", *caption]


def _section(section: parts.Section, folder: str) -> list[str]:
    shown = [lines for b in section.blocks if (lines := _block(b, folder))]
    body = [line for lines in shown for line in (*lines, "")]
    return [f"## {escaped(section.title)}", "", *body] if body else []


def render(page: parts.Page, folder: str = "pictures") -> str:
    """A page as Markdown.

    Parameters
    ----------
    page : Page
    folder : str
        Folder of the pictures, relative to the page; '' omits the pictures.
    """
    head = [f"# {escaped(page.title)}", "", escaped(page.subtitle), ""]
    body = [line for s in page.sections for line in _section(s, folder)]
    foot = [escaped(page.footer)] if page.footer else []
    return "\n".join([*head, *body, *foot]).rstrip() + "\n"


def pictures(page: parts.Page) -> Sequence[parts.Picture]:
    """The blocks that become pictures."""
    return [b for s in page.sections for b in s.blocks if isinstance(b, parts.Picture)]
