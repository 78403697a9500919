"""Plots with areas, logarithmic axes and keys, small panels, and trends in several panels with marked spans."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np

from reports import html, markdown, pictures, plots
from reports.pages import Area, Band, Line, Page, Panels, Plot, Section, Text, Trend

X = np.geomspace(1.0, 1000.0, 50)
TWO = Plot(
    "p",
    "Two",
    "period [s]",
    "power",
    (Line("before", X, X, kind="baseline"), Line("after", X, X / 10, kind="model")),
)


def places(text: str) -> np.ndarray:
    """Horizontal places of the first line of an SVG."""
    path = re.search(r'class="line[^"]*" d="M([^"]+)"', text)
    assert path is not None
    return np.array([float(p.split(",")[0]) for p in path[1].split("L")])


def test_powers_of_ten_are_evenly_spaced() -> None:
    """Values in equal ratios have equal distances on a logarithmic axis, with ticks at powers of ten."""
    text = str(plots.plot(replace(TWO, log="xy")))
    steps = np.diff(places(text))
    np.testing.assert_allclose(steps, steps.mean(), atol=0.11)
    assert all(f">{10**k}<" in text for k in range(4))


def test_an_axis_of_less_than_a_decade_has_ticks() -> None:
    """An axis from 3 to 8 has ticks although it contains no power of ten."""
    x = np.linspace(3, 8, 9)
    text = str(plots.plot(Plot("p", "p", "x", "y", (Line("a", x, x),), log="x")))
    assert ">5<" in text


def test_area_lies_between_its_ends() -> None:
    """The polygon of an area follows the upper end forwards and the lower end backwards, inside the frame."""
    area = Area(np.array([0.0, 1.0]), np.array([0.0, 0.0]), np.array([1.0, 2.0]), "model")
    line = Line("found", area.x, area.high, kind="model")
    text = str(plots.plot(Plot("p", "p", "x", "y", (line,), areas=(area,))))
    path = re.search(r'class="area model" d="M([^"]+)Z"', text)
    assert path is not None
    y = [float(p.split(",")[1]) for p in path[1].split("L")]
    assert y[1] < y[0] < y[2] == y[3]


def test_keys_name_each_line_once() -> None:
    """A figure of several plots has one key for each name. A single line needs no key."""
    both = Panels("f", "figure", (TWO, TWO))
    assert str(pictures.keys(both)).count("<li>") == 2
    assert str(pictures.keys(replace(TWO, lines=TWO.lines[:1]))) == ""


def test_trend_of_three_panels_with_spans() -> None:
    """A trend has a place for each of its panels and its spans, and times to the millisecond where they are
    needed."""
    time = 1.7e9 + 0.5 * np.arange(8)
    bands = tuple(Band(str(i), "model", i, np.zeros(8), np.ones(8)) for i in range(3))
    t = Trend("t", "t", time, np.zeros(8, dtype=bool), bands, ("a", "b", "c"), spans=((time[1], time[3]),))
    data = json.loads(str(html.trend_data(t)))
    assert data["tick"] == html.FINE_S
    assert data["spans"] == [[time[1], time[3]]]
    page = html.render(Page("p", "p", "", (Section("s", (t,)),)), True)
    assert page.count('class="panel"') == 3
    assert pictures.as_file(t).count('class="band model"') == 3


def test_markdown_without_pictures_leaves_them_out() -> None:
    """Without a folder, Markdown refers to no picture, and a section with only pictures has no heading."""
    figure = Panels("f", "figure", (TWO,))
    page = Page("p", "p", "", (Section("Words", (Text(("text",)),)), Section("Figure", (figure,))))
    text = markdown.render(page, "")
    assert "Figure" not in text
    assert "![" in markdown.render(page, "folder")
    assert list(markdown.pictures(page)) == [figure]
