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
    """Fits of a process behind a valve: starts, length of the descent, and required gain of one fit over another."""


class SlipLimits(Limits, section="slips"):
    """The search for a stem with irregular slips."""


class StemLimits(Limits, section="stem"):
    """Valve identification from a recorded stem position."""


class IntervalLimits(Limits, section="intervals"):
    """Width of the intervals of identified constants."""


class RecorderLimits(Limits, section="recorder"):
    """Effects of a recorder on the trends: lines, steps, ends, stamps."""


class ControllerLimits(Limits, section="controller"):
    """Whether the stated controller reproduces OP from SP and PV: settings, clock, gap and logic."""


class SearchLimits(Limits, section="search"):
    """Which effects explain a recording: the required gain of an effect, and how far candidates are followed."""

    @property
    def one_constant(self) -> float:
        """Required gain of an effect with one constant [nat]."""
        return self.search_penalty + self.parameter_penalty


class ProofLimits(Limits, section="proof"):
    """When a candidate's gain is real: on data that were not fitted, and spread over the record."""


class LawLimits(Limits, section="law"):
    """Identification of a controller's law from OP's increments."""


class LocationLimits(Limits, section="location"):
    """Location of a misfit: features, p-values and spans."""


class ReferenceLimits(Limits, section="reference"):
    """Influences in the most flexible model, which has no names for them."""


class FrictionLimits(Limits, section="friction"):
    """Starts of sticking valves in an explanation, and how long a stem keeps its position."""


class SmoothLimits(Limits, section="smooth"):
    """Fit of a process under a smooth load, and under a load with a line."""


class StartLimits(Limits, section="starts"):
    """Starts of effects that are found from the residual of the baseline model."""


class SignalLimits(Limits, section="signals"):
    """Spectra, cycles and correlations, and outliers of noise."""


class ExperimentLimits(Limits, section="experiments"):
    """Detection of experiments in a record, and the fit of each over its response."""


@dataclass(frozen=True, slots=True)
class ExplainLimits:
    """Thresholds for recorder, controller, effects and their proof."""

    recorder: RecorderLimits = field(default_factory=RecorderLimits)
    controller: ControllerLimits = field(default_factory=ControllerLimits)
    search: SearchLimits = field(default_factory=SearchLimits)
    proof: ProofLimits = field(default_factory=ProofLimits)


LIMITS = ExplainLimits()
"""The default limits."""
FIT, SLIPS, STEM, INTERVALS = FitLimits(), SlipLimits(), StemLimits(), IntervalLimits()
LAW, LOCATION, REFERENCE, SIGNALS = LawLimits(), LocationLimits(), ReferenceLimits(), SignalLimits()
FRICTION, STARTS, SMOOTH = FrictionLimits(), StartLimits(), SmoothLimits()
EXPERIMENTS = ExperimentLimits()
"""Numbers of a method, the same for every plant: no plant has a reason to change them."""
