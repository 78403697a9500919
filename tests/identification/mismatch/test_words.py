"""The words of an explanation are whole: a sentence, a check, and what tells each name from its look-alikes."""

from __future__ import annotations

from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.location import groups
from identification.mismatch.words import TOLD, check, discriminating_test, located_sentence

NAMED_ONLY = {"sensor-lag"}
"""Names that are answered as alternatives alone: nothing in SP, PV and OP can find them."""


def test_indistinguishable_effects_have_a_test_of_their_own() -> None:
    """Names that the catalogue calls alike are told apart by a line of their own, whichever comes first."""
    for effect in EFFECTS.values():
        for other in effect.indistinguishable:
            assert discriminating_test(effect.name, other) != TOLD["longer"]
            assert discriminating_test(other, effect.name) == discriminating_test(effect.name, other)


def test_tests_name_the_catalogue_only() -> None:
    """No discriminating test is about a name that nobody answers, or about the effect itself."""
    for effect in EFFECTS.values():
        assert set(effect.tests) <= (set(EFFECTS) | NAMED_ONLY) - {effect.name}


def test_verdicts_without_an_effect_say_what_to_do() -> None:
    """`none`, `unexplained` and words nobody knows have something to look at as well."""
    none, left, odd = (check({"verdict": v}) for v in ("none", "unexplained", "no such verdict"))
    assert none != left == odd


def test_every_feature_has_a_place() -> None:
    """Each feature that a misfit can be laid to can be said."""
    import numpy as np

    op = 50 + 60 * np.sin(np.arange(500) / 9.0)
    names = {g.name for g in groups(op, np.clip(op, 0, 100), 1.0, 0, 10)}
    assert names == set(TOLD["features"])


def test_place_is_said_by_size_with_its_range() -> None:
    """Larger errors are said with the range in which they are, a bias by what it changes along."""
    size = {"name": "op_level", "by": "power", "range": [60.0, 80.0], "carries": True}
    bias = {"name": "pv_level", "by": "sign", "range": [1.0, 2.0], "carries": True}
    text = located_sentence({"features": [size, bias]})
    assert "60 to 80 % of OP" in text
    assert "The residual is located at 60 to 80 % of OP; depends on PV level (bias)." in text
    assert located_sentence({}) == ""
