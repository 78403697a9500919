"""Conversion of an export's loop to cases that are explained or held out: parts with one setting each, on one clock,
the most informative stretch, controller and neighbours.

A controller's law, and a limit cycle, belong to their settings; a valve and a process do not. A finding in one part
must be confirmed in the others, or it is not reported.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analyzer.config import AdviceLimits, Config
from analyzer.explain.parts import Part, parts, parts_note
from analyzer.history.series import Series
from analyzer.loop.advice.tune import NEIGHBOURS
from analyzer.loop.assess import judged_where
from analyzer.loop.cause.fitness import at_limits, pv_that_jumps
from analyzer.loop.cause.verdict import NO_CAUSE, Verdict
from analyzer.loop.decisions import Cause, Fault
from analyzer.loop.experiments.found import ExperimentResults, experiment_results
from analyzer.loop.identification.intervals import intervals
from analyzer.loop.identification.measure import time_scale
from analyzer.loop.oscillation.cycling_span import detect_where_it_cycles
from analyzer.loop.oscillation.detection import counting
from analyzer.loop.record.judged_stretch import differing
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loop.record.sample_clock import onto_clock, snapped
from analyzer.loops.changes import in_force
from analyzer.loops.spec import LoopSpec, spec_of
from analyzer.loops.tags import controller
from analyzer.night.nights import Night, Plant, cut
from analyzer.night.opened import guarded
from analyzer.night.request import ALWAYS, ExportRequest
from identification.controller.check import StatedSettings
from identification.errors import InputError, NotAssessedError
from identification.estimation.evidence import trials_between_moves
from identification.mismatch.recording import (
    EXPERIMENT_SAMPLES,
    SAMPLES_A_LAG,
    Recording,
    SeenInCycles,
    coarser_by,
    is_experiment,
)
from identification.record import Floats

WHOLE_SAMPLES = 40000  # Samples up to which a recording is explained whole: 20 s of processor time
STRETCH_SAMPLES = 15000
"""Samples of the most informative stretch of a longer one: as much time, because a long recording contains
more that requires an effect."""
NIGHT_S, LONGER = 86400.0, 1.5
"""Length of a night [s], and of a recording [nights] from which its last night alone is judged: ours: a
day with some hours of the next day is still one recording."""


@dataclass(frozen=True, slots=True)
class Case:
    """One loop of an export, prepared for an explanation: its record, the recording made of it, what was left out,
    and the results of its experiments."""

    spec: LoopSpec
    prepared: Prepared
    recording: Recording
    shortened: str = ""
    learned: ExperimentResults | None = None


def tags_of(spec: LoopSpec, specs: Sequence[LoopSpec]) -> list[str]:
    """Tags for the explanation of a loop: its own, its measured load, and the OPs of some other loops."""
    others = [s.op for s in specs if s.loop != spec.loop and s.op]
    load = [] if spec.load is None else [spec.load]
    return list(dict.fromkeys([*spec.tags, *load, *others[:NEIGHBOURS]]))


def stated_law(spec: LoopSpec, prepared: Prepared, period_s: float, config: Config) -> StatedSettings | None:
    """The stated controller with its integral time in samples; None if it is unknown, no PI controller, or
    one whose schedule changed its gain. It is confirmed if rows are slower than its scan and the record
    shows no other settings.

    period_s : period of the loop's cycle [s], 0 without one.
    """
    pid = controller(spec, prepared.scale.span, prepared.gain_share)
    if pid is None or pid.td_s > 0 or not math.isfinite(pid.ti_s) or prepared.record.gain_share is not None:
        return None
    dt_s = prepared.record.dt_s
    settings = StatedSettings(pid.kp, pid.ti_s / dt_s, dt_s / (spec.scan_s or dt_s))
    if not settings.thinned(config.explain.controller):
        return settings
    scale_s = period_s or time_scale(prepared.record, None, pid)
    return replace(settings, confirmed=differing(prepared.record, pid, scale_s, config.settings) is None)


def neighbour_ops(
    spec: LoopSpec, specs: tuple[LoopSpec, ...], series: Mapping[str, Series], p: Prepared, config: Config
) -> tuple[Floats, ...]:
    """The measured load stated in loops.csv [% of its recorded range], and OPs of the export's other loops, on this
    loop's clock."""
    r = p.record
    clock = r.start_s + r.time_s
    tags = dict.fromkeys([spec.load, *(s.op for s in specs if s.loop != spec.loop)])
    out = []
    for tag in tags:
        if tag and tag in series:
            value, gap = onto_clock(series[tag], clock, r.dt_s, config.quality)
            if not gap.all() and float(np.ptp(value)) > 0:
                out.append(100.0 * (value - value.min()) / np.ptp(value) if tag == spec.load else value)
    return tuple(out)


VALVE_FIGURES = ("backlash_pct", "stickband_pct", "slip_jump_pct")
"""Figures of a faulty valve, by the names of the columns."""


def seen_in_cycles(verdict: Verdict, limits: AdviceLimits) -> SeenInCycles | None:
    """The faulty valve of a night's verdict on this same recording; None if the verdict names none.

    The verdict tests each stretch between two OP reversals separately, so it is valid if friction varies from slip to
    slip; the simulation of the explanation starts from it.
    """
    m = verdict.measured
    if verdict.cause is not Cause.VALVE or m is None:
        return None
    fit = m.stick_slip if verdict.fault is Fault.STICTION and m.stick_slip is not None else m.backlash
    valve = fit.valve.valve
    shown = m.trials or trials_between_moves(fit, m.linear)
    if valve is None or shown is None:
        return None
    cycle_s = 2.0 * m.problem.duration_s / shown.count
    known = intervals(fit, True, limits, m.controller)
    figures = {name: known[name] for name in VALVE_FIGURES if name in known}
    return SeenInCycles(
        fit.process, valve, shown.count, shown.agreeing, cycle_s, m.trials is not None, figures
    )


def verdict_on(spec: LoopSpec, prepared: Prepared, config: Config) -> tuple[Verdict, float]:
    """The verdict on the whole recording as by a night: the cause of its oscillation, or its valve fault; and the
    period of its cycle [s], 0 without one."""
    seen, span = detect_where_it_cycles(prepared.record, config.oscillation)
    stated = controller(spec, prepared.scale.span, prepared.gain_share)
    found, verdict = judged_where(prepared, seen, span, stated, config, spec.type)
    cycle = counting(found)
    if cycle is None:
        return verdict if verdict.cause is Cause.VALVE else NO_CAUSE, 0.0
    return verdict, cycle.period_s


def as_decided(verdict: Verdict, fault: Fault | None) -> Verdict:
    """A verdict on the loop alone with the valve fault as decided by the night, which includes the other loops and
    earlier nights."""
    if verdict.cause is not Cause.VALVE or fault in (None, Fault.UNDECIDED):
        return verdict
    cleared = fault is Fault.NONE
    return replace(verdict, cause=Cause.UNDECIDED if cleared else Cause.VALVE, fault=fault)


def as_given(prepared: Prepared) -> Prepared:
    """A loop that shares a valve. Behind a select its OP is the one that the valve gets, from either
    controller. A half of a split range is without the time in which the other half moves PV."""
    r, shared = prepared.record, prepared.shared
    if shared is None:
        return prepared
    moved = replace(r, bad=r.bad | shared.idle) if shared.valve is None else replace(r, op=shared.valve)
    return replace(prepared, record=moved)


def informative_stretch(prepared: Prepared, most: int | None) -> tuple[Prepared, str]:
    """The stretch with the most OP travel of a recording of more than `most` samples, and a sentence on it."""
    r = prepared.record
    if most is None or len(r) <= most:
        return prepared, ""
    most = min(most, STRETCH_SAMPLES)
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(r.op)))))
    first = int(np.argmax(travel[most - 1 :] - travel[: len(r) - most + 1]))
    days = f"{most * r.dt_s / 86400:.1f} of {len(r) * r.dt_s / 86400:.1f} days"
    note = f"Judged on {most} of {len(r)} samples, the {days} in which OP moves most."
    return replace(prepared, record=r.span(first, first + most)), note


def latest_night(prepared: Prepared) -> Prepared:
    """The last NIGHT_S of a longer record: what a night judges."""
    r = prepared.record
    n = round(NIGHT_S / r.dt_s)
    return prepared if len(r) < LONGER * n else replace(prepared, record=r.span(len(r) - n, len(r)))


def stretch_of_night(prepared: Prepared, verdict: Verdict, most: int) -> tuple[Prepared, str]:
    """The night's part of a recording, and a sentence on it: where it has more than `most` samples, at most
    STRETCH_SAMPLES up to the end of the stretch in which the night fitted a valve fault."""
    night = latest_night(prepared)
    r, m = night.record, verdict.require_measured
    if len(r) > most:
        n, fitted = (
            min(most, STRETCH_SAMPLES),
            m.problem.blocks.first + m.problem.y.size * m.problem.blocks.factor,
        )
        first = min(max(fitted - n, 0), len(r) - n)
        night = replace(night, record=r.span(first, first + n))
    days = f"{len(night.record) * r.dt_s / 86400:.1f} of {prepared.record.duration_s / 86400:.1f} days"
    note = f"Judged on {len(night.record)} of {len(prepared.record)} samples, the {days} in which the night"
    return night, f"{note} identified the valve."


def case(
    spec: LoopSpec,
    specs: tuple[LoopSpec, ...],
    series: dict[str, Series],
    config: Config,
    most: int | None = WHOLE_SAMPLES,
    fault: Fault | None = None,
) -> Case:
    """Prepare one loop; of a recording of more than `most` samples the most informative stretch, None for all;
    fault, the night's valve fault, None if none was assessed.

    Raises
    ------
    NotAssessedError
        PV or OP is missing or never moves.
    """
    raw = series[spec.pv or ""]
    series = snapped(series, spec.pv or "")
    whole = prepare(spec, series, config.quality)
    taught = experiment_results(
        spec, series, whole, config, neighbours=neighbour_ops(spec, specs, series, whole, config)
    )
    known = controller(spec, whole.scale.span) is not None
    coarse = whole if most is None or len(whole.record) <= most else coarser(whole, taught, config, known)
    verdict, period_s = verdict_on(spec, latest_night(whole), config)
    verdict = as_decided(verdict, fault)
    if most is not None and len(coarse.record) > most and coarse is whole and verdict.cause is Cause.VALVE:
        prepared, shortened = stretch_of_night(as_given(whole), verdict, most)
    else:
        prepared, shortened = informative_stretch(as_given(coarse), most)
    if coarse is not whole:
        stated = f"each {coarse.record.dt_s:.3g} s: its experiments need no more."
        shortened = (
            f"Judged at one sample in {round(coarse.record.dt_s / whole.record.dt_s)}, {stated} {shortened}"
        )
    r = prepared.record
    if not prepared.op_known:
        raise NotAssessedError(f"{spec.loop}: needs OP, has none")
    if float(np.ptp(r.op)) == 0 or float(np.ptp(r.pv)) == 0:
        raise NotAssessedError(f"{spec.loop}: needs OP and PV that move, one of them is constant")
    lacks = pv_that_jumps(r, config.explain.recorder) or at_limits(r, config.quality)
    if lacks is not None:
        raise NotAssessedError(f"{spec.loop}: {lacks}")
    stamps = raw.stamp_s[~raw.bad]
    stamps = stamps[(stamps >= r.start_s - r.dt_s) & (stamps <= r.start_s + r.duration_s)]
    others = neighbour_ops(spec, specs, series, prepared, config)
    recording = recording_of(spec, prepared, stamps, (verdict, period_s), others, config)
    factor = coarser_by(recording) if is_experiment(recording) else 1
    if factor == 1:
        return Case(spec, prepared, recording, shortened, taught)
    thin = replace(prepared, record=r.thinned(factor))
    note = (
        f"Judged at one sample in {factor}, each {thin.record.dt_s:.3g} s: its time constant needs no more."
    )
    others = tuple(x[: len(thin.record) * factor : factor] for x in others)
    recording = recording_of(spec, thin, stamps[::factor], (verdict, period_s), others, config)
    return Case(spec, thin, recording, f"{shortened} {note}".strip(), taught)


def coarser(whole: Prepared, taught: ExperimentResults | None, config: Config, known: bool) -> Prepared:
    """A record that is too fast for its experiments, with a larger step, so that none of them is cut; unchanged for
    experiments in automatic with a known controller, which acts between the samples of a coarser record."""
    if taught is None or taught.model is None or (known and taught.model.used[0].experiment.course.closed):
        return whole
    e, record = taught.model.estimates, whole.record
    answer_s = e["dead_time_s"].value + (e["lags_s"].value if "lags_s" in e else 0.0)
    factor = int(answer_s / (SAMPLES_A_LAG * record.dt_s))
    factor = min(factor, len(record) // EXPERIMENT_SAMPLES)
    return whole if factor < 2 else replace(whole, record=record.thinned(factor))


def recording_of(
    spec: LoopSpec,
    prepared: Prepared,
    stamps: Floats,
    night: tuple[Verdict, float],
    others: tuple[Floats, ...],
    config: Config,
) -> Recording:
    """The recording to be explained, from a prepared record, the night's verdict, the period of its cycle [s] and the
    OPs of its neighbours."""
    r, (verdict, period_s) = prepared.record, night
    judged = float(r.usable.mean()) >= config.quality.usable_share  # otherwise mostly an operator moves OP
    return Recording(
        r.sp if judged and not r.sp_estimated else None,
        r.pv,
        r.op,
        ~(r.bad | r.mask("gap")),
        r.dt_s,
        stamps,
        stated_law(spec, prepared, period_s, config) if judged and prepared.shared is None else None,
        not prepared.scale.recorded,
        others,
        spec.type.strip().lower(),
        seen_in_cycles(verdict, config.advice),
        verdict.measured is not None and verdict.cause is not Cause.VALVE,
        period_s,
        config.explain,
    )


def loop_trends(plant: Plant, tag: str) -> tuple[LoopSpec, tuple[LoopSpec, ...], dict[str, Series]]:
    """A loop of an export, all its loops, and the trends for its explanation.

    Raises
    ------
    InputError
        The export has no such loop, no PV of it, or no samples of PV in the requested span.
    """
    specs = plant.specs
    spec = spec_of(specs, tag)
    if spec.pv is None:
        raise InputError(f"{tag}: no PV tag in the export", f"{tag}.PV", "check --loops and the export")
    # without stray stamps, which would stretch a record over centuries
    first, last = plant.export.span(spec.pv)
    whole_span = Night("", first, last + 1.0)
    series = {tag: cut(x, whole_span) for tag, x in plant.trends(tags_of(spec, specs)).items()}
    if series[spec.pv].stamp_s.size == 0:
        raise InputError(f"{tag}: no samples between --since and --until", "a span of the export", "widen it")
    return spec, specs, series


def whole(request: ExportRequest, tag: str) -> tuple[Case, Series]:
    """A loop's case over a whole export, under its last settings, and its PV."""
    spec, specs, series = loop_trends(guarded(request), tag)
    pv = series[spec.pv or ""]
    spec = in_force(spec, request.changes, float(pv.stamp_s[-1]))
    return case(spec, specs, series, request.config, None), pv


def requested_cases(
    request: ExportRequest, plant: Plant, tag: str, held_out: Sequence[Path], fault: Fault | None = None
) -> tuple[Case, dict[str, Case]]:
    """The case to be explained, and those held out by name: parts under other settings, and other exports; plant, the
    opened request; fault as in `case`."""
    spec, specs, series = loop_trends(plant, tag)
    judged = parts(spec, series, request.changes, request.zone)
    cases: list[tuple[Part, Case]] = []
    for part in judged:
        with nullcontext() if len(judged) == 1 else suppress(NotAssessedError):  # OP is constant in it
            most = None if cases else WHOLE_SAMPLES
            cases.append((part, case(part.spec, specs, part.series, request.config, most, fault)))
    if not cases:
        raise NotAssessedError(f"{tag}: needs OP and PV that move in one part of its settings, has none")
    first = cases[0][1]
    first = replace(first, shortened=f"{parts_note([part for part, _ in cases])} {first.shortened}".strip())
    others = {part.name: c for part, c in cases[1:]}
    for path in held_out:
        elsewhere = replace(request, export=(path,), span=ALWAYS)
        others[path.name if path.name not in others else str(path)] = whole(elsewhere, tag)[0]
    return first, others
