"""Part of a record in which a loop cycles: quiet hours do not reduce the regularity of a cycle.

A day's spectrum mixes a cycle with the hours in which it is off, and its band is then no more regular than noise. So
a band that is loud in a part of the record and quiet in the rest is judged in that part, and its share of the time is
that of the whole record. Cause and model are of that part too.
"""

from __future__ import annotations

import math
from dataclasses import replace

from analyzer.config import OscillationLimits
from analyzer.loop.decisions import counts
from analyzer.loop.oscillation.detection import Oscillation, Oscillations, active_samples, detect, peaks
from identification.controller.check import runs
from identification.record import LoopRecord, Mask
from identification.signals.spectrum import envelope

Span = tuple[int, int]
"""First and last (excluded) sample of a part of a record."""


def detect_where_it_cycles(record: LoopRecord, limits: OscillationLimits) -> tuple[Oscillations, Span]:
    """The oscillations of a record with their share of all its time, and the part of it in which the first one is on:
    the whole record if it is on for most of it, or if there is none."""
    found, whole = detect(record, limits), (0, len(record))
    first, s = found.first, found.spectrum
    if first is not None and first.oscillating_pct >= limits.mostly_pct:
        return found, whole
    if first is not None and found.active is not None:
        span = _longest(found.active, found.active_dt_s, first.period_s, record)
        inside = None if span is None else _inside(record, span, first.period_s, limits)
        return found, whole if inside is None or span is None else span
    if s is None or found.bands is None or not s.variance > 0.0:
        return found, whole
    for k in peaks(found.bands, limits.shape_prominence):
        line = float(found.bands.line[k])
        period_s = s.duration_s / line
        level, dt_s = envelope(s, line)
        usable = record.at_work[len(record) - s.n :]
        active, _, smooth = active_samples(level, dt_s, s.dt_s, period_s, usable, limits)
        span = _longest(active, dt_s, period_s, record)
        inside = None if span is None else _inside(record, span, period_s, limits)
        if inside is not None and counts(share := 100.0 * float(active.mean())):
            own = replace(inside, oscillating_pct=share)
            return replace(found, found=(own,), active=active, level=smooth, active_dt_s=dt_s), span or whole
    return found, whole


def _longest(active: Mask, dt_s: float, period_s: float, record: LoopRecord) -> Span | None:
    """The longest run of samples in which a band is loud, gaps up to two periods allowed; None if it is never
    loud."""
    short = round(2.0 * period_s / dt_s)
    bridged = active.copy()
    for first, last in runs(~active):
        if last - first <= short and first > 0 and last < active.size:
            bridged[first:last] = True
    found = max(runs(bridged), key=lambda r: r[1] - r[0], default=(0, 0))
    skipped = len(record) * record.dt_s - active.size * dt_s
    first, last = (round((skipped + k * dt_s) / record.dt_s) for k in found)
    return (max(first, 0), min(last, len(record))) if last > first else None


def _inside(record: LoopRecord, span: Span, period_s: float, limits: OscillationLimits) -> Oscillation | None:
    """The oscillation at a period in a part of a record with enough cycles of it."""
    long_s = (span[1] - span[0]) * record.dt_s
    if long_s < limits.span_periods * period_s or long_s > 0.01 * limits.mostly_pct * record.duration_s:
        return None
    first = detect(record.span(*span), limits).first
    if first is None or abs(math.log(first.period_s / period_s)) > math.log(limits.span_period):
        return None
    return first
