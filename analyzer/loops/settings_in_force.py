"""Which settings were in force at a time: loops.csv with the dates of changes.csv."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from zoneinfo import ZoneInfo

from analyzer.loops.changes import TuningChange
from analyzer.loops.spec import LoopSpec

SETTINGS = ("kp", "ti", "td", "form", "gain_unit", "ti_unit", "scan_s")
"""What a dated row of loops.csv changes; tags, ranges and texts are those of the last row."""


def _dated(spec: LoopSpec, at_s: float) -> LoopSpec:
    """A loop with the settings of the last of its rows that was valid at a time, of the first where none was."""
    if not spec.earlier:
        return spec
    valid = [s for s in (*spec.earlier, spec) if s.valid_from_s is None or s.valid_from_s <= at_s]
    row = valid[-1] if valid else spec.earlier[0]
    return (
        spec
        if row is spec
        else replace(spec, valid_from_s=row.valid_from_s, **{name: getattr(row, name) for name in SETTINGS})
    )


def in_force(spec: LoopSpec, changes: Sequence[TuningChange], at_s: float) -> LoopSpec:
    """A loop with the settings that were in force at a time.

    Those of its row of loops.csv that was valid then, and of the last change before it; before the first change the
    old ones that it states; where neither is known, those of loops.csv.

    Parameters
    ----------
    spec : LoopSpec
    changes : sequence of TuningChange
        Of any loops, in any order.
    at_s : float
        [s since 1970-01-01 UTC].
    """
    spec = _dated(spec, at_s)
    own = sorted((c for c in changes if c.loop == spec.loop), key=lambda c: c.time_s)
    kp, ti = spec.kp, spec.ti
    earlier = [c for c in own if c.time_s <= at_s]
    later = [c for c in own if c.time_s > at_s]
    for kind in ("kp", "ti"):
        known = [getattr(c, f"{kind}_new") for c in earlier if getattr(c, f"{kind}_new") is not None]
        old = [getattr(c, f"{kind}_old") for c in later if getattr(c, f"{kind}_old") is not None]
        value = known[-1] if known else old[0] if old else None
        if value is not None and kind == "kp":
            kp = value
        elif value is not None:
            ti = value
    return spec if (kp, ti) == (spec.kp, spec.ti) else replace(spec, kp=kp, ti=ti)


def settings_before(
    spec: LoopSpec, changes: Sequence[TuningChange], first_s: float, last_s: float
) -> tuple[tuple[float, LoopSpec], ...]:
    """What was in force within a span before its last settings: until when [s], and the loop with them, oldest first.

    Parameters
    ----------
    spec : LoopSpec
        The loop as loops.csv states it.
    changes : sequence of TuningChange
    first_s, last_s : float
        Ends of the span [s since 1970-01-01 UTC].
    """
    dated = [s.valid_from_s for s in (*spec.earlier, spec) if s.valid_from_s is not None]
    times = {*dated, *(c.time_s for c in changes if c.loop == spec.loop)}
    inside = sorted(t for t in times if first_s < t < last_s)
    before = [in_force(spec, changes, t) for t in (first_s, *inside)]
    return tuple(
        (t, old)
        for t, old, new in zip(inside, before[:-1], before[1:], strict=True)
        if any(getattr(old, name) != getattr(new, name) for name in SETTINGS)
    )


def settings_from(spec: LoopSpec, changes: Sequence[TuningChange], at_s: float, zone: str) -> str:
    """Where the settings in force at a time stand, with the date from which they hold; '' where none are stated.

    Parameters
    ----------
    spec : LoopSpec
        The loop as loops.csv states it.
    changes : sequence of TuningChange
    at_s : float
        [s since 1970-01-01 UTC].
    zone : str
        Of the plant.
    """
    now = in_force(spec, changes, at_s)
    if now.kp is None and now.ti is None:
        return ""
    dated = _dated(spec, at_s)
    own = sorted(c.time_s for c in changes if c.loop == spec.loop)
    before = [t for t in own if t <= at_s]
    if (now.kp, now.ti) != (dated.kp, dated.ti) and not before:
        return f"changes.csv, before {_day(own[0], zone)}"
    if before and _tells(changes, spec.loop, before[-1]):
        return f"changes.csv, from {_day(before[-1], zone)}"
    since = dated.valid_from_s if spec.earlier else None
    return "loops.csv" if since is None else f"loops.csv, from {_day(since, zone)}"


def _tells(changes: Sequence[TuningChange], loop: str, time_s: float) -> bool:
    """Whether a change says what was typed in."""
    last = [c for c in changes if c.loop == loop and c.time_s == time_s]
    return any(c.kp_new is not None or c.ti_new is not None for c in last)


def _day(time_s: float, zone: str) -> str:
    return datetime.fromtimestamp(time_s, ZoneInfo(zone)).strftime("%Y-%m-%d")
