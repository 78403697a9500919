"""Typing errors in loops.csv (a unit, or a form) that would explain the recorded settings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from analyzer.loops.spec import CHOICES, LoopSpec
from analyzer.loops.tags import controller
from identification.errors import InputError
from identification.models import Form, Pid

WITHIN = 1.3
"""Factor within which settings count as the recorded ones; ours: the resolution of the settings check."""


def _readings(spec: LoopSpec) -> Iterator[tuple[dict[str, str], LoopSpec]]:
    """The row with another unit of time or of gain or another form, smallest changes first."""
    every = product(CHOICES["ti_unit"], CHOICES["gain_unit"], CHOICES["form"])
    own = (spec.ti_unit, spec.gain_unit, str(spec.form))
    for other in sorted(every, key=lambda x: sum(a != b for a, b in zip(x, own, strict=True))):
        changed = {
            name: b for name, a, b in zip(("ti_unit", "gain_unit", "form"), own, other, strict=True) if a != b
        }
        if changed and (spec.td or "form" not in changed or other[2] == Form.PARALLEL):
            yield changed, replace(spec, ti_unit=other[0], gain_unit=other[1], form=Form(other[2]))


def typing_error(spec: LoopSpec, found: Pid, pv_span: float | None) -> dict[str, str]:
    """The columns and new values with which the stated figures agree with the identified settings; empty for none.

    found : in percent and seconds; pv_span : in the PV's own unit.
    """
    for changed, reading in _readings(spec):
        try:
            pid = controller(reading, pv_span, found.gain_share)
        except InputError:  # gain in engineering units without a range
            continue
        if pid is not None and _apart(pid.kp, found.kp) <= WITHIN and _apart(pid.ti_s, found.ti_s) <= WITHIN:
            return changed
    return {}


def _apart(a: float, b: float) -> float:
    """Ratio of two numbers, at least 1; inf if one is zero or the signs differ."""
    if a == b:
        return 1.0
    return max(a / b, b / a) if a * b > 0 and math.isfinite(a) and math.isfinite(b) else math.inf
