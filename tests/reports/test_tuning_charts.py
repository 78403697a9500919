"""Pictures of a tuning proposal: what must be in them, and that odd arrays do not break them."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread

from reports import tuning_charts as charts

PNG = b"\x89PNG\r\n\x1a\n"
KP, TI = np.geomspace(0.1, 10, 8), np.geomspace(5, 500, 6)


def pixels(picture: bytes) -> np.ndarray:
    """The picture as colours, shape (height, width, 3), each 0 to 1."""
    assert picture.startswith(PNG)
    return imread(BytesIO(picture))[..., :3]


def shows(image: np.ndarray, colour: str) -> int:
    """Pixels of nearly that colour."""
    wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return int((np.abs(image - wanted).max(axis=2) < 0.02).sum())


def plane(new: tuple[float, float] | None = (2.0, 100.0), travel: float = 3.0) -> charts.MapPicture:
    """A map that cycles below, rests above and is unstable to the right."""
    shape = (TI.size, KP.size)
    rests = np.zeros(shape, dtype=bool)
    rests[4:, :6] = True
    unstable = np.zeros(shape, dtype=bool)
    unstable[:, 6:] = True
    moves = np.where(rests | unstable, 0.0, travel)
    return charts.MapPicture(KP, TI, moves, rests, unstable, (1.0, 20.0), new)


def test_map_shows_both_tunings_and_both_regions():
    """The map has the present and the proposed settings, the region at rest and the unstable one."""
    image = pixels(charts.travel_map(plane(), "map"))
    for colour in (charts.NOW, charts.NEW, charts.RESTS, "#c0392b"):
        assert shows(image, colour) > 30


def test_map_without_proposal_has_no_star():
    """Without a proposal its colour is nowhere in the map."""
    assert shows(pixels(charts.travel_map(plane(None), "map")), charts.NEW) == 0


@pytest.mark.parametrize("travel", [0.0, 3.0, 1e-9])
def test_map_of_one_value_is_drawn(travel):
    """A plane that cycles nowhere, or everywhere alike, is still a picture."""
    assert pixels(charts.travel_map(plane(travel=travel), "map")).size > 0


def test_curves_mark_each_crossing():
    """Valve and loop are both drawn; without crossings the picture stands too."""
    angle = np.linspace(0.01, 1.5, 50)
    circle, line = np.exp(-1j * angle), np.linspace(0.1, 1.2, 50) - 0.3j
    for crossings, labels in ((np.array([0.9 - 0.3j]), ["38 s"]), (np.empty(0, dtype=complex), [])):
        image = pixels(charts.curves(charts.CurvesPicture(circle, line, crossings, labels), "curves"))
        assert shows(image, charts.STEM) > 100
        assert shows(image, charts.NOW) > 100


def test_curves_far_off_are_left_out():
    """A loop's curve that is all beyond the valve's is left out, not squeezed in."""
    valve = np.exp(-1j * np.linspace(0.01, 1.5, 50))
    far = 1e6 * valve
    picture = charts.CurvesPicture(valve, far, np.empty(0, dtype=complex), [])
    assert shows(pixels(charts.curves(picture, "curves")), charts.STEM) > 100


def test_forecast_shows_both_tunings():
    """PV under both tunings is in the forecast, each in its colour."""
    hours = np.linspace(0, 1, 400)
    wave, calm = np.sin(40 * hours), 0.1 * np.cos(40 * hours)
    pair = (wave, calm)
    image = pixels(charts.forecast(charts.ForecastPicture(hours, pair, pair, pair), "forecast"))
    assert shows(image, charts.NOW) > 200
    assert shows(image, charts.NEW) > 100
