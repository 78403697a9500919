"""Rules that are left out in turn are rules that there are."""

from __future__ import annotations

from proofs.rules import RULES


def test_each_rule_that_is_left_out_is_there() -> None:
    """Every function in whose place another one stands is one of its module, or nothing would be left out."""
    named = [place for places, _ in RULES.values() for place in places]
    assert named
    assert [f"{module.__name__}.{name}" for module, name in named if not hasattr(module, name)] == []
