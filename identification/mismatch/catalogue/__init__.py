"""The catalogue of effects that a baseline model may omit: one file per effect with its EFFECT, read from here."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from importlib import import_module

from identification.mismatch.effect import Block, Effect, Fault
from identification.simulation.parameters import Variant, bring


def _read() -> dict[str, Effect]:
    """Every effect of this folder by its name, in the order of the loop's blocks."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__))
    found: list[Effect] = [import_module(f"{__name__}.{name}").EFFECT for name in names]
    blocks = list(Block)
    return {e.name: e for e in sorted(found, key=lambda e: blocks.index(e.block))}


EFFECTS: Mapping[str, Effect] = _read()
"""All effects by name."""
bring(tuple(act for e in EFFECTS.values() for act in e.acts))
CANDIDATES: tuple[Variant, ...] = tuple(v for e in EFFECTS.values() for v in e.candidates)
"""All candidate additions to the baseline model."""
RECORDER_FAULTS: tuple[Fault, ...] = tuple(
    sorted((e for e in EFFECTS.values() if isinstance(e, Fault) and e.find), key=lambda e: e.order)
)
"""Faults that are searched for in the trends, in this order."""


def fault(name: str) -> Fault:
    """The recorder or controller effect with that name."""
    found = EFFECTS[name]
    assert isinstance(found, Fault)
    return found
