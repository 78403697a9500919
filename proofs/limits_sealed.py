"""Sealed cases of proofs/concealed on which proofs/limits.py measures the limits of an explanation."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import pandas as pd

from analyzer.api import read
from analyzer.config import Config
from analyzer.explain.case import case
from analyzer.loops.spec import spec_of
from identification.controller.check import Finding, StatedSettings
from identification.mismatch.answer import answer
from identification.mismatch.diagnosis import controller_finding_of, explain, recorder_finding_of
from identification.mismatch.recording import STEP, Recording, unlogged
from proofs.concealed.make import seal
from proofs.concealed.plan import Case, plan
from proofs.limits_samples import DEFAULT, tried

CASES, EXPLAINED, SEED = 84, 10, 4077
"""Cases for recorder and controller, how many of them are fully explained, and the seed of all."""
HARD = tuple(
    (name, level)
    for name in ("controller-gap", "controller-logic")
    for level in ("masked", "concealed", "buried")
)
EACH = 12
"""Number of additional cases for each controller fault that is hard to detect."""
THINNED = 10
"""Each recording is also used with every tenth sample, as a historian keeps it."""


def _cases() -> list[Case]:
    hard = [(fault, 100 * i + j) for i, fault in enumerate(HARD) for j in range(EACH)]
    return [*plan(CASES, SEED), *(Case(f"H{n}", (fault,), "", SEED + n) for fault, n in hard)]


def _recording(folder: Path, tag: str) -> Recording:
    """One sealed recording as `triage explain` reads it."""
    plant = read(folder / f"{tag}-fit.parquet", folder / "loops.csv")
    source, specs = plant.export, plant.specs
    spec = spec_of(specs, tag)
    series = source.read([*spec.tags, *(t for other in specs for t in other.tags)])
    return case(spec, specs, series, DEFAULT).recording


@cache
def recordings() -> list[Recording]:
    """All cases that can be read."""
    out = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for todo in _cases():
            rows, tag, _ = seal(folder, [], todo)
            pd.DataFrame(rows).to_csv(folder / "loops.csv", index=False)
            found = tried(partial(_recording, folder, tag))
            out += [] if isinstance(found, str) else [found]
    return out


def thinned(s: Recording) -> Recording:
    """A recording with every tenth sample."""
    keep = slice(None, None, THINNED)
    settings = s.stated
    return replace(
        s,
        sp=None if s.sp is None else s.sp[keep],
        pv=s.pv[keep],
        op=s.op[keep],
        usable=s.usable[keep],
        dt_s=s.dt_s * THINNED,
        stamp_s=s.stamp_s[keep],
        stated=None
        if settings is None
        else StatedSettings(settings.kp, settings.ti / THINNED, settings.scans * THINNED),
        neighbours=tuple(x[keep] for x in s.neighbours),
    )


def _answer_of(found: Finding | None) -> Any:
    return None if found is None else (found.name, *(f"{k} {v:.3g}" for k, v in found.values.items()))


def of_recorder(c: Config) -> list[Any]:
    """Recorder finding, samples that were not logged, and whether the controller can be assessed."""
    out = []
    unranged = [replace(s, ranged=False) for s in recordings()[::3]]
    for s in (replace(s, limits=c.explain) for s in [*recordings(), *unranged]):
        found = recorder_finding_of(s)
        missing = unlogged(s.stamp_s, s.pv.size, s.dt_s, c.explain_recorder)
        out.append((_answer_of(found), int(missing.sum()), controller_finding_of(s, found)[1] is None))
    gridded = [s for s in recordings() if (f := recorder_finding_of(s)) is not None and STEP in f.values]
    return [*out, *_answers(gridded[:4], c)]


def of_controller(c: Config) -> list[Any]:
    """Findings of clock and controller."""
    thin = [thinned(s) for s in recordings()]
    made = (replace(s, limits=c.explain) for s in [*recordings(), *thin])
    return [(_answer_of(controller_finding_of(s, None)[0]), s.every_scan) for s in made]


def of_effects(c: Config) -> list[Any]:
    """The answers for some cases: verdict, effects and missing information."""
    return _answers(recordings()[: CASES : CASES // EXPLAINED], c)


def _answers(asked: list[Recording], c: Config) -> list[Any]:
    found = [answer(explain(s), s) for s in (replace(s, limits=c.explain) for s in asked)]
    return [(a.verdict, tuple(e.name for e in a.effects), a.note) for a in found]
