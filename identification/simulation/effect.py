"""What a piece of left-out physics is: a row of constants with starts, bounds, needs and look-alikes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Param:
    """A constant that a row frees.

    slot : its place; name, unit : as answered; low, high : bounds in its own unit, times the scale named by
    `scale` (scales() in fitting.py); log : searched by its logarithm.
    """

    slot: int
    name: str
    unit: str
    low: float
    high: float
    scale: str = "1"
    log: bool = False


Start = Mapping[int, float]


@dataclass(frozen=True, slots=True)
class Row:
    """One piece of physics as a candidate: its name, block, constants, and starts in units of their scales.

    delays : constants whose start is taken off the dead time, which stood for them in the plain loop.
    types : loop types that can have it, any where empty or the type is not known.
    fixed : constants set, not searched; needs : what the record must hold (steps, neighbour) for it to be tried.
    """

    name: str
    block: str
    params: tuple[Param, ...]
    starts: tuple[Start, ...]
    fixed: Start | None = None
    needs: str = ""
    variant: str = ""
    types: tuple[str, ...] = ()
    likeness: tuple[str, ...] = ()
    delays: tuple[int, ...] = ()
    penalty: float = 0.0


def each(slot: int, *values: float) -> tuple[Start, ...]:
    """Starts that differ in one constant."""
    return tuple({int(slot): v} for v in values)
