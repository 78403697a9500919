"""Thresholds: limits.toml of each package states them; this module makes typed tables of them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

KEY = "limit"


@dataclass(frozen=True, slots=True)
class Limit:
    """Description of a number: unit ('-' for none), least and greatest value, meaning, and source."""

    unit: str
    least: float
    most: float
    meaning: str
    source: str


@cache
def _stated(package: str) -> Mapping[str, Any]:
    return tomllib.loads((files(package) / "limits.toml").read_text("utf-8"))


@dataclass(frozen=True)
class Limits:
    """A frozen dataclass whose fields are a section of limits.toml of the package in which it is declared.

    The section states each field's value and its `Limit`; types for mypy: .ci/limits_types.py.
    """

    def __init_subclass__(cls, section: str) -> None:
        cls.__annotations__ = {}
        stated = _stated(cls.__module__.partition(".")[0])[section]
        for name, (number, unit, least, most, meaning, *source) in stated.items():
            value, limit = _value(number), Limit(unit, least, most, meaning, " ".join(source))
            setattr(cls, name, field(default=value, metadata={KEY: limit}))
            cls.__annotations__[name] = type(value)
        dataclass(frozen=True)(cls)


def _value(stated: Any) -> Any:
    """A value, lists as tuples."""
    return tuple(_value(item) for item in stated) if isinstance(stated, list) else stated


class RecorderLimits(Limits, section="recorder"):
    """Effects of a recorder on the trends: lines, steps, ends, stamps."""


class ControllerLimits(Limits, section="controller"):
    """Whether the stated controller reproduces OP from SP and PV: settings, clock, gap and logic."""


@dataclass(frozen=True, slots=True)
class ExplainLimits:
    """Thresholds for recorder and controller in an explanation."""

    recorder: RecorderLimits = field(default_factory=RecorderLimits)
    controller: ControllerLimits = field(default_factory=ControllerLimits)


LIMITS = ExplainLimits()
"""The default limits."""
