"""Changes of controllers, from changes.csv, from the command line, or detected in a loop's behaviour; and the
settings in force at a time, from them and from the dates of loops.csv."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.history.plant_clock import DAY_S, UTC_NAME, date_of
from analyzer.history.stamps import parse_times
from analyzer.loops.spec import LoopSpec, csv_table
from identification.errors import InputError
from identification.record import Floats

TIMES = ("ti_old", "ti_new")
COLUMNS = ("loop", "time", "kp_old", "ti_old", "kp_new", "ti_new", "who")
SETTINGS = (
    *(
        "kp",
        "ti",
        "td",
        "form",
        "gain_unit",
        "ti_unit",
        "scan_s",
        "gap",
        "gap_gain",
        "error_form",
        "pv_filter_s",
    ),
    *("op_rate", "op_lo_limit", "op_hi_limit", "sp_weight", "td_filter", "gain_schedule"),
)
"""Columns that a dated row of loops.csv changes; tags, ranges and texts are those of the last row."""


@dataclass(frozen=True, slots=True)
class TuningChange:
    """New settings of one controller: when [s since 1970-01-01 UTC], from what to what as stated, by whom.

    `seen` describes how an unstated change was detected; it is then only proposed.
    """

    loop: str
    time_s: float
    kp_old: float | None = None
    ti_old: float | None = None
    kp_new: float | None = None
    ti_new: float | None = None
    who: str = ""
    seen: str = ""


def read_changes(path: Path, zone: str = UTC_NAME, day_first: bool | None = None) -> tuple[TuningChange, ...]:
    """Read changes.csv: loop and time are required, the settings and `who` are optional.

    Times without a stated zone are on the plant's clock, in `zone`; dates such as 03/04/2026 are read according to
    `day_first`, and rejected if it is None.

    Raises
    ------
    InputError
        The file cannot be opened, contains no change, lacks a column, or a cell is neither time nor number.
    """
    header, rows = csv_table(path, "change")
    for required in ("loop", "time"):
        if required not in header:
            raise InputError(f"{path}: no column {required!r}", "columns " + ", ".join(COLUMNS), "add it")
    rows = [(row, cells) for row, cells in rows if cells.get("loop")]
    if not rows:
        raise InputError(f"{path}: no changes", "one row a change below the header", "add the changes")
    places = [f"{path}, row {row}" for row, _ in rows]
    times = parse_times([cells.get("time", "") for _, cells in rows], places, zone, day_first).tolist()
    return tuple(
        TuningChange(cells["loop"], time_s, **_settings(cells, place), who=cells.get("who", ""))
        for (_, cells), place, time_s in zip(rows, places, times, strict=True)
    )


def _settings(cells: Mapping[str, str], where: str) -> dict[str, Any]:
    """Old and new settings of a row, if given."""
    found: dict[str, Any] = {}
    for column, text in ((c, cells[c]) for c in COLUMNS[2:6] if cells.get(c)):
        try:
            found[column] = float(text.replace(",", "."))
        except ValueError:
            found[column] = math.nan
        if not math.isfinite(found[column]) or (column in TIMES and found[column] < 0):
            raise InputError(f"{where}: {column} {text[:40]!r}", "a number or nothing", "correct the cell")
    return found


def stated_changes(rows: Sequence[Mapping[str, Any]]) -> list[TuningChange]:
    """Changes of one loop's stated Kp or Ti between nights.

    Parameters
    ----------
    rows : sequence of mapping
        The loop's rows of the nights in their order, with loop, start_s, settings_changed_s (None without a change
        within the night; the change is then at its start), kp and ti.
    """
    known = [r for r in rows if r["start_s"] is not None and r["kp"] is not None]
    seen = "the settings stated in loops.csv differ from the night before"
    return [
        TuningChange(
            b["loop"], b["settings_changed_s"] or b["start_s"], a["kp"], a["ti"], b["kp"], b["ti"], seen=seen
        )
        for a, b in pairwise(known)
        if (a["kp"], a["ti"]) != (b["kp"], b["ti"])
    ]


def behaviour_change(loop: str, hours: Mapping[str, Floats], config: Config) -> TuningChange | None:
    """The hour at which the response of a loop's controller changed, or None.

    The motion of OP for a given error depends on the tuning: valve travel over variability is constant under changing
    load and steps when settings are changed. The best split is proposed if the step is large and clear compared with
    the variation between days.
    """
    limits, least_s = config.changes, config.before_after.least_days * DAY_S
    travel, spread = hours["valve_travel_pct_per_h"], hours["variability_pct"]
    known = (travel > 0.5) & (spread > 0.01) & np.isfinite(travel) & np.isfinite(spread)
    y, at = np.log(travel[known] / spread[known]), hours["hour_s"][known]
    if y.size == 0:
        return None
    split = np.arange(*np.searchsorted(at, [at[0] + least_s, at[-1] - least_s]))
    if split.size == 0:
        return None
    total, n = np.cumsum(y), np.arange(1, y.size + 1)
    left, right = total[split - 1] / n[split - 1], (total[-1] - total[split - 1]) / (y.size - n[split - 1])
    gained = n[split - 1] * (y.size - n[split - 1]) * (left - right) ** 2
    best = int(np.argmax(gained))
    cut, step = int(split[best]), float(right[best] - left[best])
    spread_of_days = max(_daily_spread(y[:cut], at[:cut]), _daily_spread(y[cut:], at[cut:]))
    if abs(step) < limits.least_step or abs(step) < limits.least_ratio * spread_of_days:
        return None
    seen = f"OP moves {float(np.exp(step)):.2g} times as much for the same error since"
    return TuningChange(loop, float(at[cut]), seen=seen)


def _daily_spread(y: Floats, at: Floats) -> float:
    """Standard deviation of the daily medians [-]."""
    day = (at - at[0]) // DAY_S
    medians = [float(np.median(y[day == d])) for d in np.unique(day)]
    return float(np.std(medians, ddof=1)) if len(medians) > 1 else 0.0


def _valid_at(spec: LoopSpec, at_s: float) -> LoopSpec:
    """A loop with the settings of its last row valid at a time, or of the first row."""
    if not spec.earlier:
        return spec
    valid = [s for s in (*spec.earlier, spec) if s.valid_from_s is None or s.valid_from_s <= at_s]
    row = valid[-1] if valid else spec.earlier[0]
    if row is spec:
        return spec
    return replace(spec, valid_from_s=row.valid_from_s, **{name: getattr(row, name) for name in SETTINGS})


def in_force(spec: LoopSpec, changes: Sequence[TuningChange], at_s: float) -> LoopSpec:
    """A loop with the settings in force at a time [s since 1970-01-01 UTC], after changes of any loops.

    They are those of its row of loops.csv valid then, and of the last change before; before the first change the old
    ones stated in it; if neither is known, those of loops.csv.
    """
    spec = _valid_at(spec, at_s)
    own = sorted((c for c in changes if c.loop == spec.loop), key=lambda c: c.time_s)
    changed = {}
    for kind in ("kp", "ti"):
        new = [getattr(c, f"{kind}_new") for c in own if c.time_s <= at_s]
        old = [getattr(c, f"{kind}_old") for c in own if c.time_s > at_s]
        value = next((v for v in (*reversed(new), *old) if v is not None), None)
        if value is not None and value != getattr(spec, kind):
            changed[kind] = value
    return replace(spec, **changed) if changed else spec


def settings_before(
    spec: LoopSpec, changes: Sequence[TuningChange], first_s: float, last_s: float
) -> tuple[tuple[float, LoopSpec], ...]:
    """Settings in force within a span before its last ones: their end [s], and the loop with them, oldest first.

    `spec` is as in loops.csv, the ends of the span are in s since 1970-01-01 UTC.
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
    """Source of the settings in force at a time, with the date from which they are valid; '' if none are stated.

    `spec` is as in loops.csv, the date is the plant's.
    """
    now = in_force(spec, changes, at_s)
    if now.kp is None and now.ti is None:
        return ""
    dated = _valid_at(spec, at_s)
    own = sorted((c for c in changes if c.loop == spec.loop), key=lambda c: c.time_s)
    last_s = max((c.time_s for c in own if c.time_s <= at_s), default=None)
    if (now.kp, now.ti) != (dated.kp, dated.ti) and last_s is None:
        return f"changes.csv, before {date_of(own[0].time_s, zone)}"
    typed_in = [c for c in own if c.time_s == last_s and (c.kp_new is not None or c.ti_new is not None)]
    if typed_in:
        return f"changes.csv, from {date_of(typed_in[0].time_s, zone)}"
    since = dated.valid_from_s if spec.earlier else None
    return "loops.csv" if since is None else f"loops.csv, from {date_of(since, zone)}"
