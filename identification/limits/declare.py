"""How a number that decides something is declared: with its unit, its range, what it means and who set it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeVar

T = TypeVar("T")
KEY = "limit"


@dataclass(frozen=True, slots=True)
class Limit:
    """What is said of a number: unit ('-' for none), least and greatest value, meaning, and who or what set it."""

    unit: str
    least: float
    most: float
    meaning: str
    source: str


def limit(default: T, unit: str, ends: tuple[float, float], meaning: str, source: str) -> T:
    """A field of a dataclass of limits.

    Parameters
    ----------
    default : number
    unit : str
        '-' for none.
    ends : tuple of two numbers
        Least and greatest value that make sense.
    meaning, source : str
        What it decides; the study or author that set it.
    """
    stated: Any = field(default=default, metadata={KEY: Limit(unit, *ends, meaning, source)})
    return stated  # type: ignore[no-any-return]
