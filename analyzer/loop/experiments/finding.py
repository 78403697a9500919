"""A night with an experiment as a finding: alone, if the record gives nothing else, or added to the routine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from analyzer.loop.action import OPEN
from analyzer.loop.conclusion import stated
from analyzer.loop.decisions import Action, Cause, Cell, Fault, Finding, Remedy, Requirement, Status
from analyzer.loop.experiments.found import ExperimentResults, as_rows, chosen, model_row, with_constants
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import as_stated
from analyzer.words import sentences
from analyzer.words.experiments import in_a_clause, settings_text
from identification.models import Pid
from tuning.search import rounded

TEXTS = sentences("experiments")


def remedy_of(of: ExperimentResults, spec: LoopSpec, present: Pid | None) -> Remedy:
    """Remedy from the model of an experiment."""
    if of.settings is None:
        return Remedy(Action.NONE)
    span, s = of.prepared.scale.span, of.settings
    ours, simc = (settings_text(pid, spec, span) for pid in (s.robust, s.simc))
    if present is None:
        return Remedy(Action.CHECK_SETTINGS, TEXTS["not_stated"].format(ours, simc))
    new = chosen(of, present)
    if new is None:
        return Remedy(Action.NONE, TEXTS["as_good"].format(ours, simc))
    kp, ti = as_stated(new, spec, span)
    return Remedy(Action.RETUNE, TEXTS["from_model"].format(s.robust_ms, simc), rounded(kp), rounded(ti))


def _known(of: ExperimentResults) -> dict[str, Cell]:
    """Columns of experiments, and of their model if there is one."""
    out: dict[str, Cell] = {"experiments": as_rows(of), "experiment": in_a_clause(of) or None}
    return out if of.model is None else out | model_row(of.model)


def _witnessed(of: ExperimentResults, witness: Cell) -> dict[str, Cell]:
    """The night's evidence, with the constants of the model."""
    stored = witness if isinstance(witness, str) else None
    return {} if of.model is None else {"witness": with_constants(stored, of.model)}


def by_experiment(
    of: ExperimentResults,
    spec: LoopSpec,
    night: str,
    lacking: Requirement,
    present: Pid | None,
    known: Mapping[str, Cell],
) -> Finding:
    """Finding of a loop whose record gives only its experiment, with the missing data for the other results."""
    record, notes = of.prepared.record, "; ".join(of.prepared.notes)
    span: dict[str, Cell] = {"start_s": record.start_s, "duration_s": record.duration_s, "notes": notes}
    return Finding(
        spec.loop,
        night,
        Status.OK,
        lacking,
        lacking.lack,
        None,
        Cause.UNDECIDED,
        Fault.UNDECIDED,
        remedy=remedy_of(of, spec, present),
        known={**stated(spec), **known, **span, **_known(of), **_witnessed(of, None)},
    )


def with_experiment(found: Finding, of: ExperimentResults, spec: LoopSpec, present: Pid | None) -> Finding:
    """A finding with the experiments added; their model replaces that of the routine, and their settings are used if
    there are no others."""
    witness = found.known.get("witness")
    known = {**found.known, **_known(of), **(_witnessed(of, witness) if witness else {})}
    if found.width_pct is not None:  # the cycles determine the valve
        known["backlash_pct"] = found.known.get("backlash_pct")
    extended = replace(found, known=known)
    if of.model is None or found.remedy.action not in OPEN:
        return extended
    return replace(extended, remedy=remedy_of(of, spec, present))
