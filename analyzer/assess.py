"""One loop, one night: from a prepared record to everything that is known about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from analyzer.assessments import Assessments, Hour, assess_span, hourly, settling_time, usable
from analyzer.cause import NO_CAUSE, Verdict, dead_valve, judge, not_assessed, with_dead_valve
from analyzer.config import Config
from analyzer.measure import measure
from analyzer.oscillation import Oscillation, Oscillations, detect
from analyzer.plantwide import Fingerprint, fingerprint
from analyzer.quality import Prepared, has_op
from analyzer.trends import BUCKETS, FINE_BUCKETS, thinned
from identification.errors import NotAssessedError
from identification.harris import harris_index
from identification.models import Pid
from identification.record import LoopRecord


@dataclass(frozen=True, slots=True)
class Assessment:
    """What is known about one loop after one night.

    loop; start_s, duration_s of the record [s]; night, the figures of the whole span; hours, of each clock
    hour; oscillations; verdict; harris index (1: minimum variance) and settling time [s] where known; print,
    its fingerprint for the plant-wide pass; trend, thinned; notes, plain sentences about the data.
    """

    loop: str
    start_s: float
    duration_s: float
    night: Assessments
    hours: tuple[Hour, ...]
    oscillations: Oscillations
    verdict: Verdict
    harris: float | None = None
    settling_s: float | None = None
    print: Fingerprint | None = None
    trend: Mapping[str, np.ndarray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def assessable(record: LoopRecord, config: Config) -> None:
    """Raise NotAssessedError where the record cannot support an assessment; the text says what it needs."""
    q = config.quality
    share = float(usable(record).mean())
    if len(record) < q.samples:
        raise NotAssessedError(f"needs {q.samples} samples, has {len(record)}")
    if share < q.usable_share:
        manual, bad = float(record.mask("manual").mean()), float(record.bad.mean())
        raise NotAssessedError(
            f"needs {100 * q.usable_share:.0f} % good samples in automatic, has {100 * share:.0f} % "
            f"(manual {100 * manual:.0f} %, gaps and stale {100 * bad:.0f} %)"
        )


def _counting(found: Oscillations, config: Config) -> Oscillation | None:
    first = found.first
    return first if first is not None and first.oscillating_pct >= config.oscillation.counts_pct else None


def unfit_for_cause(prepared: Prepared, config: Config) -> str:
    """Why no cause can be told from these trends; empty where it can."""
    record, q = prepared.record, config.quality
    if not has_op(prepared):
        return "needs OP, which is not recorded"
    if float(np.ptp(record.op)) == 0.0:
        return "needs OP that moves, it stands still"
    if prepared.compressed_share > q.straight_share:
        return f"needs trends without compression, {100 * prepared.compressed_share:.0f} % lie on straight segments"
    saturated = float(record.mask("saturated").mean())
    if saturated > q.saturated_share:
        return f"needs OP within its limits, it is at one for {100 * saturated:.0f} % of the time"
    return ""


def cause_of(
    prepared: Prepared, found: Oscillations, controller: Pid | None, config: Config, kind: str
) -> Verdict:
    """The verdict on one loop by itself; abstains where the trends cannot tell."""
    record, oscillation = prepared.record, _counting(found, config)
    dead = dead_valve(record, config.cause) if has_op(prepared) else None
    needs = unfit_for_cause(prepared, config)
    if needs or float(np.ptp(record.pv)) == 0.0:
        verdict = not_assessed(needs) if oscillation is not None else NO_CAUSE
        return with_dead_valve(verdict, dead) if dead else verdict
    measured = measure(record, oscillation, controller, config.cause, found.spectrum, kind)
    verdict = judge(measured, oscillation, config.cause)
    return with_dead_valve(verdict, dead) if dead and verdict.cause != "valve" else verdict


def _dead_time(verdict: Verdict) -> float | None:
    m = verdict.measured
    return None if m is None else (m.play if verdict.cause == "valve" else m.linear).dead_time_s


def assess(prepared: Prepared, controller: Pid | None, config: Config, kind: str = "") -> Assessment:
    """Assess one loop.

    Parameters
    ----------
    prepared : Prepared
        The record on one clock, with masks.
    controller : Pid or None
        The stated settings in percent and seconds.
    config : Config
    kind : str
        The loop's type (flow, level, ...), empty where not stated.

    Raises
    ------
    NotAssessedError
        Where the record cannot support it.
    """
    record = prepared.record
    assessable(record, config)
    found = detect(record, config.oscillation)
    verdict = cause_of(prepared, found, controller, config, kind)
    dead_time = _dead_time(verdict)
    night = assess_span(record)
    harris = harris_index(record.error, usable(record), record.dt_s, dead_time) if dead_time else None
    first, s = _counting(found, config), found.spectrum
    return Assessment(
        record.tag,
        record.start_s,
        record.duration_s,
        night,
        tuple(hourly(record, found)),
        found,
        verdict,
        harris,
        settling_time(record, night.noise_band_pct or 0.0),
        fingerprint(record.tag, first.period_s, record.start_s, s) if first and s else None,
        thinned(record, FINE_BUCKETS if first else BUCKETS),
        prepared.notes,
    )
