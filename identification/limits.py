"""Numbers that decide something: limits.toml of each package states them, here they become typed tables."""

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
    """What is said of a number: unit ('-' for none), least and greatest value, meaning, and who or what set it."""

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

    The section states each field's value, and what `Limit` says of it; types for mypy: .ci/limits_types.py.
    """

    def __init_subclass__(cls, section: str) -> None:
        cls.__annotations__ = {}
        for name, said in _stated(cls.__module__.partition(".")[0])[section].items():
            value, (least, most) = _value(said["value"]), said["range"]
            limit = Limit(said["unit"], least, most, said["meaning"], said["source"])
            setattr(cls, name, field(default=value, metadata={KEY: limit}))
            cls.__annotations__[name] = type(value)
        dataclass(frozen=True)(cls)


def _value(stated: Any) -> Any:
    """A value, lists as tuples."""
    return tuple(_value(item) for item in stated) if isinstance(stated, list) else stated


class FitLimits(Limits, section="fit"):
    """Where fits of a process behind a valve begin, how far they are followed, and what one must gain on another."""


class SlipLimits(Limits, section="slips"):
    """The search for a stem whose slips scatter."""


class StemLimits(Limits, section="stem"):
    """What a recorded stem shows of its valve."""


class IntervalLimits(Limits, section="intervals"):
    """How wide the intervals of identified constants are told."""


class RecorderLimits(Limits, section="recorder"):
    """What a recorder did to the trends before anyone saw them: lines, steps, ends, stamps."""


class ControllerLimits(Limits, section="controller"):
    """Whether the stated controller gives OP from SP and PV: settings, clock, gap and logic."""


class SearchLimits(Limits, section="search"):
    """Which effects explain a recording: what one has to gain, and how far candidates are followed."""

    @property
    def one_constant(self) -> float:
        """Gain that an effect of one constant has to bring [nat]."""
        return self.search_penalty + self.parameter_penalty


class ProofLimits(Limits, section="proof"):
    """When a candidate's gain is real: on data that were not fitted, and spread over the record."""


class LawLimits(Limits, section="law"):
    """What a record tells of a controller's law, by OP's increments."""


class LocationLimits(Limits, section="location"):
    """Where a misfit is said to live: features, chance and spans."""


class ReferenceLimits(Limits, section="reference"):
    """What the most flexible model may go with, that has no name for it."""


class FrictionLimits(Limits, section="friction"):
    """Where stems that stick are sought for an explanation, and how long one holds its place."""


class SmoothLimits(Limits, section="smooth"):
    """How a process is fitted under a load that is smooth, and under one that has a line."""


class StartLimits(Limits, section="starts"):
    """Where effects begin that are found by what the plain loop leaves."""


class SignalLimits(Limits, section="signals"):
    """How spectra, cycles and correlations are read, and what of noise is an outlier."""


class ExperimentLimits(Limits, section="experiments"):
    """How experiments are found in a record, and how each is fitted over its answer."""


@dataclass(frozen=True, slots=True)
class ExplainLimits:
    """What decides about recorder, controller, effects and their proof."""

    recorder: RecorderLimits = field(default_factory=RecorderLimits)
    controller: ControllerLimits = field(default_factory=ControllerLimits)
    search: SearchLimits = field(default_factory=SearchLimits)
    proof: ProofLimits = field(default_factory=ProofLimits)


LIMITS = ExplainLimits()
"""The limits where none are given."""
FIT, SLIPS, STEM, INTERVALS = FitLimits(), SlipLimits(), StemLimits(), IntervalLimits()
LAW, LOCATION, REFERENCE, SIGNALS = LawLimits(), LocationLimits(), ReferenceLimits(), SignalLimits()
FRICTION, STARTS, SMOOTH = FrictionLimits(), StartLimits(), SmoothLimits()
EXPERIMENTS = ExperimentLimits()
"""Numbers of a method, the same for every plant: no plant has reasons of its own to change them."""
