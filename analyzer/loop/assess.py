"""One loop, one night: the assessment of a prepared record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from analyzer.config import CauseLimits, Config
from analyzer.history.plant_clock import HOUR_S
from analyzer.loop.cause.dead_valve import dead_valve, with_dead_valve
from analyzer.loop.cause.fitness import too_thin, unfit_for_cause, unfit_for_settings
from analyzer.loop.cause.stick_slip import refine_stick_slip
from analyzer.loop.cause.verdict import (
    NO_CAUSE,
    Verdict,
    cap_confidence,
    hidden_by_grid,
    judge,
    not_assessed,
    resolve_ambiguity,
    with_worn_valve,
)
from analyzer.loop.cause.worn_valve import WornValve
from analyzer.loop.decisions import Cause, LacksError, MissingData, Requirement, RequirementKind
from analyzer.loop.identification.measure import Measured, measure, ringing_period, time_scale
from analyzer.loop.identification.ringing import same_period
from analyzer.loop.oscillation.aliasing import is_own_period
from analyzer.loop.oscillation.cycling_span import Span, detect_where_it_cycles
from analyzer.loop.oscillation.detection import (
    Oscillation,
    Oscillations,
    counting,
    detect,
    subthreshold_period,
)
from analyzer.loop.oscillation.figures import Assessments, Hour, assess_span, hourly
from analyzer.loop.oscillation.setpoint_moves import Move, moves
from analyzer.loop.page_trends import BUCKETS, FINE_BUCKETS, close_view, thinned
from analyzer.loop.record.judged_stretch import Earlier, Shown, Stretch, as_recorded, judged_stretch, shown
from analyzer.loop.record.quality import Prepared
from analyzer.loop.record.shared_valve import Shared
from analyzer.plantwide.oscillation_lines import OscillationLines, error_lines_of
from identification.controller.free_law import FreeLaw
from identification.controller.gain_pieces import ScheduledGain
from identification.errors import NotAssessedError
from identification.models import Pid
from identification.record import LoopRecord
from identification.signals.correlation import harris_index

NYQUIST = 2.0
"""Samples per period below which a cycle appears as a slower one."""
OF_OP: Mapping[str, Any] = dict.fromkeys(
    ("valve_travel_pct_per_h", "reversals_per_h", "at_limits_pct", "service_pct", "op_mean_pct")
)
"""Figures based on OP, with their values if no OP in percent is recorded."""


@dataclass(frozen=True, slots=True)
class Assessment:
    """Assessment of one loop after one night.

    loop; start_s, duration_s of the record [s]; night, the figures of the whole span; hours, of each clock hour;
    oscillations; verdict; settings, the controller's if they differ from the stated ones; shown, the stated
    controller with further terms found in the record, or the recorded one if none is stated; scheduled_over and law,
    as in Shown; harris index (1: minimum variance) if known; moves of the set point; oscillation_lines, its data for
    the plant-wide analysis; trend, thinned; notes, sentences about the data; needs, the missing data for whether the
    loop oscillates, None if this is known; close_s, first and last time [s] of the last ten periods; for_settings,
    the missing data for new settings regardless of the cause, None if there are none; judged_h, good hours in
    automatic on which oscillations and verdict are based: of the stretch that is judged (judged_stretch.py), whose
    settings are `outdated` if they were changed since; op_scaled and shared as in Prepared.
    """

    loop: str
    start_s: float
    duration_s: float
    night: Assessments
    hours: tuple[Hour, ...]
    oscillations: Oscillations
    verdict: Verdict
    settings: Pid | None = None
    shown: Pid | None = None
    scheduled_over: ScheduledGain | None = None
    law: FreeLaw | None = None
    harris: float | None = None
    moves: tuple[Move, ...] = ()
    oscillation_lines: tuple[OscillationLines, ...] = ()
    trend: Mapping[str, np.ndarray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    needs: Requirement | None = None
    close_s: tuple[float, float] | None = None
    for_settings: Requirement | None = None
    judged_h: float = 0.0
    outdated: bool = False
    op_scaled: bool = True
    shared: Shared | None = None


def unassessable(record: LoopRecord, config: Config) -> Requirement | None:
    """Missing data of the record for an assessment; None if it is sufficient."""
    q = config.quality
    own = ~record.mask("idle")
    if int(own.sum()) < q.samples:
        has = q.samples, int(own.sum())
        if own.all():
            return Requirement(MissingData.SAMPLES, RequirementKind.SAMPLES, has)
        return Requirement(
            MissingData.SAMPLES, RequirementKind.SAMPLES_IN_TURN, (*has, 100 * float(own.mean()))
        )
    share = float(record.usable[own].mean())
    if share >= q.usable_share:
        return None
    manual, bad = float(record.mask("manual").mean()), float(record.bad.mean())
    shares = (100 * q.usable_share, 100 * share, 100 * manual, 100 * bad)
    return Requirement(
        MissingData.AUTOMATIC if manual >= bad else MissingData.SAMPLES, RequirementKind.AUTOMATIC, shares
    )


def cause_of(
    prepared: Prepared, found: Oscillations, controller: Pid | None, config: Config, kind: str
) -> Verdict:
    """The verdict on one loop by itself; undecided if the trends are not sufficient."""
    record, oscillation = prepared.record, counting(found)
    needs, measured = unfit_for_cause(prepared, oscillation, config), None
    if needs is None and float(np.ptp(record.pv)) > 0.0:
        try:
            measured = measure(record, oscillation, controller, config.cause, found.spectrum, kind)
        except NotAssessedError as error:
            needs = Requirement(MissingData.UNBROKEN, RequirementKind.AS_TOLD, (str(error),))
    verdict = NO_CAUSE if oscillation is None else not_assessed(needs)
    if measured is not None:
        period_s = measured.scale_s if oscillation is None else oscillation.period_s
        worn = WornValve(record, measured, period_s, config.cause)
        verdict = verdict_by_measures(measured, prepared, oscillation, config, worn)
        if oscillation is not None:
            others_s = [o.period_s for o in found.found if o is not oscillation]
            verdict = with_worn_valve(refine_stick_slip(verdict, period_s, config), worn, others_s)
    dead = dead_valve(record, config.cause) if prepared.op_known else None
    return with_dead_valve(verdict, dead) if dead and verdict.cause is not Cause.VALVE else verdict


def with_valve_oscillation(
    prepared: Prepared, found: Oscillations, controller: Pid | None, config: Config, kind: str
) -> tuple[Oscillations, Verdict]:
    """Oscillations, those of `found` that count by themselves, and their cause: a cycle that alone is too irregular
    to count does if the identified loop, or its valve, explains it."""
    verdict = cause_of(prepared, found, controller, config, kind)
    quiet = verdict.measured
    if counting(found) is not None or not prepared.op_known or quiet is None:
        return found, verdict
    if quiet.evidence >= config.cause.near_evidence:
        near = detect(prepared.record, config.oscillation.nearly())
        if counting(near) is not None:
            explained = cause_of(prepared, near, controller, config, kind)
            if _made_by_valve(explained, config.cause):
                return near, explained
    period_s = ringing_period(quiet, config.cause)
    if period_s is None:
        return found, verdict
    return _ringing_cycle(prepared, period_s, controller, config, kind) or (found, verdict)


def _ringing_cycle(
    prepared: Prepared, period_s: float, controller: Pid | None, config: Config, kind: str
) -> tuple[Oscillations, Verdict] | None:
    """Oscillations and cause of a loop whose identified model rings at a period [s]; None if the error does not."""
    near, row_s = detect(prepared.record, config.oscillation.nearly(), whole=True), prepared.record.dt_s
    first = counting(near)
    if first is None or not same_period(first.period_s, period_s, row_s, config.cause):
        return None
    verdict = cause_of(prepared, near, controller, config, kind)
    return (near, verdict) if verdict.cause is Cause.TUNING else None


def _made_by_valve(verdict: Verdict, limits: CauseLimits) -> bool:
    """Whether the valve causes a cycle: not dead, and with a stickband that OP crosses."""
    m = verdict.measured
    if verdict.cause is not Cause.VALVE or verdict.dead or m is None:
        return False
    return m.size <= limits.near_size


def verdict_by_measures(
    measured: Measured,
    prepared: Prepared,
    oscillation: Oscillation | None,
    config: Config,
    worn: WornValve | None = None,
) -> Verdict:
    """The verdict from the measures, as far as sampling and grid permit; worn, the question of a worn valve in the
    whole record."""
    if hidden_by_grid(measured, prepared.pv_step, oscillation is not None, config.cause):
        measured = replace(measured, evidence=0.0)
    verdict = judge(measured, oscillation, config.cause, worn)
    return resolve_ambiguity(verdict, prepared, oscillation, config.cause)


def _known_without_op(figures: Assessments, op: bool) -> Assessments:
    """The figures without those based on OP if none is in percent: unknown is empty, never zero."""
    return figures if op else replace(figures, **OF_OP)


def aliasing_requirement(
    record: LoopRecord, found: Oscillations, controller: Pid | None, config: Config
) -> Requirement | None:
    """Required sampling if the loop may cycle too fast for the record; None if not. In such a record
    neither an oscillation nor its absence is evidence. A stated integral time is used only if the record
    shows no other."""
    samples = config.oscillation.samples
    if controller is not None and config.advice.cycle_per_ti * controller.ti_s < samples * record.dt_s:
        scale_s = time_scale(record, counting(found), controller)
        controller = as_recorded(record, controller, scale_s, config.settings)
    if found.first is not None:
        folded = None if controller is None else config.advice.cycle_per_ti * controller.ti_s
        if controller is None or folded is None or folded >= NYQUIST * record.dt_s:
            return None
        if is_own_period(record, found.first.period_s, controller):
            return None
        return Requirement(
            MissingData.FASTER, RequirementKind.UNFOLDED, (folded / samples, record.dt_s, folded)
        )
    period = subthreshold_period(found, config.oscillation)
    if period is None and controller is not None and math.isfinite(controller.ti_s):
        expected = config.advice.cycle_per_ti * controller.ti_s
        period = expected if expected < samples * record.dt_s else None
    if period is None:
        return None
    return Requirement(
        MissingData.FASTER, RequirementKind.OF_A_CYCLE, (period / samples, record.dt_s, period)
    )


@dataclass(frozen=True, slots=True)
class _Judged:
    """Result of a stretch of a record: oscillations of the whole record and of the stretch, their cause, and the
    recorded controller."""

    part: Prepared
    of_all: Oscillations
    found: Oscillations
    verdict: Verdict
    shown: Shown


def _judge_stretch(prepared: Prepared, stretch: Stretch, config: Config, kind: str) -> _Judged:
    """The verdict on the stretch that is judged; a hint only if the data are few."""
    record = prepared.record
    part = replace(prepared, record=record.span(stretch.first, stretch.last))
    of_all, span = detect_where_it_cycles(record, config.oscillation)
    whole, found = len(part.record) == len(record), of_all
    if not whole:
        found, span = detect_where_it_cycles(part.record, config.oscillation)
    stated, seen = stretch.controller, Shown()
    if part.op_known and part.op_scaled and not stretch.outdated:
        scale = time_scale(part.record, counting(found), stated)
        seen = shown(part.record, stated, scale, config.settings)
    acting = _acting(seen, stated)
    found, verdict = judged_where(part, found, span, acting, config, kind)
    thin = None if verdict.identified_between_rows else too_thin(record.dt_s, acting, config)
    if _hours_in(part.record) < config.advice.least_h or thin is not None:
        verdict = cap_confidence(verdict, config.advice.hint_pct)
    return _Judged(part, found if whole else of_all, found, verdict, seen)


def _acting(seen: Shown, stated: Pid | None) -> Pid | None:
    """The controller that acts on a record: the recorded one if it differs from the stated one, otherwise
    the stated one, completed. If none is stated, the recorded one must have integral action, because a
    copy of PV also follows a proportional law."""
    if stated is None and seen.detected is not None and not seen.detected.ki:
        return None
    return seen.other or seen.detected or stated


def judged_where(
    part: Prepared, found: Oscillations, span: Span, controller: Pid | None, config: Config, kind: str
) -> tuple[Oscillations, Verdict]:
    """Oscillations and cause, from the span in which the oscillation is on."""
    if span == (0, len(part.record)):
        return with_valve_oscillation(part, found, controller, config, kind)
    cycling = replace(part, record=part.record.span(*span))
    own = detect(cycling.record, config.oscillation)
    seen, verdict = with_valve_oscillation(cycling, own, controller, config, kind)
    return found if seen is own else seen, verdict


def _hours_in(record: LoopRecord) -> float:
    """Good hours in automatic [h]."""
    return float(record.usable.sum()) * record.dt_s / HOUR_S


def assess(
    prepared: Prepared,
    controller: Pid | None,
    config: Config,
    kind: str = "",
    earlier: Sequence[Earlier] = (),
) -> Assessment:
    """Assess one loop. Raises LacksError, a NotAssessedError, if the record is not sufficient.

    Figures, hours, oscillation lines and trend are of the whole record; oscillations and verdict are of the judged
    stretch. The controller has the stated settings [%, s], those in force at the record's end; kind is the loop's
    type (flow, level, ...), empty if not stated; earlier, settings in force earlier in the record, oldest first.
    """
    lacking = unassessable(prepared.record, config)
    if lacking is not None:
        raise LacksError(lacking)
    if not prepared.op_scaled:  # settings in percent do not apply to such an OP
        controller, earlier = None, [replace(e, controller=None) for e in earlier]
    stretch = judged_stretch(prepared.record, controller, earlier, config)
    return _assessment(prepared, stretch, _judge_stretch(prepared, stretch, config, kind), config)


def _assessment(prepared: Prepared, stretch: Stretch, judged: _Judged, config: Config) -> Assessment:
    """The figures of the whole record and the results of the stretch."""
    record, found = prepared.record, judged.found
    in_percent = prepared.op_known and prepared.op_scaled
    night = _known_without_op(assess_span(record, config.figures), in_percent)
    hours = hourly(record, judged.of_all, config.figures, night.noise_band_pct)
    m, at_fault = judged.verdict.measured, judged.verdict.cause is Cause.VALVE
    dead_time = None if m is None else (m.backlash if at_fault else m.linear).dead_time_s
    close = close_view(judged.part.record, found, stretch.first)
    end_s = record.start_s + record.duration_s
    return Assessment(
        loop=record.tag,
        start_s=record.start_s,
        duration_s=record.duration_s,
        night=night,
        hours=tuple(replace(h, figures=_known_without_op(h.figures, in_percent)) for h in hours),
        oscillations=found,
        verdict=judged.verdict,
        settings=judged.shown.other,
        shown=judged.shown.detected,
        scheduled_over=judged.shown.scheduled_over,
        law=judged.shown.law,
        harris=harris_index(record.error, record.usable, record.dt_s, dead_time) if dead_time else None,
        moves=moves(record, night.noise_band_pct or 0.0, config.figures),
        oscillation_lines=error_lines_of(record.tag, judged.of_all, end_s, config.plant),
        trend=thinned(record, FINE_BUCKETS if counting(found) else BUCKETS, close),
        notes=prepared.notes,
        needs=aliasing_requirement(
            judged.part.record, found, judged.shown.other or stretch.controller, config
        ),
        close_s=None if close is None else (_at(record, close[0]), _at(record, close[1])),
        for_settings=unfit_for_settings(prepared, config),
        judged_h=_hours_in(judged.part.record),
        outdated=stretch.outdated,
        op_scaled=prepared.op_scaled,
        shared=prepared.shared,
    )


def _at(record: LoopRecord, sample: int) -> float:
    """The time of a sample [s]."""
    return record.start_s + sample * record.dt_s
