"""What `triage check` says: what was read, and which questions each loop's trends are fit for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from analyzer.assess import unassessable, unfit_for_cause
from analyzer.config import Config
from analyzer.decisions import Needs
from analyzer.history.export import Export
from analyzer.history.stray import stamp_text
from analyzer.loops.spec import LoopSpec
from analyzer.quality import Prepared, prepare
from identification.errors import TriageError


def _tags(spec: LoopSpec) -> str:
    found = [(role, getattr(spec, role)) for role in ("sp", "pv", "op", "mode", "position")]
    return ", ".join(f"{role.upper()} {tag}" for role, tag in found if tag)


def _fit(lacking: Needs | None, prepared: Prepared, config: Config) -> str:
    """Which questions the record is fit for, in words."""
    if lacking is not None:
        return f"fit for nothing: {lacking}"
    unfit = unfit_for_cause(prepared, config)
    if unfit is None:
        return "fit for all questions"
    return f"fit for oscillation and assessments; not for the cause: {unfit}"


def loop_line(export: Export, spec: LoopSpec, config: Config) -> tuple[str, bool]:
    """One loop's line, and whether it cannot be assessed."""
    if spec.pv is None:
        return f"{spec.loop}: no PV tag {spec.wanted_pv or spec.loop + '.PV'} in the export", True
    try:
        prepared = prepare(spec, export.read(spec.tags), config.quality)
    except TriageError as error:
        return f"{spec.loop}: {_tags(spec)}; fit for nothing: {error}", True
    record = prepared.record
    lacking = unassessable(record, config)
    fit = _fit(lacking, prepared, config)
    parts = [_tags(spec), f"{len(record)} samples every {record.dt_s:g} s", *prepared.notes, fit]
    return f"{spec.loop}: " + "; ".join(parts), lacking is not None


def lines(export: Export, specs: Sequence[LoopSpec], notes: Sequence[str]) -> Iterator[tuple[str, bool]]:
    """All lines, each with whether a loop of it cannot be assessed."""
    config = Config()
    first, last = export.span()
    yield f"{len(export.tags)} tags, {len(specs)} loops, {stamp_text(first)} to {stamp_text(last)} UTC", False
    for note in notes:
        yield note, False
    if specs and specs[0].defaults:
        yield "assumed where loops.csv is silent: " + ", ".join(specs[0].defaults), False
    for spec in specs:
        yield loop_line(export, spec, config)
    for note in export.notes:
        yield note, False
