"""The recordings of a loop that are explained or held out: its trends in an export, in parts of one setting each.

A controller's law, and a limit cycle, belong to their settings; a valve and a process do not. What is found in one
part has to hold in the others, or it is not told.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from analyzer.explain.case import MOST_SAMPLES, Case, case, tags_of
from analyzer.history.plant_clock import stamp
from analyzer.history.series import Series
from analyzer.loops.changes import TuningChange, in_force
from analyzer.loops.spec import LoopSpec, spec_of
from analyzer.night.asked import Asked
from analyzer.night.nights import Night, cut
from identification.errors import InputError, NotAssessedError

FEWEST = 300
"""Samples of PV from which a part is judged; ours: a noise model that looks 25 back needs twelve times that."""


@dataclass(frozen=True, slots=True)
class Part:
    """One part: the loop with the settings in force there, its trends, and when it was."""

    spec: LoopSpec
    series: dict[str, Series]
    name: str
    samples: int


def change_times(
    spec: LoopSpec, changes: Sequence[TuningChange], first_s: float, last_s: float
) -> list[float]:
    """Times within a span at which a loop's settings changed [s since 1970-01-01 UTC], in order."""
    stated = [c.time_s for c in changes if c.loop == spec.loop]
    dated = [s.valid_from_s for s in (*spec.earlier, spec) if s.valid_from_s is not None]
    return sorted({t for t in (*stated, *dated) if first_s < t < last_s})


def parts(
    spec: LoopSpec, series: Mapping[str, Series], changes: Sequence[TuningChange], zone: str
) -> list[Part]:
    """The parts of a recording, the one with most samples first; one where nothing changed.

    Parameters
    ----------
    spec : LoopSpec
    series : mapping
        The recording's trends by tag, PV's among them.
    changes : sequence of TuningChange
        Of any loops.
    zone : str
        The plant's time zone, in which parts are named.
    """
    stamps = series[spec.pv or ""].stamp_s
    first, last = float(stamps[0]), float(stamps[-1])
    ends = [first, *change_times(spec, changes, first, last), last + 1.0]
    out = []
    for a, b in pairwise(ends):
        held = {tag: cut(x, Night("", a, b)) for tag, x in series.items()}
        pv = held[spec.pv or ""].stamp_s
        if pv.size:
            name = f"{stamp(float(pv[0]), zone)} to {stamp(float(pv[-1]), zone)}"
            out.append(Part(in_force(spec, changes, float(pv[-1])), held, name, pv.size))
    out.sort(key=lambda p: -p.samples)
    return [out[0], *(p for p in out[1:] if p.samples >= FEWEST)]


def parts_said(judged: Sequence[Part]) -> str:
    """On which part an explanation rests and which are held out, as a sentence; empty where there is one."""
    if len(judged) < 2:
        return ""
    rest = " and ".join(p.name for p in judged[1:])
    return f"Settings changed within the recording: explained on {judged[0].name}, held out on {rest}."


def loop_trends(asked: Asked, tag: str) -> tuple[LoopSpec, tuple[LoopSpec, ...], dict[str, Series]]:
    """A loop of an export, all loops of it, and the trends that explaining it reads.

    Raises
    ------
    InputError
        The export has no such loop, no PV of it, or no samples of PV in the span that is asked for.
    """
    source, specs, _ = asked.opened()
    spec = spec_of(specs, tag)
    if spec.pv is None:
        raise InputError(f"{tag}: no PV tag in the export", f"{tag}.PV", "check --loops and the export")
    first, last = source.span(spec.pv)  # without stray stamps, which would stretch a record over centuries
    whole_span = Night("", first, last + 1.0)
    series = {tag: cut(x, whole_span) for tag, x in source.read(tags_of(spec, specs)).items()}
    series = asked.within(series)
    if series[spec.pv].stamp_s.size == 0:
        raise InputError(f"{tag}: no samples between --since and --until", "a span of the export", "widen it")
    return spec, specs, series


def whole(asked: Asked, tag: str) -> tuple[Case, Series]:
    """A loop's case over all of an export, under its last settings, and its PV."""
    spec, specs, series = loop_trends(asked, tag)
    pv = series[spec.pv or ""]
    spec = in_force(spec, asked.changes, float(pv.stamp_s[-1]))
    return case(spec, specs, series, asked.config, None), pv


def asked_cases(asked: Asked, tag: str, held_out: Sequence[Path]) -> tuple[Case, dict[str, Case]]:
    """The case to be explained, and those held out by name: parts under other settings, and other exports."""
    spec, specs, series = loop_trends(asked, tag)
    judged = parts(spec, series, asked.changes, asked.zone)
    kept: list[tuple[Part, Case]] = []
    for part in judged:
        with nullcontext() if len(judged) == 1 else suppress(NotAssessedError):  # OP stands still in it
            most = None if kept else MOST_SAMPLES
            kept.append((part, case(part.spec, specs, part.series, asked.config, most)))
    if not kept:
        raise NotAssessedError(f"{tag}: needs OP and PV that move in one part of its settings, has none")
    first = kept[0][1]
    first = replace(first, shortened=f"{parts_said([part for part, _ in kept])} {first.shortened}".strip())
    others = {part.name: c for part, c in kept[1:]}
    for path in held_out:
        elsewhere = replace(asked, export=(path,), since_s=-math.inf, until_s=math.inf)
        others[path.name if path.name not in others else str(path)] = whole(elsewhere, tag)[0]
    return first, others
