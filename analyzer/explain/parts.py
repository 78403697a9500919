"""The parts of a recording, each under one pair of settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from analyzer.history.plant_clock import stamp
from analyzer.history.series import Series
from analyzer.loops.changes import TuningChange, in_force
from analyzer.loops.spec import LoopSpec
from analyzer.night.nights import Night, cut

PART_SAMPLES = 300
"""Samples of PV from which a part under other settings is judged: a noise model that reaches 25 samples
back needs twelve times as many."""


@dataclass(frozen=True, slots=True)
class Part:
    """One part: the loop with its settings then, its trends, and its time."""

    spec: LoopSpec
    series: dict[str, Series]
    name: str
    samples: int


def parts(
    spec: LoopSpec, series: Mapping[str, Series], changes: Sequence[TuningChange], zone: str
) -> list[Part]:
    """The parts of a recording, the one with most samples first; a single one without a change.

    series : trends by tag, including PV's; changes : of any loops; zone : the plant's, for the names of parts.
    """
    stamps = series[spec.pv or ""].stamp_s
    first, last = float(stamps[0]), float(stamps[-1])
    stated = [c.time_s for c in changes if c.loop == spec.loop]
    dated = [s.valid_from_s for s in (*spec.earlier, spec) if s.valid_from_s is not None]
    changed = sorted({t for t in (*stated, *dated) if first < t < last})
    ends = [first, *changed, last + 1.0]
    out = []
    for a, b in pairwise(ends):
        held = {tag: cut(x, Night("", a, b)) for tag, x in series.items()}
        pv = held[spec.pv or ""].stamp_s
        if pv.size:
            name = f"{stamp(float(pv[0]), zone)} to {stamp(float(pv[-1]), zone)}"
            out.append(Part(in_force(spec, changes, float(pv[-1])), held, name, pv.size))
    out.sort(key=lambda p: -p.samples)
    return [out[0], *(p for p in out[1:] if p.samples >= PART_SAMPLES)]


def parts_note(judged: Sequence[Part]) -> str:
    """A sentence on the part that is explained and those held out; empty for a single part."""
    if len(judged) < 2:
        return ""
    rest = " and ".join(p.name for p in judged[1:])
    return f"Settings changed within the recording: explained on {judged[0].name}, held out on {rest}."
