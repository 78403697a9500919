"""Text and pictures of `triage tune` for one loop: its last night read, assessed and tuned, new settings forecast."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from analyzer.columns import Row
from analyzer.config import AdviceLimits, Config
from analyzer.loop.action import AGAINST
from analyzer.loop.advice.advise import Advice, withheld
from analyzer.loop.advice.propose import propose, tuning_model
from analyzer.loop.advice.settings_side_by_side import compared
from analyzer.loop.advice.sluggish import faster_settings, rejecting_settings
from analyzer.loop.advice.tune_pictures import pictures
from analyzer.loop.advice.tuned import Tuning
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.cause.fitness import at_limits, unfit_for_cause
from analyzer.loop.decisions import Action, Cause, Requirement, RequirementKind, Status
from analyzer.loop.experiments.found import ExperimentResults, experiment_results
from analyzer.loop.identification.identified import (
    error_of_night,
    indistinguishable,
    load_of,
    load_of_night,
    tuned,
)
from analyzer.loop.identification.intervals import intervals
from analyzer.loop.identification.measure import time_scale
from analyzer.loop.oscillation.detection import Oscillation
from analyzer.loop.record.judged_stretch import controller_of
from analyzer.loop.record.quality import Prepared
from analyzer.loop.record.sample_clock import onto_clock
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import as_stated
from analyzer.words import experiments, sentences
from analyzer.words.decision import as_data, decision_lines
from analyzer.words.reason import sign_in_full
from analyzer.words.units import number
from identification.errors import InputError, NotAssessedError
from identification.estimation.between_samples import scans_per_row
from identification.estimation.model import Fitted
from identification.models import Estimate, Loop, Pid, Process, Valve
from identification.record import Floats, LoopRecord
from tuning.forecast import UNMODELLED, Forecast, predict
from tuning.frequency_response import is_stable, slowest_s
from tuning.limit_cycle import confirm
from tuning.reasons import WHY
from tuning.recommend import WITHOUT_SETTINGS, Proposal

NEIGHBOURS = 8
"""Other loops whose OP is read with a loop's own trends, in the order of loops.csv [loops]: each is one more
trend in memory, and the first that moves is the one that is tried."""

if TYPE_CHECKING:
    from analyzer.night.decided import Decided
    from analyzer.night.nights import PlantLoop

UNMODELLED_SPARSE = 0.13
"""As UNMODELLED, of a faulty valve in a record of one row in several scans: rms of the logarithm of error that came
over error forecast, 24 loops with backlash of benchmarks/world every 10 s (seeds 603 to 606); 0.05 of 31 at 1
s."""

TEXTS = sentences("settings")
NO_MOVES = Requirement(None, RequirementKind.MOVING_PV)
FORECAST = ("average_absolute_error", "stem_travel", "oscillation", "variability")
"""Reported figures of a forecast."""


def identified(found: Assessment, limits: AdviceLimits) -> tuple[Process, Valve, dict[str, Estimate]]:
    """Process, valve and their parameters with 90 % intervals, from one assessed loop's verdict. Raises
    NotAssessedError if the loop's trends give no model."""
    verdict = found.verdict
    fit, at_fault = verdict.fit, verdict.cause is Cause.VALVE
    valve = fit.valve.valve if at_fault else None
    law = None if verdict.measured is None else verdict.measured.controller
    return tuned(fit, at_fault, limits), valve, intervals(fit, at_fault, limits, law)


def tune(
    found: Assessment,
    controller: Pid,
    config: Config,
    advice: Advice | None,
    prepared: Prepared,
    kind: str,
    decided: tuple[Action, Pid | None] | None = None,
) -> Tuning:
    """Propose settings for one assessed loop with stated ones `controller` [%, s], and further terms found in the
    record; `advice`, the reason if none are to be proposed (advice.withheld); prepared, its record, and kind, its
    type; decided, action and settings of all nights, which have precedence. Raises NotAssessedError if the loop's
    trends give no model."""
    verdict, controller = found.verdict, found.shown or controller
    first = found.oscillations.first
    period = first.period_s if first else None
    model, fit, others = tuning_model(verdict, controller, config.advice)
    if advice is not None and advice.reason and advice.action is not None:
        proposal = Proposal(advice.action, advice.reason)
    else:
        proposal = propose(verdict, controller, period, config, prepared.record).proposal
    if decided is not None:
        action, typed = decided
        own = typed and replace(controller, kp=typed.kp, ti_s=typed.ti_s, td_s=typed.td_s)
        proposal = _as_decided(proposal, action, own)
    new = proposal.new
    if new is not None and verdict.cause in (Cause.NONE, Cause.LOAD):
        known = faster_settings if verdict.cause is Cause.NONE else rejecting_settings
        slow = known(prepared.record, controller, kind, config)
        model, fit, others = (model, fit, others) if slow is None else (slow.loop, slow.fit, slow.others)
    forecast = None if new is None else _forecast(model, new, fit, others, prepared.record, first, config)
    return Tuning(
        intervals(verdict.fit, verdict.cause is Cause.VALVE, config.advice, controller),
        model,
        period,
        first.amplitude_pct if first else None,
        confirm(model),
        proposal,
        forecast,
        load_of(fit, controller),
        others,
    )


def _forecast(
    model: Loop,
    new: Pid,
    fit: Fitted,
    others: tuple[Loop, ...],
    record: LoopRecord,
    oscillation: Oscillation | None,
    config: Config,
) -> Forecast | None:
    """The effect of new settings under the load of the whole record; None if the load is too short, or if the loop
    with the present settings does not have the recorded error under it."""
    now = model.controller
    period_s = time_scale(record, oscillation, now)
    night = load_of_night(fit, now, record, period_s)
    if night.size < config.tuning.least_steps:
        return None
    sparse = scans_per_row(now, record.dt_s) > 1 and model.valve is not None
    same = indistinguishable(fit, model, period_s, record) if sparse else ()
    unmodelled = UNMODELLED_SPARSE if sparse else UNMODELLED
    found = predict(model, new, night, others, same, unmodelled)
    ratio = found.before[FORECAST[0]].value / max(error_of_night(record, now), 1e-9)
    distance = abs(math.log(max(ratio, 1e-9)))
    return found if distance <= math.log(config.advice.agree_error) else None


def _as_decided(found: Proposal, action: Action, new: Pid | None) -> Proposal:
    """A proposal with the decided action and settings; without a reason if its action was another one."""
    meanwhile = found.meanwhile if action is Action.REPAIR_VALVE else None
    reason = found.reason if action is found.action else ""
    return replace(found, action=action, reason=reason, controller=new, meanwhile=meanwhile)


def _cycle_lines(t: Tuning) -> list[str]:
    recorded = "none"
    if t.period_s is not None and t.amplitude_pct is not None:
        recorded = f"{number(t.period_s)} s, ±{t.amplitude_pct:.3g} % of PV span"
    c = t.cycle.cycle
    simulated = f"{number(c.period_s)} s, ±{c.pv_amplitude:.3g} %" if c else "none"
    if c is not None and c.pv_amplitude > 100.0:
        simulated = "unstable, up to OP's limits"
    p = t.cycle.predicted
    predicted = f"{number(p.period_s)} s, ±{p.pv_amplitude:.3g} %" if p else "none"
    lines = [
        f"limit cycle recorded: {recorded}",
        f"  simulated: {simulated}",
        f"  describing function: {predicted}",
    ]
    if t.period_s is None and p is not None:
        lines.append(TEXTS["no_such_cycle"])
    return lines


def _forecast_lines(t: Tuning) -> list[str]:
    if t.proposal.new is None:
        return []
    if t.forecast is None:
        return [TEXTS["no_forecast"]]
    lines = [
        "forecast on the reconstructed load of the record (90 % intervals for the next record of such a load):"
    ]
    for key in FORECAST:
        b, a, c = t.forecast.before[key], t.forecast.after[key], t.forecast.change[key]
        change = f"{100 * c.value:+.0f} % ({100 * c.low:+.0f} to {100 * c.high:+.0f})"
        lines.append(f"  {key.replace('_', ' ')}: {b.value:.3g} to {a.value:.3g} {b.unit}, {change}")
    return lines


def proposal_lines(t: Tuning, spec: LoopSpec, pv_span: float) -> list[str]:
    """The proposal in words and figures."""
    out = [
        f"{k}: {number(e.value)} ({number(e.low)} to {number(e.high)}) {e.unit}"
        for k, e in t.estimates.items()
    ]
    if "gain" not in t.estimates:
        out.append("gain and time constant: only their ratio is known from this record")
    out += _cycle_lines(t)
    if t.proposal.meanwhile is not None:
        kp, ti = as_stated(t.proposal.meanwhile, spec, pv_span)
        form = f"{spec.gain_unit}, {spec.form}"
        out.append(f"until the repair: kp {number(kp)}, ti {number(ti)} {spec.ti_unit} ({form})")
    return [*out, *filter(None, [t.proposal.reason]), *_forecast_lines(t)]


@dataclass(frozen=True, slots=True)
class TuningReport:
    """Report on retuning a loop: lines of text, pictures by file name, the night's decision, and the model and the
    forecast as data."""

    lines: list[str]
    pictures: dict[str, bytes]
    decision: Row
    tuning: Tuning | None = None

    def as_data(self) -> dict[str, Any]:
        """All of it as plain data, without the pictures."""
        t = self.tuning
        data: dict[str, Any] = {"loop": self.decision["loop"], "decision": as_data(self.decision)}
        if t is None:
            return data | {"estimates": {}, "simulated_cycle": None, "forecast": {}, "text": self.lines}
        sides = {} if t.forecast is None else asdict(t.forecast)
        data["estimates"] = {k: asdict(e) for k, e in t.estimates.items()}
        data["simulated_cycle"] = None if t.cycle.cycle is None else asdict(t.cycle.cycle)
        data["forecast"] = {
            k: {x: sides[x][k] for x in ("before", "after", "change")} for k in FORECAST if sides
        }
        return data | {"text": self.lines}


def proposal(one: PlantLoop, decision: Decided, drawn: bool) -> TuningReport:
    """The report on one loop over a night that decided `decision`, with pictures if wanted. Raises InputError if its
    settings are not known, NotAssessedError if its trends give no model and the night decided nothing."""
    spec, stated = one.spec, one.controller
    taught = results_with_neighbours(one)
    shown = [] if taught is None else list(experiments.lines(taught, spec, stated, one.plant.zone))
    known = taught is not None and taught.model is not None
    row = decision.row
    head = decision_lines(row)
    try:
        report = _routine(one, stated, decision, drawn)
    except (InputError, NotAssessedError) as error:
        decides = row["status"] == Status.OK and not isinstance(error, InputError)
        if not known and not decides:
            raise
        return TuningReport([*head, *shown, f"no model from routine operation: {error}"], {}, row)
    return replace(report, lines=[*head, *shown, *report.lines])


def results_with_neighbours(one: PlantLoop) -> ExperimentResults | None:
    """Results of a loop's experiments, with its neighbours' OPs."""
    spec, plant, record = one.spec, one.plant, one.prepared.record
    series = plant.trends(spec.tags, one.night)
    return experiment_results(spec, series, one.prepared, plant.config, neighbours=_neighbours(one, record))


def _neighbours(one: PlantLoop, record: LoopRecord) -> tuple[Floats, ...]:
    """OPs of the plant's other loops on a record's clock, up to the number that an explanation uses."""
    spec, plant = one.spec, one.plant
    tags = [s.op for s in plant.specs if s.loop != spec.loop and s.op and s.op != spec.op]
    tags = list(dict.fromkeys(tags))[:NEIGHBOURS]
    clock, found = record.start_s + record.time_s, []
    for x in plant.trends(tags, one.night).values() if tags else ():
        op, gap = onto_clock(x, clock, record.dt_s, plant.config.quality)
        if not gap.all() and float(np.ptp(op)) > 0.0:
            found.append(op)
    return tuple(found)


def _routine(one: PlantLoop, stated: Pid | None, decision: Decided, drawn: bool) -> TuningReport:
    """The report from routine operation in automatic; without a model if the cause is external, because the load then
    looks like the process."""
    spec, prepared, config, loop = one.spec, one.prepared, one.plant.config, one.spec.loop
    if stated is None:
        seen = f"{loop}: no kp and ti in loops.csv"
        raise InputError(seen, "both", "state them, so that new ones can be compared")
    row = decision.row
    found = decision.found or assess(prepared, stated, config, spec.type, one.earlier)
    cause, action = Cause(row["cause"] or Cause.NONE), Action(row["action"] or Action.NONE)
    text = []
    if found.verdict.cause is cause:
        signs = [s for s in found.verdict.signs if s.points_to is cause]
        text = [f"sign of {s.points_to}: {sign_in_full(s)}" for s in signs]
    else:  # the cause from the plant or from other nights
        found = replace(found, verdict=replace(found.verdict, cause=cause))
    if found.verdict.measured is None:
        limited = at_limits(prepared.record, config.quality) if prepared.op_known else None
        needs = limited or unfit_for_cause(prepared, None, config)  # the most direct reason first
        raise NotAssessedError(f"{loop}: {needs or found.verdict.needs or NO_MOVES}")
    if cause not in AGAINST and action is not Action.RETUNE:
        reasons = [WHY[cause]] if action is WITHOUT_SETTINGS[cause] else []
        kind = "no_model_of_load" if cause is Cause.LOAD else "no_model"
        return TuningReport([*text, *reasons, TEXTS[kind]], {}, row)
    new = None
    if action is Action.RETUNE:
        new = controller_of(replace(spec, kp=row["kp_new"], ti=row["ti_new"]), prepared)
    advice = withheld(found, spec, stated, prepared.scale.span, config)
    tuning = tune(found, stated, config, advice, prepared, spec.type, (action, new))
    text += proposal_lines(tuning, spec, prepared.scale.span)
    lines, files = _with_compared_settings(
        tuning, spec, prepared.scale.span, config, row["night"], text, drawn
    )
    return TuningReport(lines, files, row, tuning)


def _with_compared_settings(
    t: Tuning, spec: LoopSpec, pv_span: float, config: Config, night: str, text: list[str], drawn: bool
) -> tuple[list[str], dict[str, bytes]]:
    """Text with the settings to choose between; pictures by file name and, among them, the page of settings."""
    from analyzer.pages.compared import choices, settings_page
    from reports.html import render
    from reports.pictures import as_file

    period_s = t.period_s or 10.0 * slowest_s(t.model)
    new = t.proposal.new
    bounded = new is not None or is_stable(t.model)  # else the identified loop is unstable
    known = t.model, t.load, new, period_s, pv_span, config.tuning, t.others
    is_compared = new is not None or t.proposal.before is not None
    found = compared(*known) if bounded and (is_compared or drawn) else None
    if found is not None and is_compared:
        text = [*text, *choices(found, spec)]
    if not drawn:
        return text, {}
    files = {f"{p.name}.svg": as_file(p).encode() for p in pictures(t, spec.loop)}
    if found is not None:
        files["settings.html"] = render(settings_page(spec.loop, night, found, spec), True).encode()
    return text, files
