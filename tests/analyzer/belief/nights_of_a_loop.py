"""Rows of one loop night by night, for the tests of beliefs."""

from __future__ import annotations

import json
from datetime import date, timedelta
from typing import Any

import numpy as np

from analyzer.belief.belief import Belief, step
from analyzer.belief.nights import READ
from analyzer.config import Config
from identification.estimation.backlash_stiction import WIDTHS

CONFIG = Config()
LIMITS = CONFIG.belief
FIRST, DAY_S = date(2026, 3, 2), 86400.0
CALM: dict[str, Any] = {"cause": "none", "valve_fault": "none", "action": "none", "oscillating_pct": 0.0}
WORN: dict[str, Any] = {
    **{"cause": "valve", "valve_fault": "backlash", "action": "retune", "kp_new": 0.8, "ti_new": 400.0},
    **{"osc_valve_pct": 90.0, "osc_tuning_pct": 5.0, "osc_load_pct": 5.0, "advice": "slower"},
}
LOAD: dict[str, Any] = {
    **{"cause": "load", "valve_fault": "none", "action": "none"},
    **{"osc_valve_pct": 10.0, "osc_tuning_pct": 10.0, "osc_load_pct": 80.0},
}


def witness(width: float, evidence: float, against: float = 100.0, deviation: float = 0.05) -> str:
    """Evidence of one night for backlash [nat]: highest at its width [% OP], lower at neighbouring widths, and
    `against` [nat] against much wider ones.
    """
    off = np.abs(np.log(WIDTHS / width))
    profile = np.where(1.6 * width < WIDTHS, -against, evidence * np.maximum(1.0 - off, 0.0))
    stated_part = {
        "profile": profile.round(1).tolist(),
        "needed": 10.0,
        "op_range": 2 * width,
        "jump": [0.0, 5.0],
    }
    return json.dumps({**stated_part, "width": [width, deviation]} if evidence > 0 else stated_part)


def no_fault(against: float = 100.0) -> str:
    """Evidence of one night of a valve without fault: zero at small widths, `against` [nat] against each width that
    would be visible.
    """
    profile = np.where(WIDTHS > 0.3, -against, 0.0)
    return json.dumps({"profile": profile.tolist(), "needed": 10.0, "op_range": 2.0, "jump": [0.0, 0.0]})


def row(night: int, *given: dict[str, Any], **more: Any) -> dict[str, Any]:
    """The row of a night, counted from 0; the loop oscillates unless the given values state otherwise."""
    start_s = 1_772_409_600.0 + DAY_S * night
    usual = {
        "oscillating_pct": 95.0,
        "oscillation_significance": 20.0,
        "period_s": 300.0,
        "reason": "own words",
    }
    stated = {"loop": "L", "night": (FIRST + timedelta(days=night)).isoformat(), "status": "ok"}
    out = {
        **dict.fromkeys(READ),
        **stated,
        "start_s": start_s,
        "duration_s": DAY_S,
        "kp": 1.0,
        "ti": 100.0,
        **usual,
    }
    for part in given:
        out |= part
    return out | more


def followed(rows: list[dict[str, Any]], repaired_s: tuple[float, ...] = ()) -> list[Belief]:
    """The beliefs after each night."""
    now, out = None, []
    for r in rows:
        now = step(now, r, repaired_s, CONFIG)
        assert now is not None
        out.append(now)
    return out
