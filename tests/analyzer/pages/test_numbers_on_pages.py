"""Each number exists once: each figure of the store on a page is that of the store, for the same loop and night."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from analyzer.columns import BY_NAME
from analyzer.pages import night
from analyzer.store.store import Store
from reports.folder import write_html
from tests.reports.small_store import small_store

TIMES = {"s": 1.0, "min": 60.0, "h": 3600.0}
DIGITS = 0.006
"""Relative difference that a number of three digits may have from its value."""


class Tables(HTMLParser):
    """The cells of a page's tables (table, key of the column, text, full number), one list for each row."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[tuple[str, str, str, str]]] = []
        self.table, self.keys, self.at = "", [], -1
        self.sort, self.text = "", None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Enter tables, rows and cells."""
        held = {k: v or "" for k, v in attrs}
        if tag == "table":
            self.table, self.keys = held.get("id", ""), []
        elif tag == "th" and "data-key" in held:
            self.keys.append(held["data-key"])
        elif tag == "tr" and self.keys:
            self.rows.append([])
            self.at = -1
        elif (tag == "td" or (tag == "th" and held.get("scope") == "row")) and self.rows:
            self.at += 1
            self.sort, self.text = held.get("data-sort", ""), ""

    def handle_data(self, data: str) -> None:
        """Read the text of a cell."""
        if self.text is not None:
            self.text += data

    def handle_endtag(self, tag: str) -> None:
        """Store a cell at its end."""
        if tag in ("td", "th") and self.text is not None and self.at < len(self.keys):
            self.rows[-1].append((self.table, self.keys[self.at], self.text.strip(), self.sort))
            self.text = None


def rows_of(path: Path) -> Iterator[list[tuple[str, str, str, str]]]:
    """The rows of a page's tables that are not empty."""
    parser = Tables()
    parser.feed(path.read_text("utf-8"))
    return (row for row in parser.rows if row)


def shown(text: str) -> float:
    """The number that a cell shows, with times in seconds."""
    found = re.match(r"([-+\d.e]+) ?(s|min|h)?", text.replace("\u2212", "-"))
    assert found, text
    return float(found[1]) * TIMES.get(found[2] or "s", 1.0)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Five nights of thirty loops."""
    return small_store(tmp_path_factory.mktemp("numbers") / "store", loops=30, nights=5)


def test_every_figure_of_every_table_is_that_of_the_store(store: Store, tmp_path: Path) -> None:
    """Figures of loops in all tables of all pages have the value of the store, to three digits and in full for
    sorting.
    """
    write_html(list(night.pages_of_night(store)), tmp_path)
    held: dict[tuple[str, str], dict[str, Any]] = {
        (row["loop"], name): row
        for name in store.nights()
        for row in store.rows("nights", name, tuple(BY_NAME))
    }
    last, count = store.nights()[-1], 0
    for path in sorted(tmp_path.glob("*.html")):
        for row in rows_of(path):
            cells = {key: (text, sort) for _, key, text, sort in row}
            table = row[0][0]
            if table in ("new", "better", "areas", "groups"):
                continue
            loop = cells.get("loop", ("", ""))[0].replace("\u2514 ", "") or _loop_of(path, held)
            known = held.get((loop, cells.get("night", (last, ""))[0]))
            if known is None:
                continue
            for key, (text, sort) in cells.items():
                if key not in BY_NAME or not BY_NAME[key].is_number or not text:
                    continue
                value = known[key]
                assert value is not None, (path.name, table, loop, key, text)
                assert shown(text) == pytest.approx(value, rel=DIGITS, abs=0.5 * (abs(value) >= 10)), (
                    path.name,
                    key,
                )
                assert not sort or float(sort) == pytest.approx(value, rel=1e-6)
                count += 1
    assert count > 500


def _loop_of(path: Path, held: dict[tuple[str, str], dict[str, Any]]) -> str:
    """The loop of a page."""
    from reports.texts import slug

    return next((loop for loop, _ in held if f"{slug(loop)}.html" == path.name), "")
