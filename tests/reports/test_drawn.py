"""Pictures as separate files are complete, well formed, and in the colours of the style sheet."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from reports import html
from reports.pages import (
    Arrow,
    Band,
    Field,
    Graph,
    HeatMap,
    IntervalBar,
    IntervalChart,
    Line,
    Mark,
    Node,
    Panels,
    Picture,
    Place,
    Plot,
    Tile,
    TreeMap,
    Trend,
)
from reports.pictures import as_file, drawings

X = np.geomspace(1.0, 100.0, 20)
NONE = np.zeros((20, 20), dtype=bool)
TIME = 1_772_409_600.0 + 600.0 * np.arange(145)
BAND = Band("FIC<1>.PV", "pv", 0, np.sin(TIME), np.sin(TIME) + 1)
PLOT = Plot(
    "p", "Two & more", "x", "y", (Line("a", X, X), Line("b", X, X / 2, kind="stem op")), (Mark(5.0, "m"),)
)
PICTURES: tuple[Picture, ...] = (
    PLOT,
    Panels("q", "Panels", (PLOT, replace(PLOT, title="Other"))),
    IntervalChart("i", "Changes", "%", (IntervalBar("L", "error", -5.0, -9.0, -1.0, "better", "−5 %"),)),
    Trend("t", "Trend", TIME, np.arange(145) == 70, (BAND,), ("PV [%]",), (Mark(TIME[40], "changed"),)),
    HeatMap("h", "Spectra", "period [s]", X, ("FIC1",), np.ones((1, 20)), (Mark(10.0, "10 s"),)),
    Field("f", "Map", "Kp", "Ti", X, X, np.ones((20, 20)), NONE, NONE, (Place(2.0, 3.0, "now", "now"),)),
    Graph(
        "g", "Way", (Node("A", "x", "source", 0), Node("B", "y", "follower", 1)), (Arrow("A", "B", "3 s"),)
    ),
    TreeMap("m", "Plant", (("area", (Tile("L", 1.0, "valve", "L: 1", "l.html"),)),), (("valve", "v"),)),
)


@pytest.mark.parametrize("block", PICTURES, ids=lambda b: type(b).__name__)
def test_a_picture_is_a_file_that_needs_no_other(block: Picture) -> None:
    """Each kind of picture is well-formed SVG with its title, and refers to no file, variable or link."""
    text = as_file(block)
    root = ElementTree.fromstring(text)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert block.title in "".join(root.itertext())
    assert not re.search(r"href|url\(|var\(|@import", text)
    assert all(drawn.body.replace(' href="l.html"', "")[:40] for _, drawn in drawings(block))


def test_lines_have_the_colours_of_the_style_sheet() -> None:
    """A line in the file has the light-mode colour of the style sheet. Rules that the picture does not use are
    left out."""
    pv = re.search(r"--pv: (#\w+);", html.asset("page.css"))
    assert pv is not None
    text = as_file(PLOT)
    assert f"stroke: {pv[1]}" in text
    assert ".tiles" not in text
    assert ".line.stem { stroke-dasharray" in text


def test_a_trend_breaks_at_its_gap_and_keeps_its_peaks() -> None:
    """A band has one outline on each side of a gap. A peak of one bucket among ten thousand is still drawn."""
    assert as_file(PICTURES[3]).count("Z") == 2
    t = 60.0 * np.arange(10_000.0)
    y = np.where(np.arange(10_000) == 5_003, 9.0, 0.0)
    ((_, drawn),) = drawings(Trend("t", "t", t, t < 0, (Band("PV", "pv", 0, y, y),), ("PV",)))
    (path,) = re.findall(r'class="band pv" d="M([^"]*)Z"', drawn.body)
    heights = [float(p.split(",")[1]) for p in path.split("L")]
    assert max(heights) - min(heights) > 150
    assert len(heights) < 2200


@pytest.mark.parametrize(("zone", "midnight"), [("UTC", "2 Mar"), ("Asia/Tokyo", "3 Mar")])
def test_times_are_in_the_plants_time_zone(zone: str, midnight: str) -> None:
    """A day that starts at midnight UTC shows its hours and its date in the plant's time zone."""
    ((_, drawn),) = drawings(PICTURES[3], zone)
    texts = re.findall(r'class="tick">([^<]*)<', drawn.body)
    assert midnight in texts
    assert "12:00" in texts
    assert f">{zone}<" in drawn.body


@pytest.mark.parametrize("travel", [0.0, 3.0, 1e-9])
def test_a_field_of_one_value_is_drawn(travel: float) -> None:
    """A map of Kp and Ti with zero or constant travel is drawn with its regions without oscillation and its
    unstable regions."""
    calm, unstable = np.arange(20)[:, None] > 14 + NONE, NONE | (np.arange(20) > 14)
    f = Field("f", "Map", "Kp", "Ti", X, X, np.full((20, 20), travel), calm, unstable)
    ((_, drawn),) = drawings(f)
    assert drawn.body.count('class="cell unstable"') == 100
    assert drawn.body.count('class="cell calm"') == 75
    assert drawn.body.count('class="cell swings"') == (225 if travel else 0)


def test_places_are_named_on_the_side_with_room() -> None:
    """A point at the right edge has its name on its left, inside the picture."""
    places = (Place(1.0, 1.0, "left", "now"), Place(100.0, 1.0, "right", "now"))
    ((_, drawn),) = drawings(replace(PLOT, places=places))
    assert re.search(r'text-anchor="start" class="placed">left<', drawn.body)
    assert re.search(r'text-anchor="end" class="placed">right<', drawn.body)


@pytest.mark.parametrize("seed", range(20))
def test_names_of_points_near_each_other_do_not_overlap(seed: int) -> None:
    """The names of five settings within a twentieth of the map do not overlap and stay inside the map."""
    rng = np.random.default_rng(seed)
    centre = rng.uniform(0.2, 1.8, 2)
    at = 10.0 ** (centre + rng.uniform(-0.05, 0.05, (5, 2)))
    names = ("now", "recommended", "Skogestad", "Cohen-Coon", "lambda")
    places = tuple(Place(x, y, name, "now") for (x, y), name in zip(at, names, strict=True))
    ((_, drawn),) = drawings(Field("f", "Map", "Kp", "Ti", X, X, np.ones((20, 20)), NONE, NONE, places))
    boxes = []
    for x, y, anchor, name in re.findall(
        r'<text x="([\d.]+)" y="([\d.]+)" text-anchor="(\w+)" class="placed">([^<]*)<', drawn.body
    ):
        left = float(x) - 6.0 * len(name) * {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
        boxes.append((left, left + 6.0 * len(name), float(y) - 9.0, float(y)))
    assert len(boxes) == len(names)
    apart = [
        a[1] <= b[0] or b[1] <= a[0] or a[3] <= b[2] or b[3] <= a[2]
        for i, a in enumerate(boxes)
        for b in boxes[:i]
    ]
    assert all(apart)
    assert all(left >= 62.0 and right <= 482.0 for left, right, _, _ in boxes)
