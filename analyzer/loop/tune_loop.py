"""From an export to the proposal for one loop: the last night of it, read, assessed and tuned."""

from __future__ import annotations

import math
from collections.abc import Sequence

from analyzer.config import Config
from analyzer.history.export import Export
from analyzer.history.plant_clock import UTC_NAME
from analyzer.loop.advice import withheld
from analyzer.loop.assess import assess
from analyzer.loop.decisions import Action, Cause, Needs
from analyzer.loop.fitness import at_limits, unfit_for_cause
from analyzer.loop.judged_stretch import controller_of, earlier_settings
from analyzer.loop.quality import Prepared, prepare
from analyzer.loop.tune import Tuning, lines, pictures, tune
from analyzer.loops.changes import TuningChange
from analyzer.loops.settings_in_force import in_force
from analyzer.loops.spec import LoopSpec, spec_of
from analyzer.night.nights import cut, nights_of
from identification.errors import InputError, NotAssessedError
from tuning.frequency_response import slowest_s

NO_MODEL = "needs PV that moves with OP, so that a model can be identified"


def _unfit(prepared: Prepared, config: Config) -> Needs | None:
    """What the trends lack for a model, the nearest first; None where nothing is known."""
    limited = at_limits(prepared.record, config.quality) if prepared.op_known else None
    return limited or unfit_for_cause(prepared, None, config)


def proposal(
    export: Export,
    specs: Sequence[LoopSpec],
    loop: str,
    config: Config,
    span: tuple[float, float] = (-math.inf, math.inf),
    drawn: bool = True,
    changes: Sequence[TuningChange] = (),
    zone: str = UTC_NAME,
) -> tuple[list[str], dict[str, bytes]]:
    """Lines of text and, if wanted, pictures by file name for one loop's last night within a span of time [s].

    Raises
    ------
    InputError, NotAssessedError
        Where the loop or its settings are not known, or its trends give no model.
    """
    row = spec_of(specs, loop)
    night = nights_of(export, [row], config.nights, *span, zone)[-1]
    spec = in_force(row, changes, night.last_s)
    prepared = prepare(spec, {t: cut(s, night) for t, s in export.read(spec.tags).items()}, config.quality)
    stated = controller_of(spec, prepared)
    if stated is None:
        raise InputError(
            f"{loop}: no kp and ti in loops.csv", "both", "state them, so that new ones can be compared"
        )
    found = assess(prepared, stated, config, spec.type, earlier_settings(row, changes, prepared))
    head = [f"{loop}, night {night.name}: cause {found.verdict.cause}"]
    text = head + [f"sign of {s.points_to}: {s.whole}" for s in found.verdict.signs]
    needs = _unfit(prepared, config)
    if found.verdict.measured is None and found.verdict.cause is Cause.VALVE:
        return [*text, f"action: {Action.REPAIR_VALVE}", f"no settings: {needs or NO_MODEL}"], {}
    if found.verdict.measured is None:
        raise NotAssessedError(f"{loop}: {needs or found.verdict.needs or NO_MODEL}")
    tuning = tune(found, stated, config, withheld(found, spec, stated, prepared.scale.span, config))
    text += lines(tuning, spec, prepared.scale.span)
    return text, _drawn(tuning, spec, prepared.scale.span, config, night.name) if drawn else {}


def _drawn(t: Tuning, spec: LoopSpec, pv_span: float, config: Config, night: str) -> dict[str, bytes]:
    """Pictures by file name, and the page on which settings are compared and tried."""
    from analyzer.loop.settings_side_by_side import compared
    from analyzer.pages.compared import page
    from reports.html import render
    from reports.pictures import as_file

    new = t.proposal.controller or t.proposal.meanwhile
    period_s = t.period_s or 10.0 * slowest_s(t.model)
    found = compared(t.model, t.load, new, period_s, spec, pv_span, config.tuning)
    tried = (
        {} if found is None else {"settings.html": render(page(spec.loop, night, found, spec), True).encode()}
    )
    return {f"{p.name}.svg": as_file(p).encode() for p in pictures(t, spec.loop)} | tried
