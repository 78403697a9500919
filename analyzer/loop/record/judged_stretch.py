"""Stretch of a record for the verdict: in automatic, and under one pair of settings; and the settings.

New settings make another loop of the same process, and a controller in manual makes none: neither is evidence about
the other. If the settings were changed within a record, the part before is no evidence about those in force.

Often settings are changed but lists are not; advice based on last month's settings can double an error. The law that
OP follows is recovered from the night's own SP, PV and OP. If it explains OP far better than the stated one and
differs from it, both are reported and no advice is given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import numpy as np

from analyzer.config import Config, SettingsLimits
from analyzer.history.plant_clock import HOUR_S
from analyzer.loop.record.quality import Prepared
from analyzer.loops.changes import TuningChange, settings_before
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller as stated_controller
from identification.controller.check import runs
from identification.controller.free_law import FreeLaw, free_law
from identification.controller.gain_pieces import ScheduledGain, gain_pieces
from identification.controller.law_comparison import LawsCompared, best_of, compare_laws, scheduled_over
from identification.controller.pid_regression import clamped
from identification.models import Pid
from identification.record import LoopRecord, Mask


@dataclass(frozen=True, slots=True)
class Earlier:
    """Settings in force in a record until a time [s since 1970-01-01 UTC]: the row that states them, and its
    controller, None if it states none."""

    until_s: float
    spec: LoopSpec
    controller: Pid | None


@dataclass(frozen=True, slots=True)
class Stretch:
    """Samples first to last (excluded) of a record, the settings in force there, and whether those in force at the
    record's end are newer, and so are not judged."""

    first: int
    last: int
    controller: Pid | None
    outdated: bool = False


def controller_of(spec: LoopSpec, prepared: Prepared) -> Pid | None:
    """The controller of a row, in percent and seconds, its scan that of the record if none is stated, its gain that
    in force at most of the record."""
    stated = stated_controller(spec, prepared.scale.span, prepared.gain_share)
    if stated is None or spec.scan_s is not None:
        return stated
    return replace(stated, scan_s=prepared.record.dt_s)


def earlier_settings(
    spec: LoopSpec, changes: Sequence[TuningChange], prepared: Prepared
) -> tuple[Earlier, ...]:
    """Settings in force in a record before its last ones, of a loop as loops.csv states it."""
    record = prepared.record
    before = settings_before(spec, changes, record.start_s, record.start_s + record.duration_s)
    return tuple(Earlier(until_s, old, controller_of(old, prepared)) for until_s, old in before)


def _between_runs(out: Mask, first: int, last: int, least: int) -> list[tuple[int, int]]:
    """Stretches of the samples first to last between runs of True in `out` of at least `least`."""
    long = ((first + a, first + b) for a, b in runs(out[first:last]) if b - a >= least)
    edges = [first, *chain.from_iterable(long), last]
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a]


def _in_automatic(record: LoopRecord, first: int, last: int, config: Config) -> tuple[int, int]:
    """The longest stretch between long spans in manual, if it contains most of the time in automatic; else all."""
    least = max(round(config.quality.manual_s / record.dt_s), 1)
    a, b = max(_between_runs(record.mask("manual"), first, last, least), key=lambda ends: ends[1] - ends[0])
    use = record.usable
    most = use[a:b].sum() >= config.quality.automatic_share * use[first:last].sum()
    return (a, b) if most and b - a >= config.quality.samples else (first, last)


def judged_stretch(
    record: LoopRecord, controller: Pid | None, earlier: Sequence[Earlier], config: Config
) -> Stretch:
    """The stretch for the verdict: the part since the last change of settings, in automatic.

    If too few of its samples are good to judge new settings, the part of the record with most good samples. The
    controller is the one in force at the record's end; those before it, oldest first.
    """
    cuts = [round((e.until_s - record.start_s) / record.dt_s) for e in earlier]
    edges = [0, *(min(max(c, 0), len(record)) for c in cuts), len(record)]
    use = record.usable
    good = [int(use[a:b].sum()) for a, b in pairwise(edges)]
    least = max(config.advice.least_h * HOUR_S / record.dt_s, config.quality.samples)
    at = len(good) - 1 if not earlier or good[-1] >= least else int(np.argmax(good))
    settings = [*(e.controller for e in earlier), controller]
    first, last = _in_automatic(record, edges[at], edges[at + 1], config)
    return Stretch(first, last, settings[at], at < len(good) - 1)


def _factor(a: float, b: float) -> float:
    """Ratio of two settings, at least 1; inf if one is zero or the signs differ."""
    if a == b:
        return 1.0
    if not a * b > 0 or math.isinf(a) or math.isinf(b):
        return math.inf
    return max(a / b, b / a)


@dataclass(frozen=True, slots=True)
class Shown:
    """Evidence of a record about its controller, in percent and seconds.

    other, settings that differ from the stated ones, None if they agree or the record is not sufficient; detected,
    the stated ones with the controller's further terms, or the recorded ones if none are stated, None if the record
    shows no more than is stated; scheduled_over, the signal, OP, PV or SP, that schedules the gain, so that the
    stated gain is valid only in a part of its range, None if there is none; law, the record's own law with intervals,
    where it is reported.
    """

    other: Pid | None = None
    detected: Pid | None = None
    scheduled_over: ScheduledGain | None = None
    law: FreeLaw | None = None


def shown(record: LoopRecord, stated: Pid | None, scale_s: float, limits: SettingsLimits) -> Shown:
    """Evidence of a record about its controller, from all of it or from its later half.

    Settings changed within the record appear in its later half, and those are in force. scale_s is the period, or
    another time scale of the loop [s].
    """
    if record.mask("compressed").mean() > limits.straight_share:
        return Shown()
    saturated = record.mask("saturated").mean() > limits.saturated_share
    if stated is None:
        law = recorded(record, scale_s, limits)
        if law is not None and saturated and law.found.td_s:  # at the limits its slope is not seen
            law = None
        return Shown(detected=None if law is None else law.found, law=law)
    if saturated:
        return Shown()
    for part in (record.span(len(record) // 2, len(record)), record):
        seen = compare_laws(part, scale_s, stated)
        if seen is None:
            continue
        if seen.agree:
            forms = other_forms(stated) if stated.scan_s >= record.dt_s else ()
            best = best_of(part, scale_s, (stated, *forms)) if forms else stated
            detected = None if seen.found == stated else seen.found
            return Shown(detected=detected) if best is stated else Shown(best)
        if _plainly(seen, stated, part, limits):
            over = gain_pieces(record, stated) or scheduled_over(part, scale_s, stated)
            if over is not None:
                return Shown(scheduled_over=over)
            return Shown(seen.found, law=recorded(part, scale_s, limits))
        form = _of_another_form(part, stated, scale_s, limits)
        if form is not None:
            return Shown(form)
    return Shown()


def differing(record: LoopRecord, stated: Pid, scale_s: float, limits: SettingsLimits) -> Pid | None:
    """The recorded settings if clearly different from the stated ones; None if they agree or are not identified."""
    return shown(record, stated, scale_s, limits).other


def recorded(record: LoopRecord, scale_s: float, limits: SettingsLimits) -> FreeLaw | None:
    """The law identified in a record, independently of the stated one. None if no law explains nearly all
    of OP, or if its gain differs between parts of a range. None also if its integral time is too short, or
    its filter of PV too long, for the samples."""
    law = free_law(record, scale_s)
    known = limits.explained_alone, limits.ti_samples, limits.filter_of_ti
    return law if law is not None and law.is_clear(record.dt_s, *known) else None


def as_recorded(record: LoopRecord, stated: Pid, scale_s: float, limits: SettingsLimits) -> Pid:
    """The controller whose integral time decides if a record's samples suffice: the recorded one if the record shows
    a law with a gain, however little that differs from the stated one, else the stated one."""
    seen = compare_laws(record, scale_s, stated)
    if seen is None or seen.explained < limits.explained or seen.found.kp == 0.0:
        return stated
    return seen.found


def _of_another_form(record: LoopRecord, stated: Pid, scale_s: float, limits: SettingsLimits) -> Pid | None:
    """The controller with settings stated in another form, series for ideal or the reverse, if the record agrees with
    it; only called if the stated one is rejected."""
    for other in other_forms(stated):
        if _factor(other.kp, stated.kp) >= limits.factor_of_form:
            seen = compare_laws(record, scale_s, other)
            if seen is not None and seen.agree:
                return other
    return None


def other_forms(c: Pid) -> tuple[Pid, ...]:
    """A controller with a derivative if the settings of its series form were read as ideal ones, and if those of its
    ideal form were read as series; the latter if such settings exist."""
    if c.td_s == 0.0 or not c.ki or c.kp == 0.0:
        return ()
    ratio = c.td_s / c.ti_s
    out = [replace(c, kp=c.kp * (1 + ratio), ti_s=c.ti_s + c.td_s, td_s=c.td_s / (1 + ratio))]
    if ratio < 0.25:
        share = 0.5 * (1 + math.sqrt(1 - 4 * ratio))
        out.append(replace(c, kp=c.kp * share, ti_s=c.ti_s * share, td_s=c.td_s / share))
    return tuple(out)


def _plainly(seen: LawsCompared, stated: Pid, record: LoopRecord, limits: SettingsLimits) -> bool:
    """Whether the stated law differs from the one found, and explains clearly less: noise that the recorder adds to
    PV gives the true law a residual of 1/explained times the best one's. If OP may reach a limit of its own, or an
    integral act, between two samples, the law found must explain nearly all of OP."""
    if seen.explained < limits.explained or seen.explained - seen.explained_stated < limits.gain:
        return False
    unseen = limits.judged_ti_samples * record.dt_s
    limited = stated.scan_s < record.dt_s and bool(clamped(record.op).any())
    if seen.found.ti_s < unseen:
        return False
    if (limited or stated.ti_s < unseen) and seen.explained < limits.explained_unseen:
        return False
    factor = _apart(seen.found, stated, record.dt_s, limits.filtered)
    return seen.residual_ratio * seen.explained >= limits.residual_ratio and factor >= limits.factor


def _apart(found: Pid, stated: Pid, dt_s: float, filtered: float) -> float:
    """The largest factor between settings, less the possible effect of a derivative's filter; a slope computed
    between the samples is unknown."""
    factor = max(_factor(found.kp, stated.kp), _factor(found.ti_s, stated.ti_s))
    if max(found.td_s, stated.td_s) == 0.0:
        return factor
    slopes = (pid.kp * max(pid.td_s, dt_s) for pid in (found, stated))
    slope = 1.0 if stated.scan_s < dt_s else _factor(*slopes)
    return max(factor / math.sqrt(filtered), slope / filtered)
