"""Shares that a control law explains: many tags at once agree with one tag at a time."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.finder.law import Moves, explained_by_errors, explained_either_way, explained_share

WIDTHS = (1, 4, 16)


@pytest.fixture(scope="module")
def walks():
    """Twelve drifting tags, each with a part of the tag before it, shape (4000, 12)."""
    rng = np.random.default_rng(7)
    steps = rng.normal(size=(4000, 12))
    return np.cumsum(steps + 0.5 * np.roll(steps, 1, axis=1), axis=0)


@pytest.mark.parametrize("width", WIDTHS)
def test_shares_of_errors_equal_those_of_each_difference(walks, width):
    """The law from the error of each tag explains the same share of OP as the law from the difference itself."""
    set_points, outputs = [3, 3, 8], [5, 0, 11]
    found = explained_by_errors(Moves.plain(walks, width), set_points, outputs)
    for pair, (sp, op) in enumerate(zip(set_points, outputs, strict=True)):
        tags = [k for k in range(12) if k != sp]
        error, effect = walks[:, tags] - walks[:, [sp]], walks[:, [op]]
        one = explained_share(Moves.plain(error, width), Moves.plain(effect, width))[:, 0]
        assert found[tags, pair] == pytest.approx(one, abs=1e-9)
        assert found[sp, pair] == 0.0


@pytest.mark.parametrize("width", WIDTHS)
def test_either_way_is_the_larger_of_both(walks, width):
    """For each pair of tags the better direction counts."""
    m = Moves.plain(walks, width)
    forth, back = explained_share(m, m.of_tags(5)), explained_share(m.of_tags(5), m).T
    assert explained_either_way(m, 5) == pytest.approx(np.maximum(forth, back), abs=1e-12)
