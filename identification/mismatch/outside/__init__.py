"""Physics that is known and has no name in the catalogue: where it explains a recording best, it is told in words
beside `unexplained`, so that no name of the catalogue is stretched over it."""

from __future__ import annotations

from collections.abc import Mapping

from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.effect import Effect
from identification.mismatch.outside import gain_with_history, gain_with_rate, recycle, switched_load
from identification.simulation.effect import Variant, bring

_ALL = (gain_with_history.EFFECT, gain_with_rate.EFFECT, recycle.EFFECT, switched_load.EFFECT)
OUTSIDE: Mapping[str, Effect] = {e.name: e for e in _ALL}
"""All of it by what it is called here."""
bring(tuple(act for e in _ALL for act in e.acts))
RIVALS: tuple[Variant, ...] = tuple(v for e in OUTSIDE.values() for v in e.candidates)
"""What competes with the catalogue and gives no name."""


def about(name: str) -> Effect:
    """The effect of that name, in the catalogue or outside."""
    return EFFECTS[name] if name in EFFECTS else OUTSIDE[name]
