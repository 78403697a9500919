"""Which settings were in force at a time: loops.csv with the dates of changes.csv."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
    return spec if row is spec else replace(spec, **{name: getattr(row, name) for name in SETTINGS})


def in_force(spec: LoopSpec, changes: Sequence[TuningChange], at_s: float) -> LoopSpec:
    """A loop with the settings that were in force at a time.

    Those of its row of loops.csv that was valid then, and of the last change before it; before the first change the
    old ones that it states; where neither is known,
    those of loops.csv.

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
