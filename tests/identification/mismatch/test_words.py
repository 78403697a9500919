"""The texts of an explanation are complete: a sentence, a check, and a discriminating test for similar effects."""

from __future__ import annotations

from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.location import groups
from identification.mismatch.words import TEXTS, check, discriminating_test, located_sentence

NAMED_ONLY = {"sensor-lag"}
"""Names that are reported only as alternatives: SP, PV and OP cannot show them."""


def test_indistinguishable_effects_have_a_test_of_their_own() -> None:
    """Effects that the catalogue lists as indistinguishable have their own discriminating test, in both orders."""
    for effect in EFFECTS.values():
        for other in effect.indistinguishable:
            assert discriminating_test(effect.name, other) != TEXTS["longer"]
            assert discriminating_test(other, effect.name) == discriminating_test(effect.name, other)


def test_tests_name_the_catalogue_only() -> None:
    """No discriminating test is about a name outside the catalogue, or about the effect itself."""
    for effect in EFFECTS.values():
        assert set(effect.tests) <= (set(EFFECTS) | NAMED_ONLY) - {effect.name}


def test_verdicts_without_an_effect_have_a_check() -> None:
    """`none`, `unexplained` and unknown verdicts have a check for the user too."""
    none, unexplained, odd = (check({"verdict": v}) for v in ("none", "unexplained", "no such verdict"))
    assert none != unexplained == odd


def test_every_feature_has_a_text() -> None:
    """Each feature at which a misfit can be located has a text."""
    import numpy as np

    op = 50 + 60 * np.sin(np.arange(500) / 9.0)
    names = {g.name for g in groups(op, np.clip(op, 0, 100), 1.0, 0, 10)}
    assert names == set(TEXTS["features"])


def test_location_is_reported_with_its_range() -> None:
    """Larger errors are reported with their range, and a bias with the feature on which it depends."""
    size = {"name": "op_level", "by": "power", "range": [60.0, 80.0], "carries": True}
    bias = {"name": "pv_level", "by": "sign", "range": [1.0, 2.0], "carries": True}
    text = located_sentence({"features": [size, bias]})
    assert "60 to 80 % of OP" in text
    assert "The residual is located at 60 to 80 % of OP; depends on PV level (bias)." in text
    assert located_sentence({}) == ""
