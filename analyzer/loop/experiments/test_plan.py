"""Prior knowledge of a loop before a step test, and the test for the remaining constants."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analyzer.loop.advice.tune import identified
from analyzer.loop.assess import assess
from analyzer.loop.experiments.found import experiment_results
from analyzer.words import sentences
from analyzer.words.experiments import model_text
from analyzer.words.units import duration, number
from identification.errors import InputError, NotAssessedError
from identification.experiments.columns import Kind
from identification.experiments.model import Pooled
from identification.experiments.plan import Known, Plan, planned
from identification.models import Backlash, Fopdt, Integrator

if TYPE_CHECKING:
    from analyzer.night.nights import PlantLoop

TEXTS = sentences("test_plan")
READ = (
    *(
        "loop",
        "night",
        "gain",
        "time_constant_s",
        "slope_pct_per_s",
        "dead_time_s",
        "backlash_pct",
        "stickband_pct",
    ),
)
"""Columns of a night with the known constants of a loop."""
EXPECTED_RAMP = 10.0
"""Dead times for which an integrator's response is followed; ours: its slope is identified by then."""


def of_experiments(model: Pooled) -> Known:
    """Results of earlier experiments."""
    e = model.estimates
    width = e["backlash_pct"].value if "backlash_pct" in e else 0.0
    dead_s, source = e["dead_time_s"].value, f"experiments: {model_text(model)}"
    if model.kind is Kind.INTEGRATOR:
        lag_s = EXPECTED_RAMP * max(dead_s, 1.0)
        return Known(e["slope_pct_per_s"].value * lag_s, lag_s, dead_s, width, True, source)
    return Known(e["gain"].value, e["lags_s"].value, dead_s, width, source=source)


def of_row(row: Mapping[str, Any]) -> Known | None:
    """Known constants from a night of the store; None if it has no process."""
    width = row["backlash_pct"] or row["stickband_pct"] or 0.0
    dead_s = row["dead_time_s"] or 0.0
    if row["gain"] is not None and row["time_constant_s"] is not None:
        return Known(row["gain"], row["time_constant_s"], dead_s, width, source=f"night {row['night']}")
    if row["slope_pct_per_s"] is None:
        return None
    lag_s = EXPECTED_RAMP * max(dead_s, 1.0)
    return Known(row["slope_pct_per_s"] * lag_s, lag_s, dead_s, width, True, f"night {row['night']}")


def of_night(one: PlantLoop) -> Known | None:
    """Known constants from the loop's own night in routine; None if it gives no process of the right sign."""
    config, controller = one.plant.config, one.controller
    try:
        found = assess(one.prepared, controller, config, one.spec.type, one.earlier)
        process, valve, _ = identified(found, config.advice)
    except (NotAssessedError, ValueError):
        return None
    if controller is not None and process.slope * controller.kp <= 0.0:
        return None
    first, width, dead_s = found.oscillations.first, 0.0, process.dead_time_s
    if valve is not None:
        width = valve.width if isinstance(valve, Backlash) else valve.stickband
    lag_s = process.time_constant_s if isinstance(process, Fopdt) else EXPECTED_RAMP * max(dead_s, 1.0)
    if isinstance(process, Integrator) and first is not None:
        lag_s = first.period_s
    gain = process.slope * lag_s
    return Known(gain, lag_s, dead_s, width, isinstance(process, Integrator), TEXTS["routine"])


def supposed(one: PlantLoop) -> Known:
    """Assumption for a loop without known constants: its lag equals its integral time."""
    controller, record = one.controller, one.record
    lag_s = record.duration_s / 50.0
    if controller is not None and math.isfinite(controller.ti_s) and controller.ti_s > 0.0:
        lag_s = controller.ti_s
    return Known(None, lag_s, 0.0, source=TEXTS["supposed"])


def known_of(one: PlantLoop, store: Path | None) -> Known:
    """Known constants of a loop: from its experiments, from the store's last night, else assumed from its record."""
    from analyzer.store.store import Store

    series = one.plant.trends(one.spec.tags, one.night)
    taught = experiment_results(one.spec, series, one.prepared, one.plant.config)
    if taught is not None and taught.model is not None:
        return of_experiments(taught.model)
    if store is not None:
        opened = Store(store)
        opened.require()
        for night in reversed(opened.nights()):
            rows = opened.own_rows("nights", night, READ, [one.spec.loop])
            found = of_row(rows[0]) if rows else None
            if found is not None:
                return found
    return of_night(one) or supposed(one)


def plan_lines(one: PlantLoop, store: Path | None) -> Iterator[str]:
    """A loop's test in words. Raises InputError if OP is not recorded, or not in percent."""
    prepared, spec = one.prepared, one.spec
    if not prepared.op_known or not prepared.op_scaled:
        raise InputError(
            f"{spec.loop}: no OP in percent of its range", "OP, and its range", "state op, op_lo, op_hi"
        )
    known = known_of(one, store)
    plan = planned(prepared.record, known)
    if not math.isfinite(plan.hold_s):
        raise NotAssessedError(f"{spec.loop}: needs a record in which PV moves")
    scale = prepared.scale
    own = [scale.op_low + 0.01 * scale.op_span * x for x in plan.levels_pct]
    yield f"{spec.loop}: basis of the test: {known.source}"
    yield from _size_lines(plan, known)
    yield TEXTS["levels"].format(" → ".join(number(x) for x in own), spec.op_unit, duration(plan.hold_s))
    yield TEXTS["whole"].format(duration(plan.duration_s))
    yield from _precision_lines(plan, known)


def _size_lines(plan: Plan, known: Known) -> Iterator[str]:
    yield TEXTS["step"].format(number(plan.step_pct))
    yield TEXTS["noise"].format(number(plan.noise_pct), number(plan.wander_pct))
    if known.width_pct > 0.0:
        yield TEXTS["width"].format(number(known.width_pct), number(plan.step_pct / known.width_pct))
    if plan.bounded:
        yield TEXTS["bounded"]
    if plan.answer_pct is None:
        yield TEXTS["no_gain"]
    else:
        most = plan.answer_pct if known.integrating else 2.0 * plan.answer_pct
        yield TEXTS["answer"].format(number(plan.answer_pct), number(most))
    if known.integrating:
        yield TEXTS["integrating"]


def _precision_lines(plan: Plan, known: Known) -> Iterator[str]:
    if plan.gain_within is not None:
        yield TEXTS["gain_within"].format(number(100.0 * plan.gain_within))
    if plan.backlash_within is not None:
        yield TEXTS["play_within"].format(number(known.width_pct), number(100.0 * plan.backlash_within))
    yield TEXTS["why"]
    yield TEXTS["conditions"]
