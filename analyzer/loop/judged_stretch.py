"""Which stretch of a record its verdict rests on: in automatic, and under one pair of settings.

New settings make another loop of the same process, and a controller in manual makes none: neither tells anything of
the other. Where the settings were changed within a record, what came before says nothing of those in force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import numpy as np

from analyzer.config import Config
from analyzer.loop.assessments import HOUR_S
from analyzer.loop.quality import Prepared
from analyzer.loops.changes import TuningChange, settings_before
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller as stated_controller
from identification.controller.check import runs
from identification.models import Pid
from identification.record import LoopRecord, Mask


@dataclass(frozen=True, slots=True)
class Earlier:
    """Settings in force in a record until a time [s since 1970-01-01 UTC]: the row that states them, and the
    controller that it makes, None where it states none."""

    until_s: float
    spec: LoopSpec
    controller: Pid | None


@dataclass(frozen=True, slots=True)
class Stretch:
    """Samples first to last (excluded) of a record, the settings in force there, and whether those in force at the
    record's end are younger than it, and so are not judged."""

    first: int
    last: int
    controller: Pid | None
    outdated: bool = False


def controller_of(spec: LoopSpec, prepared: Prepared) -> Pid | None:
    """The controller that a row states, in percent and seconds, its scan that of the record where it states none."""
    stated = stated_controller(spec, prepared.scale.span)
    if stated is None or spec.scan_s is not None:
        return stated
    return replace(stated, scan_s=prepared.record.dt_s)


def earlier_settings(
    spec: LoopSpec, changes: Sequence[TuningChange], prepared: Prepared
) -> tuple[Earlier, ...]:
    """What was in force in a record before its last settings, of a loop as loops.csv states it."""
    record = prepared.record
    before = settings_before(spec, changes, record.start_s, record.start_s + record.duration_s)
    return tuple(Earlier(until_s, old, controller_of(old, prepared)) for until_s, old in before)


def _between_runs(out: Mask, first: int, last: int, least: int) -> list[tuple[int, int]]:
    """Stretches of the samples first to last between runs of True in `out` of at least so many."""
    long = ((first + a, first + b) for a, b in runs(out[first:last]) if b - a >= least)
    edges = [first, *chain.from_iterable(long), last]
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a]


def _in_automatic(record: LoopRecord, first: int, last: int, config: Config) -> tuple[int, int]:
    """The longest stretch between long spans in manual, where it holds most of what is in automatic; else all."""
    least = max(round(config.quality.manual_s / record.dt_s), 1)
    a, b = max(_between_runs(record.mask("manual"), first, last, least), key=lambda ends: ends[1] - ends[0])
    use = record.usable
    most = use[a:b].sum() >= config.quality.automatic_share * use[first:last].sum()
    return (a, b) if most and b - a >= config.quality.samples else (first, last)


def judged_stretch(
    record: LoopRecord, controller: Pid | None, earlier: Sequence[Earlier], config: Config
) -> Stretch:
    """The stretch that a verdict rests on: the part since the last change of settings, in automatic.

    Where too little of it is good to judge new settings, the part of the record with most good samples. The
    controller is the one in force at the record's end; those before it, oldest first.
    """
    cuts = [round((e.until_s - record.start_s) / record.dt_s) for e in earlier]
    edges = [0, *(min(max(c, 0), len(record)) for c in cuts), len(record)]
    use = record.usable
    good = [int(use[a:b].sum()) for a, b in pairwise(edges)]
    least = max(config.advice.least_h * HOUR_S / record.dt_s, config.quality.samples)
    at = len(good) - 1 if not earlier or good[-1] >= least else int(np.argmax(good))
    settings = [*(e.controller for e in earlier), controller]
    first, last = _in_automatic(record, edges[at], edges[at + 1], config)
    return Stretch(first, last, settings[at], at < len(good) - 1)
