"""A store written directly, so that pages can be tested without an analysis. Its numbers and texts are
synthetic."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from analyzer.columns import HOURS, NIGHTS, row_of
from analyzer.store.store import Store
from analyzer.store.table import rows_table, write_table

NASTY = (
    "<script>alert(1)</script>",
    "a|b`c",
    '=HYPERLINK("http://x.invalid")',
    "../../up",
    "ТИК-1",
    "x" * 300,
)
START_S = 1772409600.0
DAY_S = 86400.0
FIGURES = (
    *("average_absolute_error_pct", "valve_travel_pct_per_h", "reversals_per_h", "variability_pct"),
    *("pv_variability_pct", "crossings_per_h", "noise_band_pct"),
)
LEVELS = {
    "normal_pct": 100.0,
    "at_limits_pct": 0.0,
    "service_pct": 99.0,
    "sp_mean_pct": 50.0,
    "pv_mean_pct": 50.0,
}
LEVELS = {**LEVELS, "op_mean_pct": 45.0, "sp_travel_pct": 0.1, "usable_h": 1.0}


def tags(loops: int) -> list[str]:
    """Names of loops; the first ones contain hostile text."""
    return [*NASTY, *(f"FIC{i:04d}" for i in range(loops))][:loops]


def _night(name: str, day: int, loops: list[str], rng: np.random.Generator) -> list[dict[str, Any]]:
    rows = []
    for i, loop in enumerate(loops):
        cause = ("valve", "tuning", "load", "none")[i % 4] if (i + day) % 7 else "none"
        row: dict[str, Any] = row_of({})
        row.update(
            {"loop": loop, "night": name, "type": "flow", "area": f"Area {i % 3}", "description": loop}
        )
        if i % 11 == 10:
            rows.append({**row, "status": "not assessed", "reason": f"needs a PV <b>, has none of {loop}"})
            continue
        on = cause != "none"
        row.update({k: float(rng.uniform(0.1, 3)) for k in FIGURES}, **LEVELS)
        row.update(status="ok", cause=cause, valve_fault="backlash" if cause == "valve" else "none")
        row.update(oscillation_significance=float(on * rng.uniform(1, 60)), oscillating_pct=95.0 * on)
        row.update({f"osc_{c}_pct": 90.0 * (c == cause) for c in ("valve", "tuning", "load")})
        row.update(period_s=400.0 if on else None, pv_amplitude_pct=2.0 if on else None, kp=0.8, ti=100.0)
        row.update(action="retune" if cause == "valve" else "none", reason=f"cycles; {loop}", usable_h=24.0)
        row.update(start_s=START_S + day * DAY_S, duration_s=DAY_S, notes="PV <b>on</b> a grid")
        if cause == "valve":
            row.update(kp_new=0.8, ti_new=900.0, signs=json.dumps(SIGNS))
        rows.append(row)
    return rows


SIGNS = [{"points_to": "valve", "strength": 0.9, "text": "backlash <i>explains</i> PV"}]


def _hours(name: str, day: int, loops: list[str], rng: np.random.Generator) -> list[dict[str, Any]]:
    return [
        {
            "loop": loop,
            "night": name,
            "hour_s": START_S + day * DAY_S + 3600.0 * h,
            "oscillation_significance": float(rng.uniform(0.9, 1.1)),
            "oscillating_pct": 95.0,
            **{k: float(rng.uniform(0.9, 1.1)) * (0.5 if day >= 7 else 1.0) for k in FIGURES},
            **LEVELS,
        }
        for loop in loops
        for h in range(24)
    ]


def _trends(day: int, loops: list[str], buckets: int, rng: np.random.Generator) -> pa.Table:
    tables = []
    for loop in loops:
        t = START_S + day * DAY_S + DAY_S / buckets * np.arange(buckets)
        pv = 50 + 2 * np.sin(2 * np.pi * t / 400) + 0.1 * rng.normal(size=buckets)
        op = 45 + 3 * np.cos(2 * np.pi * t / 400) + 0.1 * rng.normal(size=buckets)
        columns = {"loop": pa.array([loop] * buckets).dictionary_encode(), "time_s": t}
        for name, x in (("sp", np.full(buckets, 50.0)), ("pv", pv), ("op", op)):
            columns[f"{name}_min"] = (x - 0.2 * (name != "sp")).astype(np.float32)
            columns[f"{name}_max"] = (x + 0.2 * (name != "sp")).astype(np.float32)
        tables.append(pa.table({**columns, "bad": np.arange(buckets) % 500 == 499}))
    return pa.concat_tables(tables).unify_dictionaries()


def small_store(
    path: Path, loops: int = 30, nights: int = 14, buckets: int = 1200, hours: bool = True
) -> Store:
    """Write a store of synthetic results. From the eighth night on, every figure except the oscillation is
    halved."""
    rng = np.random.default_rng(0)
    names = tags(loops)
    for day in range(nights):
        name = f"2026-03-{2 + day:02d}"
        rows = _night(name, day, names, rng)
        if hours:
            held = _hours(name, day, names, rng)
            write_table(rows_table(held, HOURS), path / "hours" / f"{name}.parquet")
        write_table(_trends(day, names[:60], buckets, rng), path / "trends" / f"{name}.parquet")
        write_table(rows_table(rows, NIGHTS), path / "nights" / f"{name}.parquet")
    return Store(path)
