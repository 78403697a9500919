"""Result of `triage check`: what was read, and which analyses each loop's trends allow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from analyzer.config import Config
from analyzer.history.plant_clock import stamp
from analyzer.loop.assess import aliasing_requirement, unassessable
from analyzer.loop.cause.fitness import too_thin, unfit_for_cause, unfit_for_settings
from analyzer.loop.decisions import Requirement
from analyzer.loop.experiments.found import ExperimentResults, found_in
from analyzer.loop.identification.measure import time_scale
from analyzer.loop.oscillation.detection import counting, detect
from analyzer.loop.record.judged_stretch import controller_of, differing
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loops.changes import TuningChange, in_force
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import no_loops
from analyzer.night.nights import Plant
from analyzer.night.opened import guarded
from analyzer.night.request import ExportRequest
from analyzer.words.experiments import found_lines
from identification.errors import TriageError

ALONE = "fit only for a model from its experiments"
MOST_NAMES = 5
"""Maximum number of loops listed in a line."""


def _tags(spec: LoopSpec) -> str:
    found = [(role, getattr(spec, role)) for role in ("sp", "pv", "op", "mode", "position")]
    return ", ".join(f"{role.upper()} {tag}" for role, tag in found if tag)


def _fit_for(lacking: Requirement | None, spec: LoopSpec, prepared: Prepared, config: Config) -> str:
    """Analyses that the record allows, in words, by the criteria of a run."""
    if lacking is not None:
        return f"fit for nothing: {lacking}"
    stated = controller_of(spec, prepared) if prepared.op_scaled else None
    found = detect(prepared.record, config.oscillation)
    unseen = aliasing_requirement(prepared.record, found, stated, config)
    if unseen is not None and stated is not None:
        scale = time_scale(prepared.record, counting(found), stated)
        recorded = differing(prepared.record, stated, scale, config.settings)
        unseen = (
            unseen if recorded is None else aliasing_requirement(prepared.record, found, recorded, config)
        )
        stated = recorded or stated
    if unseen is not None:
        return f"fit only for the figures of the assessment: {unseen}"
    unfit = unfit_for_cause(prepared, None, config)
    if unfit is not None:
        return f"fit for oscillation and assessments; not for the cause: {unfit}"
    if (spec.kp is None) != (spec.ti is None):
        named, other = ("ti", "kp") if spec.kp is None else ("kp", "ti")
        return f"fit for all but new settings: loops.csv states {named} and no {other}: add it (ti 0: no integral)"
    unset = unfit_for_settings(prepared, config) or too_thin(prepared.record.dt_s, stated, config)
    return "fit for all questions" if unset is None else f"fit for all but new settings: {unset}"


def loop_line(plant: Plant, spec: LoopSpec) -> tuple[str, bool]:
    """One loop's line, and whether it cannot be assessed."""
    if spec.pv is None:
        return f"{spec.loop}: no PV tag {spec.wanted_pv or spec.loop + '.PV'} in the export", True
    try:
        series = plant.trends(spec.tags)
        prepared = prepare(spec, series, plant.config.quality)
    except TriageError as error:
        return f"{spec.loop}: {_tags(spec)}; fit for nothing: {error}", True
    record = prepared.record
    lacking = unassessable(record, plant.config)
    fit = _fit_for(lacking, spec, prepared, plant.config)
    taught = ExperimentResults(found_in(spec, prepared, series, plant.config), prepared)
    by_hand = any(not x.course.closed for x in taught.found)
    fit = fit.replace("fit for nothing", ALONE) if by_hand else fit
    parts = [_tags(spec), f"{len(record)} samples every {record.dt_s:g} s", *prepared.notes, fit]
    lines = [f"{spec.loop}: " + "; ".join(parts), *found_lines(taught, plant.zone)]
    return "\n  ".join(lines), lacking is not None and not by_hand


def _changes_counted(changes: Sequence[TuningChange], specs: Sequence[LoopSpec]) -> str:
    """Summary of the changes of settings."""
    here = {s.loop for s in specs}
    others = sorted({c.loop for c in changes} - here)
    text = f"{len(changes)} changes of settings, {sum(c.loop in here for c in changes)} of these loops"
    return text + (f"; not of {', '.join(others[:MOST_NAMES])}" if others else "")


def check_lines(request: ExportRequest) -> Iterator[tuple[str, bool]]:
    """All lines on an export, each with whether one of its loops cannot be assessed. Raises InputError if it cannot
    be used, after the lines on it if it has no loops."""
    plant = guarded(request)
    export, specs, notes = plant.export, plant.specs, plant.notes
    first, last = export.span()
    span = f"{stamp(first, request.zone)} to {stamp(last, request.zone)} {request.zone}"
    yield f"{len(export.tags)} tags, {len(specs)} loops, {span}", False
    if specs and specs[0].defaults:
        notes = (*notes, "assumed where loops.csv is silent: " + ", ".join(specs[0].defaults))
    if specs and request.changes:
        notes = (*notes, _changes_counted(request.changes, specs))
    for note in notes:
        yield note, False
    for spec in specs:
        yield loop_line(plant, in_force(spec, plant.changes, last))
    for note in export.notes:
        yield note, False
    if not specs:
        raise no_loops(export.tags)
