"""The experiments of a night on a loop's page: each with its span, PV, simulated PV, and constants."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from analyzer.history.plant_clock import stamp
from analyzer.pages import words
from analyzer.pages.words import Row, number
from reports import pages as parts

Kept = Mapping[str, Any]
"""An experiment as stored (analyzer/loop/experiments/found.py)."""


def experiments_section(row: Row) -> parts.Section | None:
    """Results of experiments in the night, None if there were none."""
    found = json.loads(row.get("experiments") or "[]")
    if not found:
        return None
    zone = row.get("timezone") or "UTC"
    spans = tuple((_when(x, zone), _what(x)) for x in found)
    drawn = [p for at, x in enumerate(found) if "pv" in x for p in _pictures(at, x, words.pv_scale_of(row))]
    constants = [parts.Facts(tuple(_constants(x))) for x in found if "constants" in x]
    text = parts.Text((row["experiment"] + ".",), "lead") if row.get("experiment") else None
    return parts.section("Experiments", text, parts.Facts(spans), *drawn, *constants)


def _when(x: Kept, zone: str) -> str:
    return f"{stamp(x['first_s'], zone)} to {stamp(x['last_s'], zone)}"


def _what(x: Kept) -> str:
    moves = f", {x['moves']} moves" if x["moves"] > 1 else ""
    why = f"; {x['untold']}" if x.get("untold") else ""
    return f"{x['course']}{moves} over {number(x['size_pct'])} %{why}"


def _constants(x: Kept) -> Iterator[tuple[str, str]]:
    """Constants with their intervals."""
    for name, (value, low, high, unit) in x["constants"].items():
        ends = f"{number(low)} … {number(high)}"
        yield (
            name.removesuffix("_s").removesuffix("_pct").replace("_", " "),
            f"{number(value)} {unit} ({ends})",
        )


def _pictures(at: int, x: Kept, scale: words.PvScale) -> Iterator[parts.Panels]:
    """PV with the model's response, and OP below."""
    hours = np.asarray(x["time_s"], dtype=float) / 3600.0
    pv, simulated = (scale.of(np.asarray(x[k], dtype=float)) for k in ("pv", "simulated"))
    op = np.asarray(x["op"], dtype=float)
    lines = parts.Line("PV", hours, pv, kind="pv"), parts.Line("model", hours, simulated, kind="brought")
    upper = parts.Plot(f"experiment-{at}-pv", "Answer", "hours", f"PV [{scale.label}]", lines)
    below = parts.Plot(
        f"experiment-{at}-op", "OP", "hours", "OP [%]", (parts.Line("OP", hours, op, kind="op"),)
    )
    yield parts.Panels(f"experiment-{at}", f"{x['course']}: PV and the model's answer", (upper, below))
