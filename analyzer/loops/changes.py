"""Changes of controllers: read from changes.csv, given on the command line, or seen in a loop's behaviour."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.comparison.block_bootstrap import Floats
from analyzer.config import ChangeLimits
from analyzer.history.encoding import detect_encoding
from analyzer.history.plant_clock import UTC_NAME
from analyzer.history.stamps import parse_times
from identification.errors import InputError

COLUMNS = ("loop", "time", "kp_old", "ti_old", "kp_new", "ti_new", "who")
DAY_S = 86400.0


@dataclass(frozen=True, slots=True)
class TuningChange:
    """New settings of one controller: when [s since 1970-01-01 UTC], from what to what as stated, by whom.

    `seen` says how the change was noticed where nobody stated it; it is then offered, not believed.
    """

    loop: str
    time_s: float
    kp_old: float | None = None
    ti_old: float | None = None
    kp_new: float | None = None
    ti_new: float | None = None
    who: str = ""
    seen: str = ""


def _number(text: str, where: str, column: str) -> float | None:
    if not text.strip():
        return None
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or (column in ("ti_old", "ti_new") and value < 0):
        raise InputError(f"{where}: {column} {text[:40]!r}", "a number or nothing", "correct the cell")
    return value


def read_changes(path: Path, zone: str = UTC_NAME, day_first: bool | None = None) -> tuple[TuningChange, ...]:
    """Read changes.csv: loop and time are required, the settings and `who` are shown where they are given.

    Times that state no zone are of the plant's clock, in `zone`; dates such as 03/04/2026 are read as `day_first`
    says, and refused where it says nothing.

    Raises
    ------
    InputError
        Where the file cannot be opened, holds no change, lacks a column, or a cell is neither time nor
        number.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be opened", "a CSV of changes", "correct --changes") from error
    text = data.decode(detect_encoding(data), errors="replace").lstrip("\ufeff")
    first = text.split("\n", 1)[0]
    if max(map(len, text.split("\n"))) > csv.field_size_limit():
        raise InputError(f"{path}: a line of more than 128 kB", "one row a change", "correct the file")
    reader = csv.DictReader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
    names = {(n or "").strip().lower(): n for n in reader.fieldnames or ()}
    for required in ("loop", "time"):
        if required not in names:
            raise InputError(f"{path}: no column {required!r}", "columns " + ", ".join(COLUMNS), "add it")
    rows = [{k: (row[n] or "") for k, n in names.items() if k in COLUMNS} for row in reader]
    places = [f"{path}, row {i}" for i, row in enumerate(rows, 2) if row["loop"].strip()]
    rows = [row for row in rows if row["loop"].strip()]
    if not rows:
        raise InputError(f"{path}: no changes", "one row a change below the header", "add the changes")
    times = parse_times([row["time"] for row in rows], places, zone, day_first).tolist()
    return tuple(_change(*stated) for stated in zip(rows, places, times, strict=True))


def _change(row: Mapping[str, str], where: str, time_s: float) -> TuningChange:
    kp_old, ti_old, kp_new, ti_new = (_number(row.get(c, ""), where, c) for c in COLUMNS[2:6])
    who = row.get("who", "").strip()
    return TuningChange(row["loop"].strip(), time_s, kp_old, ti_old, kp_new, ti_new, who)


def stated_changes(rows: Sequence[Mapping[str, Any]]) -> list[TuningChange]:
    """Changes of one loop's stated Kp or Ti between nights.

    Parameters
    ----------
    rows : sequence of mapping
        The loop's rows of the nights in their order, with loop, start_s, kp and ti.
    """
    known = [r for r in rows if r["start_s"] is not None and r["kp"] is not None]
    seen = "the settings stated in loops.csv differ from the night before"
    return [
        TuningChange(b["loop"], b["start_s"], a["kp"], a["ti"], b["kp"], b["ti"], seen=seen)
        for a, b in pairwise(known)
        if (a["kp"], a["ti"]) != (b["kp"], b["ti"])
    ]


def _ratio(hours: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Logarithm of travel over variability and the hour's start [s], of the hours where both are known."""
    travel, spread = hours["valve_travel_pct_per_h"], hours["variability_pct"]
    with np.errstate(invalid="ignore"):
        known = np.isfinite(travel) & np.isfinite(spread) & (travel > 0.5) & (spread > 0.01)
    return np.log(travel[known] / spread[known]), hours["hour_s"][known]


def behaviour_change(loop: str, hours: Mapping[str, Floats], limits: ChangeLimits) -> TuningChange | None:
    """The hour at which a loop's controller began to answer differently, or None.

    What a controller does to OP for a given error is its tuning's doing: valve travel over variability is
    steady under changing load and steps when somebody types in new settings. The split that explains most is
    offered where the step is large and clear against how days differ by themselves.
    """
    y, at = _ratio(hours)
    first = np.searchsorted(at, at[0] + limits.least_days * DAY_S) if y.size else 0
    last = np.searchsorted(at, at[-1] - limits.least_days * DAY_S) if y.size else 0
    if last - first < 1:
        return None
    total, n = np.cumsum(y), np.arange(1, y.size + 1)
    split = np.arange(first, last)
    left, right = total[split - 1] / n[split - 1], (total[-1] - total[split - 1]) / (y.size - n[split - 1])
    gained = n[split - 1] * (y.size - n[split - 1]) * (left - right) ** 2
    best = int(np.argmax(gained))
    cut = int(split[best])
    step = abs(float(right[best] - left[best]))
    spread = max(_daily_spread(y[:cut], at[:cut]), _daily_spread(y[cut:], at[cut:]))
    if step < limits.least_step or step < limits.least_ratio * spread:
        return None
    factor = float(np.exp(right[best] - left[best]))
    return TuningChange(
        loop, float(at[cut]), seen=f"OP moves {factor:.2g} times as much for the same error since"
    )


def _daily_spread(y: Floats, at: Floats) -> float:
    """Standard deviation of the daily medians [-]."""
    day = ((at - at[0]) // DAY_S).astype(int)
    medians = [float(np.median(y[day == d])) for d in np.unique(day)]
    return float(np.std(medians, ddof=1)) if len(medians) > 1 else 0.0
