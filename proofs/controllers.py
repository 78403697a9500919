"""Are controllers as plants have them called wrongly stated? python -m proofs.controllers [--seed 1 2] [--days 3]

Fifteen controllers (proofs/controllers_plant.py, which shares no code with the package) with a healthy valve, a worn
one and set point moves, at 1 and 10 s. Of each the settings are stated as they are, with and without what else the
controller has, in the usual wrong ways, and not at all. Writes controllers.md here.
"""

from __future__ import annotations

import math
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from analyzer.config import Config
from analyzer.history.export import Export, open_export
from analyzer.loop.identification.measure import time_scale
from analyzer.loop.oscillation.detection import counting, detect
from analyzer.loop.record.judged_stretch import controller_of, shown
from analyzer.loop.record.quality import prepare
from analyzer.loops.slips import slip
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import match, read_loops
from identification.models import Pid
from proofs.common import command, command_line, publish, table
from proofs.controllers_plant import FORMS, SCENES, Controlled, controlled

TRUE, WITH_EXTRAS = "as they are", "as they are, extras too"
MISTAKES = ("minutes as s", "repeats/min as s", "band as gain", "engineering as percent", "series as ideal")
LOOKED_FOR = {
    "gap": "gap",
    "error_form": "error_form",
    "pv_filter_s": "pv_filter_s",
    "op_rate": "op_rate",
    "op_hi_limit": "op_hi",
    "sp_weight": "sp_weight",
}
"""Extras that are recognized, and their names in a controller."""
WITHIN = {1: 0.10, 10: 0.25}
"""How far recorded settings may be off by the seconds between samples [-]."""
Row = Mapping[str, Any]


def mistaken(row: Row, what: str) -> dict[str, Any] | None:
    """The row with one mistake; None where that changes nothing, or little."""
    if not row["kp"]:
        return None
    if what in MISTAKES[:2] and row["ti"]:
        return {**row, "ti": row["ti"] / 60 if what == MISTAKES[0] else 60 / row["ti"]}
    if what == "band as gain" and not 5 < row["kp"] < 20 and row["form"] == "ideal":
        return {**row, "kp": 100 / row["kp"]}
    if what == "engineering as percent":  # the gain of a PV of 0 to 250
        return {**row, "kp": row["kp"] * 0.4} if row["form"] == "ideal" else None
    if what == "series as ideal" and row["form"] == "series":
        return {**row, "form": "ideal"}
    return None


def rows_of(c: Controlled) -> dict[str, Row]:
    """Each way to state a loop."""
    wrong = {what: mistaken(c.row, what) for what in MISTAKES}
    out: dict[str, Row] = {TRUE: c.row, WITH_EXTRAS: {**c.row, **c.extras}}
    return out | {what: row for what, row in wrong.items() if row is not None}


@dataclass(slots=True)
class Judged:
    """What is told of one recording: of each way to state it whether it is told as wrong, whether the slip is named,
    and how far gain and integral time told are from the true ones [-]; whether what the controller has beside is
    recognized, None where it has none that is looked for; whether something is that it has not; and how far recorded
    settings are off where none are stated, None where none are told."""

    ways: list[tuple[str, bool, bool, tuple[float, float] | None]] = field(default_factory=list)
    recognized: bool | None = None
    invented: bool = False
    alone: tuple[float, float] | None = None


def _spec(folder: Path, row: Row) -> tuple[LoopSpec, Export]:
    """The loop as it is stated, and its export."""
    pd.DataFrame([{"loop": "L", **row}]).to_csv(folder / "loops.csv", index=False)
    export = open_export([folder / "trends"])
    return match(read_loops(folder / "loops.csv"), export.tags)[0][0], export


def judged(c: Controlled, every: int) -> Judged:
    """What is told of a recording of one sample every so many seconds."""
    config, out = Config(), Judged()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "trends").mkdir()
        c.trends("L", every).to_parquet(folder / "trends" / "trends.parquet")
        spec, export = _spec(folder, c.row)
        p = prepare(spec, export.read(spec.tags), config.quality)
        cycle = counting(detect(p.record, config.oscillation))
        for what, row in rows_of(c).items():
            spec, _ = _spec(folder, row)
            stated = controller_of(spec, p)
            assert stated is not None
            seen = shown(p.record, stated, time_scale(p.record, cycle, stated), config.settings)
            named = seen.other is not None and bool(slip(spec, seen.other, p.scale.span))
            off = None if seen.other is None else _off(seen.other, c.ideal)
            out.ways.append((what, seen.other is not None, named, off))
            if what == TRUE:
                out.recognized, out.invented = _beside(stated, seen.beside, c.extras)
        alone = shown(p.record, None, time_scale(p.record, cycle, None), config.settings).beside
        out.alone = None if alone is None else _off(alone, c.ideal)
    return out


def _beside(stated: Pid, seen: Pid | None, extras: Row) -> tuple[bool | None, bool]:
    """Whether an extra is recognized, None where the controller has none, and whether one is told that it has not."""
    seen = seen or stated
    told = {name for name, of in LOOKED_FOR.items() if getattr(seen, of) != getattr(stated, of)}
    true = {name: value for name, value in extras.items() if name in LOOKED_FOR}
    right = [
        name in told and (value == "squared" or abs(getattr(seen, LOOKED_FOR[name]) - value) <= 0.25 * value)
        for name, value in true.items()
    ]
    return (all(right) if right else None), bool(told - set(true))


def _off(found: Pid, ideal: tuple[float, float, float]) -> tuple[float, float]:
    """How far a gain and an integral time are from the true ones [-]."""
    kp, ti, _ = ideal
    if not kp or not found.kp:
        return math.nan, math.nan
    return abs(found.kp / kp - 1), abs(found.ti_s / ti - 1) if math.isfinite(ti) else math.nan


def main() -> None:
    """Judge all loops of some seeds and write the tables."""
    asked = command_line(__doc__, seed=[1], days=3.0)
    of: dict[tuple[str, int], list[Judged]] = defaultdict(list)
    for form in FORMS:
        for seed in asked.seed:
            for scene in SCENES:
                c = controlled(form, scene, seed, asked.days)
                for every in (1, 10):
                    of[form, every].append(judged(c, every))
        print(form, flush=True)
    columns = [(w, e) for w in (TRUE, WITH_EXTRAS, *MISTAKES) for e in (1, 10)]
    heads = "controller | " + " | ".join(f"{w}, {e} s" for w, e in columns)
    tellable = [(f, e) for f, e in of if (f, e) != ("fast PI", 10)]
    rows = [[f, *(_told([of[f, e]], w) for w, e in columns)] for f in FORMS]
    rows.append(
        [
            "all but fast PI at 10 s",
            *(_told([of[f, e] for f, e in tellable if e == x], w) for w, x in columns),
        ]
    )
    rows.append(["slip named", *(_told([of[f, e] for f, e in tellable if e == x], w, 2) for w, x in columns)])
    off = [x for f, e in tellable for j in of[f, e] for *_, x in j.ways[2:] if x is not None]
    publish(
        __file__,
        "Are controllers as plants have them called wrongly stated?",
        command(__file__, seed=asked.seed, days=asked.days),
        "Loops of which the stated settings are told as not the controller's. Stated as they are, each one is a "
        "false complaint; in the other columns each one is right. A fast PI (integral time of 3 to 10 s) at 10 s is "
        "a control: nothing is to be told of it. A gain schedule is stated by its gain below an OP of 50 %. A series "
        "law with a Td of a tenth of its Ti is an ideal one within 10 %: samples slower than the scan do not tell.",
        table(heads, rows),
        f"Where wrong settings are told, how far gain and integral time told beside them are from the true ones, as "
        f"median and 90 % quantile: {_quantiles(off)}.",
        "What the controller has beside, recognized within 25 % where its settings are stated as they are and it is "
        "not; how often something is that it has not; and how often settings that are not stated at all, told from "
        "a law that explains more than 90 % of OP's increments, are within 10 % at 1 s and 25 % at 10 s:",
        table(
            "controller | " + " | ".join(f"{w}, {e} s" for w in BESIDE for e in (1, 10)),
            [[f, *(cell(of[f, e], e) for cell in BESIDE.values() for e in (1, 10))] for f in FORMS],
        ),
    )


def _told(of: list[list[Judged]], what: str, place: int = 1) -> str:
    """In how many of all recordings a way to state them is told as wrong, or its slip named (place 2)."""
    each = [bool(way[place]) for judged in of for j in judged for way in j.ways if way[0] == what]
    return f"{sum(each)} of {len(each)}" if each and (place == 1 or what in MISTAKES) else ""


def _recognized(of: list[Judged], every: int) -> str:
    each = [j.recognized for j in of if j.recognized is not None]
    return f"{sum(each)} of {len(each)}" if each else ""


def _invented(of: list[Judged], every: int) -> str:
    return f"{sum(j.invented for j in of)} of {len(of)}"


def _alone(of: list[Judged], every: int) -> str:
    each = [max((x for x in j.alone if math.isfinite(x)), default=0.0) for j in of if j.alone is not None]
    return f"{sum(x <= WITHIN[every] for x in each)} of {len(each)}" if each else "none told"


BESIDE = {"recognized": _recognized, "not there": _invented, "recorded settings right": _alone}


def _quantiles(off: list[tuple[float, float]]) -> str:
    """Median and 90 % quantile of gain and of integral time, in percent."""
    each = np.nanquantile(np.array(off), (0.5, 0.9), axis=0) * 100
    return f"Kp {each[0, 0]:.1f} and {each[1, 0]:.1f} %, Ti {each[0, 1]:.1f} and {each[1, 1]:.1f} %"


if __name__ == "__main__":
    main()
