"""Advice on a flagged loop: the tuning package's result for its identified model and settings."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from analyzer.config import Config
from analyzer.loop import action
from analyzer.loop.advice.propose import propose
from analyzer.loop.advice.settings_side_by_side import Comparison, compared
from analyzer.loop.advice.sluggish import FasterSettings, faster_settings, rejecting_settings
from analyzer.loop.assess import Assessment
from analyzer.loop.cause.fitness import too_thin
from analyzer.loop.cause.verdict import Verdict
from analyzer.loop.decisions import Action, Cause, Due, Fault, MissingData, Requirement, RequirementKind
from analyzer.loop.oscillation.detection import counting
from analyzer.loop.record.quality import Prepared
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import as_stated
from analyzer.loops.typing_errors import typing_error
from analyzer.words import sentences
from analyzer.words.units import corrected_columns, intervals_of, of_controller, schedule_shown
from identification.models import Pid
from identification.record import LoopRecord
from tuning.first_step import calmer_step
from tuning.limit_cycle import Cycle
from tuning.recommend import WITHOUT_SETTINGS, Proposal
from tuning.search import rounded

TEXTS = sentences("settings")
"""Sentences about settings that are given, or withheld."""


@dataclass(frozen=True, slots=True)
class Advice:
    """A proposal in the loop's own units.

    action as in the ranking, None if none was searched for; reason in words, empty if the finding is sufficient;
    kp_new and ti_new in the units and form that loops.csv states, None unless action is retune; before and after, the
    limit cycles in simulation at the present and at the new settings, None if there is none; lack, the missing data
    if the action is to get more data; due, due time of a valve's repair; compared, present, new and textbook settings
    on the load, None without settings.
    """

    action: Action | None
    reason: str = ""
    kp_new: float | None = None
    ti_new: float | None = None
    before: Cycle | None = None
    after: Cycle | None = None
    lack: MissingData | None = None
    due: Due = Due.NOW
    compared: Comparison | None = field(default=None, compare=False)


def advise(
    found: Assessment,
    spec: LoopSpec,
    controller: Pid | None,
    pv_span: float,
    config: Config,
    earlier_settings: Pid | None = None,
    record: LoopRecord | None = None,
) -> Advice:
    """The advice on one assessed loop.

    controller, its stated settings in percent and seconds; pv_span, span of PV in its own unit, for settings in
    engineering units; earlier_settings, settings reported by earlier nights, which are then compared with the present
    ones; record, the whole one, on whose load the settings of a loop that is too tight are tested, None: that of the
    fitted stretch.
    """
    withheld_advice, oscillation = (
        withheld(found, spec, controller, pv_span, config),
        counting(found.oscillations),
    )
    if not found.op_scaled and found.for_settings is not None:
        return _unscaled(withheld_advice, found.for_settings)
    if withheld_advice is not None:
        return withheld_advice
    assert controller is not None  # else `withheld` has given the reason
    assert oscillation is not None
    proposed = propose(found.verdict, controller, oscillation.period_s, config, record)
    proposal = proposed.proposal
    if proposal.action is Action.UNDECIDED and found.verdict.cause is Cause.VALVE:
        proposal = replace(proposal, action=Action.REPAIR_VALVE)
    elif proposal.action is Action.UNDECIDED:
        return _lacking(Requirement(MissingData.STEP_TEST, RequirementKind.STEP_TEST, (proposal.reason,)))
    comparison = None
    if proposed.loop is not None and proposed.load is not None:
        known = proposed.loop, proposed.load, earlier_settings or proposal.new, oscillation.period_s, pv_span
        comparison = compared(*known, config.tuning, proposed.others, proposed.indistinguishable)
    return replace(_as_advice(proposal, spec, pv_span), compared=comparison)


def advise_beyond_faults(
    found: Assessment, advice: Advice, prepared: Prepared, spec: LoopSpec, controller: Pid, config: Config
) -> Advice:
    """The advice on a loop without a fault of its own: faster settings if it is sluggish, others if it amplifies an
    external cycle that it could reject, and a first step if it rings in a cycle whose cause is undecided."""
    if found.outdated or found.settings is not None or found.scheduled_over is not None:
        return advice
    if not (prepared.op_known and prepared.op_scaled):
        return advice
    cause, cycles = found.verdict.cause, counting(found.oscillations) is not None
    new, reason = None, ""
    if (cause, cycles, advice.action) == (Cause.NONE, False, Action.NONE):
        new, reason = _faster(faster_settings(prepared.record, controller, spec.type, config), "sluggish")
    elif (cause, cycles, advice.action) == (Cause.LOAD, True, Action.FIND_DISTURBANCE):
        new, reason = _faster(rejecting_settings(prepared.record, controller, spec.type, config), "rejects")
    elif cause is Cause.UNDECIDED and cycles and found.verdict.fault is Fault.NONE:
        new, reason = _calmer(found.verdict, config)
    if new is None:
        return advice
    kp, ti = as_stated(new, spec, prepared.scale.span)
    return Advice(Action.RETUNE, reason, rounded(kp), rounded(ti))


def _faster(found: FasterSettings | None, name: str) -> tuple[Pid | None, str]:
    """New settings and their reason."""
    if found is None:
        return None, ""
    if found.change is None or found.travel is None:
        return found.new, TEXTS["first_step"]
    return found.new, TEXTS[name].format(found.times, 100.0 * found.change, 100.0 * found.travel)


def _calmer(verdict: Verdict, config: Config) -> tuple[Pid | None, str]:
    """A first step from the ringing alone for an undecided cycle at which the loop has little damping, and its
    reason: it is right for a loop that is too tight, and a load at its period is amplified less. None if a faulty
    valve is as likely as another cause, or the record does not show a cycle's waveform: it may be no ringing."""
    m, lacks = verdict.measured, verdict.needs
    if m is None or m.ringing is None or m.controller is None or m.observed is None:
        return None, ""
    if lacks is None or lacks.lack is not MissingData.MANUAL_TEST:
        return None, ""
    valve, *others = (verdict.confidence[c] for c in (Cause.VALVE, Cause.TUNING, Cause.LOAD))
    if not m.ringing.rings(config.cause) or (valve > min(others) and m.evidence > 0.0):
        return None, ""
    step = calmer_step(m.controller, m.observed, config.tuning)
    most = 100.0 * (config.tuning.tight_error_growth - 1.0)
    return (None, "") if step is None else (step.new, TEXTS["rings"].format(most))


def with_controller_note(
    found: Assessment, spec: LoopSpec, stated: Pid | None, prepared: Prepared
) -> Assessment:
    """The assessment with a note on properties of the controller in the record that loops.csv does not state."""
    if found.scheduled_over is not None:
        note = TEXTS["scheduled"].format(found.scheduled_over.over.upper())
        if stated is not None and found.scheduled_over.edge is not None:
            columns = schedule_shown(found.scheduled_over, stated, spec, prepared.scale)
            note = f"{note}; the record shows {columns}"
        return replace(found, notes=(*found.notes, note))
    if found.shown is None:
        return found
    span = prepared.scale.span
    if stated is None:
        note = TEXTS["recorded"].format(
            of_controller(found.shown, spec, span) + intervals_of(found.shown, found.law, spec, span)
        )
    else:
        note = TEXTS["beside"].format(corrected_columns(stated, found.shown, spec, span))
    return replace(found, notes=(*found.notes, note))


def on_recorded(advice: Advice, found: Assessment, spec: LoopSpec, pv_span: float) -> Advice:
    """Advice on a loop without stated settings: its reason states that new ones are based on the recorded ones."""
    if found.shown is None or advice.kp_new is None:
        return advice
    followed = of_controller(found.shown, spec, pv_span)
    return replace(advice, reason=TEXTS["on_recorded"].format(followed, advice.reason))


def _unscaled(advice: Advice | None, needs: Requirement) -> Advice:
    """Advice if OP is not in percent: a stroke test of a faulty valve nevertheless, else a request for the range."""
    if advice is not None and advice.action is Action.REPAIR_VALVE:
        return replace(advice, reason=str(needs), lack=needs.lack)
    return _lacking(needs)


def _or_repair(verdict: Verdict, other: Advice) -> Advice:
    """Advice if data for new settings are missing: a faulty valve needs repair nevertheless."""
    return Advice(Action.REPAIR_VALVE, other.reason) if verdict.cause is Cause.VALVE else other


def _lacking(needs: Requirement) -> Advice:
    """The advice to get more data, or a test if no data suffice, with the missing data."""
    return Advice(action.for_lack(needs.lack), str(needs), lack=needs.lack)


def withheld(
    found: Assessment, spec: LoopSpec, controller: Pid | None, pv_span: float, config: Config
) -> Advice | None:
    """Reason and advice if no settings are searched for; None if they are."""
    verdict = found.verdict
    if verdict.dead:
        return Advice(Action.REPAIR_VALVE)
    if found.outdated:
        return Advice(Action.NONE, TEXTS["just_changed"])
    if found.settings is not None and controller is not None:
        listed, followed = (of_controller(pid, spec, pv_span) for pid in (controller, found.settings))
        followed += intervals_of(found.settings, found.law, spec, pv_span)
        return Advice(
            Action.CHECK_SETTINGS, TEXTS["differ"].format(listed, followed) + _slip(found, spec, pv_span)
        )
    if found.needs is not None:
        return _lacking(found.needs)
    worn = verdict.fault in (Fault.BACKLASH, Fault.STICTION)
    if worn and verdict.cause in (Cause.LOAD, Cause.UNDECIDED):
        return Advice(Action.REPAIR_VALVE, TEXTS["worn_beside"], due=Due.SHUTDOWN)
    if verdict.cause in (Cause.NONE, Cause.LOAD):
        return Advice(WITHOUT_SETTINGS[verdict.cause])
    if counting(found.oscillations) is None:
        at_fault = verdict.cause is Cause.VALVE
        return (
            Advice(Action.REPAIR_VALVE, TEXTS["calm"], due=Due.SHUTDOWN) if at_fault else Advice(Action.NONE)
        )
    if verdict.needs is not None:
        return _lacking(verdict.needs)
    if verdict.cause is Cause.UNDECIDED:
        return _too_thin(found, controller, config) or Advice(Action.UNDECIDED)
    return _unsupported(found, controller, config)


def _slip(found: Assessment, spec: LoopSpec, pv_span: float) -> str:
    """Unit or form in which the stated figures equal the recorded ones, '' if there is none."""
    changed = {} if found.settings is None else typing_error(spec, found.settings, pv_span)
    written = " and ".join(f"{column} {value}" for column, value in changed.items())
    return TEXTS["slip"].format(written) if changed else ""


def _unsupported(found: Assessment, controller: Pid | None, config: Config) -> Advice | None:
    """Missing data for new settings of a loop with a valve or tuning cause; None if there are none."""
    if found.for_settings is not None and found.verdict.cause is Cause.VALVE:
        return Advice(Action.REPAIR_VALVE, f"no new settings: {found.for_settings}")
    if found.for_settings is not None:
        return _lacking(found.for_settings)
    if controller is None:
        return _or_repair(found.verdict, Advice(Action.CHECK_SETTINGS, TEXTS["not_stated"]))
    if found.scheduled_over is not None:
        reason = TEXTS["scheduled"].format(found.scheduled_over.over.upper())
        return _or_repair(found.verdict, Advice(Action.NONE, reason))
    if found.judged_h < config.advice.least_h:
        return _lacking(
            Requirement(MissingData.LONGER, RequirementKind.HOURS, (config.advice.least_h, found.judged_h))
        )
    return _too_thin(found, controller, config)


def _too_thin(found: Assessment, controller: Pid | None, config: Config) -> Advice | None:
    """Required sampling if the controller acts several times between two samples, unrecorded."""
    m = found.verdict.measured
    thin = (
        None
        if m is None or found.verdict.identified_between_rows
        else too_thin(m.problem.row_s, controller, config)
    )
    return None if thin is None else _or_repair(found.verdict, _lacking(thin))


def _as_advice(proposal: Proposal, spec: LoopSpec, pv_span: float) -> Advice:
    """A proposal in the units and form of the plant's controller."""
    before, after = (c.cycle if c is not None else None for c in (proposal.before, proposal.after))
    if proposal.controller is None:
        return Advice(proposal.action, proposal.reason, before=before)
    kp, ti = as_stated(proposal.controller, spec, pv_span)
    return Advice(proposal.action, proposal.reason, rounded(kp), rounded(ti), before, after)
