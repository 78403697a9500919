"""Numbers that decide something: limits.toml of each package states them, here they become typed tables."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any, TypeVar

T = TypeVar("T")
KEY = "limit"
TOML: Any = None
"""Stands for a value that limits.toml states."""


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


def stated_in(package: str, section: str) -> Callable[[type[T]], type[T]]:
    """A decorator that gives the fields of a dataclass the values which a package's limits.toml states in a section.

    Raises
    ------
    TypeError
        Where fields and file do not name the same limits.
    """

    def filled(cls: type[T]) -> type[T]:
        stated = _stated(package)[section]
        if list(stated) != list(cls.__annotations__):
            odd = set(stated) ^ set(cls.__annotations__)
            raise TypeError(
                f"{cls.__name__} and [{section}] of {package}/limits.toml differ: {sorted(odd) or 'order'}"
            )
        for name, said in stated.items():
            least, most = said["range"]
            limit = Limit(said["unit"], least, most, said["meaning"], said["source"])
            setattr(cls, name, field(default=_value(said["value"]), metadata={KEY: limit}))
        return cls

    return filled


def _value(stated: Any) -> Any:
    """A value, lists as tuples."""
    return tuple(_value(item) for item in stated) if isinstance(stated, list) else stated


@dataclass(frozen=True, slots=True)
@stated_in("identification", "recorder")
class RecorderLimits:
    """What a recorder did to the trends before anyone saw them: lines, steps, ends, stamps."""

    straight: float = TOML
    straight_law: float = TOML
    grid_step: float = TOML
    grid_step_of_range: float = TOML
    grid_mark: float = TOML
    clip_samples: int = TOML
    clip_ratio: float = TOML
    jitter: float = TOML
    missed: float = TOML
    stands: float = TOML
    jumps: int = TOML
    jump_steps: float = TOML
    jump_share: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("identification", "controller")
class ControllerLimits:
    """Whether the stated controller gives OP from SP and PV: settings, clock, gap and logic."""

    span_samples: int = TOML
    spans: int = TOML
    filter_leaves: float = TOML
    late: float = TOML
    setting: float = TOML
    law_explains: float = TOML
    law_gives: float = TOML
    same_law: float = TOML
    gap_leaves: float = TOML
    frozen: float = TOML
    frozen_moves: int = TOML
    stuck_run: int = TOML
    stuck_move: float = TOML
    stuck_share: float = TOML
    lawless: float = TOML
    lawless_share: float = TOML
    asked: float = TOML
    thinned: float = TOML
    thinned_leaves: float = TOML
    setting_thinned: float = TOML
    thinned_ti: float = TOML
    feedback: float = TOML
    by_hand: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("identification", "search")
class SearchLimits:
    """Which effects explain a recording: what one has to gain, and how far candidates are followed."""

    parameter_penalty: float = TOML
    hidden_penalty: float = TOML
    search_penalty: float = TOML
    rounds: int = TOML
    followed: int = TOML
    screen_steps: int = TOML
    full_steps: int = TOML
    settled: float = TOML
    promises: float = TOML
    worth_following: float = TOML
    may_come_to: float = TOML
    tie: float = TOML
    same: float = TOML
    sticking_hint: float = TOML
    settles: float = TOML
    start_scatter: float = TOML
    bias_scatter: float = TOML
    left_over: float = TOML
    left_share: float = TOML
    rival_share: float = TOML
    outside_share: float = TOML
    outside_near: float = TOML
    experiment_samples: int = TOML
    samples_a_lag: float = TOML


@dataclass(frozen=True, slots=True)
@stated_in("identification", "proof")
class ProofLimits:
    """When a candidate's gain is real: on data that were not fitted, and spread over the record."""

    answers: float = TOML
    time_constants: float = TOML
    proven: int = TOML
    held_out: float = TOML
    held_out_loss: float = TOML
    held_out_share: float = TOML
    as_good: float = TOML
    astray: float = TOML
    optima_apart: float = TOML
    seen_ahead: float = TOML
    least_fit: float = TOML
    spread: float = TOML
    one_move: float = TOML
    sound_valve: float = TOML
    bound_share: float = TOML
    window_times: float = TOML
    window_samples: int = TOML
    least_cycle: int = TOML
    course_leaves: float = TOML
    course_from: float = TOML


@dataclass(frozen=True, slots=True)
class ExplainLimits:
    """What decides about recorder, controller, effects and their proof."""

    recorder: RecorderLimits = field(default_factory=RecorderLimits)
    controller: ControllerLimits = field(default_factory=ControllerLimits)
    search: SearchLimits = field(default_factory=SearchLimits)
    proof: ProofLimits = field(default_factory=ProofLimits)


LIMITS = ExplainLimits()
"""The limits where none are given."""
