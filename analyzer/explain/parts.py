"""A recording in which settings changed, in parts of one setting each: one is explained, the others are held out.

A controller's law, and a limit cycle, belong to their settings; a valve and a process do not. What is found in one
part has to hold in the others, or it is not told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from analyzer.history.plant_clock import stamp
from analyzer.history.series import Series
from analyzer.loops.changes import TuningChange
from analyzer.loops.settings_in_force import in_force
from analyzer.loops.spec import LoopSpec
from analyzer.night.nights import Night, cut

FEWEST = 300
"""Samples of PV from which a part is judged; ours: a noise model that looks 25 back needs twelve times that."""


@dataclass(frozen=True, slots=True)
class Part:
    """One part: the loop with the settings in force there, its trends, and when it was."""

    spec: LoopSpec
    series: Mapping[str, Series]
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


def said_of(judged: Sequence[Part]) -> str:
    """On which part an explanation rests and which are held out, as a sentence; empty where there is one."""
    if len(judged) < 2:
        return ""
    rest = " and ".join(p.name for p in judged[1:])
    return f"Settings changed within the recording: explained on {judged[0].name}, held out on {rest}."
