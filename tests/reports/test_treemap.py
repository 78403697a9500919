"""A tree map shows all sizes in proportion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reports.maps import HEAD, Room, fitting, laid_out, squarified, tree_map
from reports.pages import Tile, TreeMap

SIZES = st.lists(st.floats(0.01, 1e4), min_size=1, max_size=40).map(lambda x: sorted(x, reverse=True))


@settings(max_examples=60, deadline=None)
@given(SIZES)
def test_areas_are_in_proportion_and_fill_the_room(sizes: list[float]) -> None:
    """Every rectangle's area is its share of the room. All rectangles are inside the room, and their areas add
    up to its area."""
    room = Room(3.0, 5.0, 400.0, 250.0)
    found = squarified(sizes, room)
    areas = np.array([p.w * p.h for p in found])
    assert areas == pytest.approx(np.array(sizes) / sum(sizes) * 100000.0, rel=1e-6)
    for p in found:
        assert p.x >= 3.0 - 1e-6
        assert p.y >= 5.0 - 1e-6
        assert p.x + p.w <= 403.0 + 1e-6
        assert p.y + p.h <= 255.0 + 1e-6
    assert areas.sum() == pytest.approx(100000.0)


def test_the_papers_example() -> None:
    """For the sizes 6 6 4 3 2 2 1 in a room of 6 by 4, the first two rectangles are 3 by 2 (Bruls et al. 2000)."""
    found = squarified([6, 6, 4, 3, 2, 2, 1], Room(0, 0, 6, 4))
    assert [(round(p.w, 6), round(p.h, 6)) for p in found[:2]] == [(3, 2), (3, 2)]
    assert found[2].w == pytest.approx(12 / 7, abs=1e-6)


def test_nothing_is_drawn_without_a_loss() -> None:
    """Loops and areas without a loss have no rectangle."""
    empty = TreeMap("m", "M", (("a", (Tile("x", 0.0, "calm", "x"),)),))
    assert laid_out(empty, 100, 100) == []
    assert "<rect" not in str(tree_map(empty))


def test_groups_lie_apart_and_names_are_escaped() -> None:
    """Tiles are inside their group's room and below its name. Texts of the plant are escaped."""
    tiles = tuple(Tile(f"<b>{i}", 5.0 - i, "valve", "a & b", "x.html") for i in range(3))
    m = TreeMap("m", "M", (("<A>", tiles), ("B", (Tile("y", 3.0, "calm", "y"),))))
    for _, room, placed in laid_out(m, 500, 300):
        assert all(p.y >= room.y + HEAD - 1e-9 and p.x + p.w <= room.x + room.w + 1e-9 for _, p in placed)
    drawn = str(tree_map(m))
    assert "<b>" not in drawn
    assert "a &amp; b" in drawn
    assert drawn.count("<a href") == 3


def test_texts_are_cut_to_their_width() -> None:
    """A name that does not fit ends in an ellipsis. It is left out if no readable part fits."""
    assert fitting("LIC2103", 100) == "LIC2103"
    assert fitting("LIC2103-long-name", 60).endswith("…")
    assert fitting("LIC2103", 20) == ""
