"""Text of the plant is shown as text in every format."""

from __future__ import annotations

import csv
import io
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports.html import mail as render_mail
from reports.html import render
from reports.markdown import escaped
from reports.markdown import render as render_markdown
from reports.pages import (
    Band,
    Cell,
    Column,
    Facts,
    IntervalBar,
    IntervalChart,
    Line,
    Listing,
    Mark,
    Page,
    Plot,
    Section,
    Table,
    Text,
    Tiles,
    Trend,
)
from reports.plain import as_csv
from reports.plain import render as render_text
from reports.texts import harmless, slug

NASTY = (
    "<script>alert(1)</script>",
    "</script><img src=x onerror=alert(1)>",
    '"><svg onload=alert(1)>',
    "a|b|c",
    '=HYPERLINK("http://example.invalid")',
    "{{ 7 * 7 }}",
    "[x](javascript:alert(1))",
    "# heading `code` **bold** _it_",
    "@everyone",
    "../../etc/passwd",
    "line\nbreak | cell",
)


def page_of(text: str) -> Page:
    """A page that shows a text in every place that can hold a text."""
    x = np.arange(4.0)
    columns = (Column("a", text, hint=text), Column("n", "n", True))
    table = Table("t", text, columns, ((Cell(text), Cell("1", 1.0)),), text, True, "a")
    band = Band(text, "pv", 0, x, x)
    blocks = (
        table,
        Text((text,)),
        Listing(((text, text),)),
        Facts(((text, text),)),
        Tiles(((text, text, ""),)),
        Plot("p", text, text, text, (Line(text, x, x),), (Mark(1.0, text),), text),
        IntervalChart("i", text, text, (IntervalBar(text, text, 1.0, 0.0, 2.0, "better", text),), text),
        Trend("tr", text, x, np.zeros(4, bool), (band,), (text, text), (Mark(1.0, text),), text),
    )
    return Page("page", text, text, (Section(text, blocks),), ((text, "index.html"),), text)


class Shape(HTMLParser):
    """Elements with the names of their attributes, and the text between them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, ...]] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Record an element."""
        self.elements.append((tag, *(name for name, _ in attrs)))

    def handle_data(self, data: str) -> None:
        """Record a text."""
        self.words.append(data)


@pytest.mark.parametrize("text", NASTY)
@pytest.mark.parametrize("single_file", [True, False])
def test_html_holds_no_markup_of_the_plant(text: str, single_file: bool) -> None:
    """A tag of the plant creates no element and no attribute, and the page shows the tag unchanged."""
    plain, nasty = (Shape(render(page_of(t), single_file)) for t in ("plain", text))
    assert nasty.elements == plain.elements
    assert "".join(nasty.words).count(text) >= "".join(plain.words).count("plain") - 6


def test_no_page_changes_the_direction_of_writing() -> None:
    """Control characters of a tag, and characters that change the direction of writing, are escaped in every
    format."""
    page = page_of("FIC\u202e101\x1b[2J\u2066")
    tables = [as_csv(t) for t in page.tables()]
    for text in (render(page), render_mail(page), render_text(page), render_markdown(page), *tables):
        assert all(c.isprintable() or c == "\n" for c in text)
        assert r"FIC\u202e101\x1b" in text.replace("\\\\", "\\")


def test_markdown_runs_nothing() -> None:
    """No scheme that an unsafe renderer could run remains before its colon. Words before a colon stay as they
    are."""
    found = escaped("[x](javascript:alert(1)) JavaScript:x data:text/html,x vbscript:x file:///etc")
    assert not re.search(r"(?i)(javascript|vbscript|data|file):", found)
    assert escaped("about the data: none") == "about the data: none"


@pytest.mark.parametrize("text", NASTY)
def test_markdown_tables_keep_their_cells(text: str) -> None:
    """A tag of the plant creates no cell, no link, no heading and no HTML in Markdown."""
    nasty = render_markdown(page_of(text))
    plain = render_markdown(page_of("plain"))
    assert nasty.count("\n") == plain.count("\n")
    assert "<" not in nasty
    assert len(re.findall(r"(?<!\\)\|", nasty)) == len(re.findall(r"(?<!\\)\|", plain))
    assert len(re.findall(r"(?<!\\)\[", nasty)) == len(re.findall(r"(?<!\\)\[", plain))
    assert "@" not in nasty


@given(st.text(max_size=60))
def test_escaped_markdown_is_one_line(text: str) -> None:
    """The Markdown of any tag is one line without unescaped marks."""
    found = escaped(text)
    assert "\n" not in found
    assert not re.search(r"(?<!\\)(?:\\\\)*[|`*\[\]<>]", found)


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\tx", "\r=x", " =1"])
def test_csv_texts_are_no_formulas(text: str) -> None:
    """A text that a spreadsheet would compute starts with an apostrophe."""
    assert harmless(text).startswith("'")
    assert harmless("LIC2101") == "LIC2101"


def test_csv_numbers_stay_numbers() -> None:
    """Negative numbers in numeric columns keep their sign and all their digits."""
    table = Table("t", "", (Column("x", "x", True), Column("s", "s")), ((Cell("−0.1", -0.1), Cell("-5")),))
    rows = list(csv.reader(io.StringIO(as_csv(table))))
    assert rows == [["x", "s"], ["-0.1", "'-5"]]


@given(st.text(max_size=80))
def test_file_names_stay_in_their_folder(tag: str) -> None:
    """The file name of any tag is one plain name inside the folder."""
    name = slug(tag)
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9-]*", name)
    assert (Path("/out") / name).resolve().parent == Path("/out")
    assert len(name) <= 47


def test_file_names_of_different_tags_differ() -> None:
    """Tags that differ only in characters that file names cannot contain have different files."""
    tags = ["FIC-1", "FIC.1", "FIC/1", "FIC 1", "fic-1", "ФИК", "流量", ""]
    assert len({slug(t).lower() for t in tags}) == len(tags)
