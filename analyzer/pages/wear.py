"""Money and wear, only from numbers that the plant itself states in loops.csv."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from analyzer.comparison.before_after import Change, LoopComparison, Verdict
from analyzer.pages.words import number

HOURS_A_YEAR = 8760.0
LIFE = "valve_life_travel_pct"
COST = "cost_per_error_pct_h"
UNIT = "cost_unit"


def _stated(row: Mapping[str, Any], name: str) -> float | None:
    """A number of the plant: a column of the night, or of its JSON of the plant's own columns."""
    extra = row.get("extra")
    held = {**(json.loads(extra) if extra else {}), **{k: v for k, v in row.items() if v is not None}}
    try:
        value = float(held[name])
    except (KeyError, TypeError, ValueError):
        return None
    return value if math.isfinite(value) and value > 0 else None


def _change(found: LoopComparison, name: str) -> Change | None:
    known = [c for c in found.changes if c.measure.name == name and c.verdict is not Verdict.INCOMPARABLE]
    return known[0] if known else None


def wear_texts(found: LoopComparison, row: Mapping[str, Any]) -> tuple[str, ...]:
    """What the change means in valve life and in the plant's own cost of error; empty where no number is
    stated.

    valve_life_travel_pct : travel after which a valve is overhauled [% of stroke, summed]
    cost_per_error_pct_h : what one percent of average absolute error costs an hour [cost_unit]
    """
    texts = []
    travel, life = _change(found, "valve_travel_pct_per_h"), _stated(row, LIFE)
    if travel is not None and life is not None and travel.verdict is not Verdict.UNCLEAR:
        a, b = (life / max(v, 1e-9) / HOURS_A_YEAR for v in (travel.found.before, travel.found.after))
        texts.append(f"Valve life at this travel: {number(a)} years before, {number(b)} years after.")
    error, cost = _change(found, "average_absolute_error_pct"), _stated(row, COST)
    if error is not None and cost is not None and error.verdict is not Verdict.UNCLEAR:
        unit = json.loads(row.get("extra") or "{}").get(UNIT, "") or "units of cost"
        low, high = (-error.found.high * cost * HOURS_A_YEAR, -error.found.low * cost * HOURS_A_YEAR)
        texts.append(
            f"Saved by the smaller error: {number(low)} to {number(high)} {unit} a year at the stated cost."
        )
    return tuple(texts)
