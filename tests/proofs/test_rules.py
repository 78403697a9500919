"""The rules that the proof leaves out one at a time exist."""

from __future__ import annotations

from proofs.rules import RULES


def test_each_rule_that_is_left_out_exists() -> None:
    """Every function that the proof replaces exists in its module; otherwise the proof would leave out nothing."""
    named = [place for places, _ in RULES.values() for place in places]
    assert named
    assert [f"{module.__name__}.{name}" for module, name in named if not hasattr(module, name)] == []
