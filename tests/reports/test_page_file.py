"""A stored page is drawn later as it would have been drawn at once."""

from __future__ import annotations

import json

import numpy as np
import pytest

from reports.html import render
from reports.page_file import dumps, loads
from reports.pages import (
    Area,
    Band,
    Cell,
    Column,
    Line,
    Mark,
    Page,
    Panels,
    Plot,
    Section,
    Sparkline,
    Table,
    Text,
    Trend,
)


def made() -> Page:
    """A page with every kind of content: texts of a plant, times, gaps, infinities."""
    t = 1_772_409_600.0 + np.arange(50.0)
    y = np.where(np.arange(50) == 7, np.nan, np.sin(np.arange(50.0)))
    trend = Trend(
        "t", "Trend", t, np.isnan(y), (Band("PV", "pv", 0, y, y + 1),), ("PV [%]",), (Mark(3.0, "x"),)
    )
    plot = Plot("p", "Plot", "x", "y", (Line("a", np.arange(5.0), np.arange(5.0)),), areas=(Area(t, y, y),))
    rows = ((Cell("<b>FIC</b>", 3.5, figure=Sparkline(y, y + 1)), Cell("", float("inf"))),)
    table = Table("n", "Table", (Column("a", "A"), Column("b", "B", True)), rows)
    blocks = (trend, Panels("q", "Panels", (plot,)), table, Text(("Ünïcode & “quotes”",), "lead"))
    return Page(
        "page", "Title", "sub", (Section("One", blocks), Section("Two", (), True)), (("all", "i.html"),)
    )


def test_stored_page_is_drawn_identically() -> None:
    """A page that is rendered from its stored text is identical, except for the rounding of a picture's numbers
    to single precision."""
    page = made()
    again = loads(dumps(page))
    assert again.title == page.title
    assert again.tables()[0].rows[0][0].text == "<b>FIC</b>"
    assert dumps(loads(dumps(again))) == dumps(again)
    assert render(loads(dumps(again)), True) == render(again, True)


def test_times_keep_their_seconds() -> None:
    """Time stamps since 1970 keep their fractions, values keep six digits, and gaps keep their places."""
    page = made()
    trend, again = (p.sections[0].blocks[0] for p in (page, loads(dumps(page))))
    assert isinstance(trend, Trend)
    assert isinstance(again, Trend)
    np.testing.assert_array_equal(again.time_s, trend.time_s)
    np.testing.assert_array_equal(again.gap, trend.gap)
    np.testing.assert_allclose(again.bands[0].low, trend.bands[0].low, rtol=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"is": "os.system"}',
        '{"is":"Text","paragraphs":[]}',
        '{"is":"Page","name":"a"}',
        "[" * 9000,
        '{"is":"array","type":"f4","values":"!!"}',
        json.dumps({"is": "Page", "evil": 1}),
    ],
)
def test_text_that_is_not_a_page_is_refused(text: str) -> None:
    """Text without a page, with an unknown part or with endless nesting gives no page and no error."""
    assert loads(text) is None
