"""Phases of a programme over the nights: whether the overshoot of one grows, and since which repetition."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analyzer.belief.wear import bend
from analyzer.config import WearLimits
from analyzer.loop.setpoint_moves import alike

REMEMBERED = 60
"""Repetitions of a phase that are remembered; ours: some weeks of daily batches, a few days of hourly ones."""
DEVIATION = 2.0
"""Standard deviation that an overshoot has at least [% of the move]; ours: noise and samples make it one or two."""
LEAST = 5.0
"""Growth of an overshoot from which it is told [% of the move]; ours: the 5 % within which an answer has settled."""


@dataclass(frozen=True, slots=True)
class PhaseKnown:
    """One kind of move over the nights: set point before and after [% of span], how often it has come, and of the
    latest repetitions their numbers, starts [s since 1970-01-01 UTC] and overshoots [% of the move]."""

    begin: float
    end: float
    count: int = 0
    shown: tuple[tuple[int, float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Growth:
    """That an overshoot grows: since which repetition, begun when [s since 1970-01-01 UTC], from what to what [% of
    the move]."""

    number: int
    start_s: float
    before: float
    now: float


def with_night(known: Sequence[PhaseKnown], row: Mapping[str, Any]) -> tuple[PhaseKnown, ...]:
    """The phases with what a night's row says of them; a repetition that is known already is not counted again."""
    out = list(known)
    for told in json.loads(row.get("phases") or "[]"):
        ends = told["begin"], told["end"]
        at = next((k for k, p in enumerate(out) if alike((p.begin, p.end), ends)), None)
        if at is None:
            at = len(out)
            out.append(PhaseKnown(*ends))
        out[at] = _with(out[at], list(zip(told["start_s"], told["overshoot_pct"], strict=True)))
    return tuple(out)


def _with(phase: PhaseKnown, found: Sequence[tuple[float, float]]) -> PhaseKnown:
    last = phase.shown[-1][1] if phase.shown else float("-inf")
    new = [(start, size) for start, size in found if start > last]
    numbered = tuple((phase.count + k, start, size) for k, (start, size) in enumerate(new, 1))
    return replace(phase, count=phase.count + len(new), shown=(*phase.shown, *numbered)[-REMEMBERED:])


def forgotten(known: Sequence[PhaseKnown]) -> tuple[PhaseKnown, ...]:
    """The phases of a loop whose settings were changed: counted on, their overshoots begun anew."""
    return tuple(replace(p, shown=()) for p in known)


def growth(phase: PhaseKnown, limits: WearLimits) -> Growth | None:
    """Whether the overshoot of a phase grows from some repetition on; None where it stays or too few show it."""
    if len(phase.shown) < limits.nights:
        return None
    number, start, size = (np.array(x, dtype=np.float64) for x in zip(*phase.shown, strict=True))
    at = bend(number, size, np.full(size.size, DEVIATION), limits)
    if at is None:
        return None
    some = int(limits.growing_nights)
    before, now = float(np.median(size[number <= at][-some:])), float(np.median(size[-some:]))
    if now - before < LEAST:
        return None
    return Growth(int(at), float(start[number == at][0]), before, now)
