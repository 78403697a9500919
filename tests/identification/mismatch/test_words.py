"""The words of an explanation are whole: a sentence, a check, and what tells each name from its look-alikes."""

from __future__ import annotations

from identification.mismatch.catalogue import CATALOGUE
from identification.mismatch.location.features import groups
from identification.mismatch.words import (
    CHECKS,
    DISCRIMINATING_TESTS,
    LONGER,
    PLACES,
    SENTENCES,
    discriminating_test,
    located_sentence,
)


def test_each_name_has_its_words() -> None:
    """Each name of the catalogue has a sentence and something to look at."""
    names = {row.name for row in CATALOGUE} | {"none"}
    assert names <= set(SENTENCES)
    assert set(SENTENCES) <= set(CHECKS)


def test_look_alikes_have_a_test_of_their_own() -> None:
    """Names that the catalogue calls alike are told apart by a line of their own, whichever comes first."""
    for row in CATALOGUE:
        for other in row.likeness:
            assert discriminating_test(row.name, other) != LONGER
            assert discriminating_test(other, row.name) == discriminating_test(row.name, other)


def test_table_names_the_catalogue_only() -> None:
    """No line of the table is about a name that nobody answers."""
    known = set(SENTENCES) | {"sensor-lag"}
    assert {name for pair in DISCRIMINATING_TESTS for name in pair} <= known
    assert all(len(pair) == 2 for pair in DISCRIMINATING_TESTS)


def test_every_feature_has_a_place() -> None:
    """Each feature that a misfit can be laid to can be said."""
    import numpy as np

    op = 50 + 60 * np.sin(np.arange(500) / 9.0)
    names = {g.name for g in groups(op, np.clip(op, 0, 100), 1.0, 0, 10)}
    assert names == set(PLACES)


def test_place_is_said_by_size_with_its_range() -> None:
    """Larger errors are said with the range in which they are, a bias by what it changes along."""
    size = {"name": "op_level", "by": "power", "range": [60.0, 80.0], "carries": True}
    bias = {"name": "pv_level", "by": "sign", "range": [1.0, 2.0], "carries": True}
    text = located_sentence({"features": [size, bias]})
    assert "60 to 80 % of OP" in text
    assert "a bias that changes along PV" in text
    assert located_sentence({}) == ""
