"""Are stated settings reported as wrong for typical controllers? python -m proofs.controllers [--seed 1 2] [--days 3]

Fifteen controllers (proofs/controllers_plant.py, which shares no code with the package) are simulated with a valve
without a fault, a worn valve, and set point moves, and recorded at 1 and 10 s. The settings of each are stated in
four ways: correctly, correctly with the controller's other features, with the usual mistakes, and not at all. Writes
controllers.md here.
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
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import match, read_loops
from analyzer.loops.typing_errors import typing_error
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
"""Features that the package recognizes, and their names in a controller."""
WITHIN = {1: 0.10, 10: 0.25}
"""Permitted error of the recorded settings [-], by the seconds between samples."""
Row = Mapping[str, Any]


def mistaken(row: Row, what: str) -> dict[str, Any] | None:
    """The row with one mistake; None where the mistake changes little or nothing."""
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
    """The result for one recording.

    ways: for each way to state the settings: whether they are reported as wrong, whether the mistake is named,
        and the errors of the reported gain and integral time [-].
    recognized: whether the other features of the controller are recognized; None where it has no recognizable
        one.
    invented: whether a feature is reported that the controller does not have.
    alone: the errors of the settings reported where none are stated [-]; None where none are reported.
    """

    ways: list[tuple[str, bool, bool, tuple[float, float] | None]] = field(default_factory=list)
    recognized: bool | None = None
    invented: bool = False
    alone: tuple[float, float] | None = None


def _spec(folder: Path, row: Row) -> tuple[LoopSpec, Export]:
    """The loop as stated, and its export."""
    pd.DataFrame([{"loop": "L", **row}]).to_csv(folder / "loops.csv", index=False)
    export = open_export([folder / "trends"])
    return match(read_loops(folder / "loops.csv"), export.tags)[0][0], export


def judged(c: Controlled, every: int) -> Judged:
    """The result for a recording with one sample every `every` seconds."""
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
            named = seen.other is not None and bool(typing_error(spec, seen.other, p.scale.span))
            off = None if seen.other is None else _off(seen.other, c.ideal)
            out.ways.append((what, seen.other is not None, named, off))
            if what == TRUE:
                out.recognized, out.invented = _features(stated, seen.detected, c.extras)
        alone = shown(p.record, None, time_scale(p.record, cycle, None), config.settings).detected
        out.alone = None if alone is None else _off(alone, c.ideal)
    return out


def _features(stated: Pid, seen: Pid | None, extras: Row) -> tuple[bool | None, bool]:
    """Whether the features are recognized, None where the controller has none; and whether one is reported that it
    does not have."""
    seen = seen or stated
    reported = {name for name, of in LOOKED_FOR.items() if getattr(seen, of) != getattr(stated, of)}
    true = {name: value for name, value in extras.items() if name in LOOKED_FOR}
    right = [
        name in reported
        and (value == "squared" or abs(getattr(seen, LOOKED_FOR[name]) - value) <= 0.25 * value)
        for name, value in true.items()
    ]
    return (all(right) if right else None), bool(reported - set(true))


def _off(found: Pid, ideal: tuple[float, float, float]) -> tuple[float, float]:
    """Relative errors of a gain and an integral time [-]."""
    kp, ti, _ = ideal
    if not kp or not found.kp:
        return math.nan, math.nan
    return abs(found.kp / kp - 1), abs(found.ti_s / ti - 1) if math.isfinite(ti) else math.nan


def main() -> None:
    """Judge all loops of some seeds and write the tables."""
    options = command_line(__doc__, seed=[1], days=3.0)
    of: dict[tuple[str, int], list[Judged]] = defaultdict(list)
    for form in FORMS:
        for seed in options.seed:
            for scene in SCENES:
                c = controlled(form, scene, seed, options.days)
                for every in (1, 10):
                    of[form, every].append(judged(c, every))
        print(form, flush=True)
    columns = [(w, e) for w in (TRUE, WITH_EXTRAS, *MISTAKES) for e in (1, 10)]
    heads = "controller | " + " | ".join(f"{w}, {e} s" for w, e in columns)
    identifiable = [(f, e) for f, e in of if (f, e) != ("fast PI", 10)]
    rows = [[f, *(_reported([of[f, e]], w) for w, e in columns)] for f in FORMS]
    rows.append(
        [
            "all but fast PI at 10 s",
            *(_reported([of[f, e] for f, e in identifiable if e == x], w) for w, x in columns),
        ]
    )
    rows.append(
        ["slip named", *(_reported([of[f, e] for f, e in identifiable if e == x], w, 2) for w, x in columns)]
    )
    off = [x for f, e in identifiable for j in of[f, e] for *_, x in j.ways[2:] if x is not None]
    publish(
        __file__,
        "Are stated settings reported as wrong for typical controllers?",
        command(__file__, seed=options.seed, days=options.days),
        "Loops whose stated settings are reported as not those of the controller. Where the settings are stated as "
        "they are, each report is a false alarm; in the other columns each report is right. A fast PI (integral time "
        "of 3 to 10 s) at 10 s is a control case: no report is right for it. A gain schedule is stated by its gain "
        "below an OP of 50 %. A series form with a Td of a tenth of its Ti is within 10 % of an ideal one. Samples "
        "slower than the scan cannot distinguish them.",
        table(heads, rows),
        f"A report of wrong settings also gives gain and integral time. Their errors, as median and 90 % quantile: "
        f"{_quantiles(off)}.",
        "The next table is for features of the controller that are not stated. It shows how often they are "
        "recognized within 25 %, where the settings are stated as they are. It shows how often a feature is "
        "reported that the controller does not have. The last columns are for settings that are not stated at all. "
        "These are reported where the control law explains more than 90 % of OP's increments. Right is within 10 % "
        "at 1 s and 25 % at 10 s:",
        table(
            "controller | " + " | ".join(f"{w}, {e} s" for w in FEATURES for e in (1, 10)),
            [[f, *(cell(of[f, e], e) for cell in FEATURES.values() for e in (1, 10))] for f in FORMS],
        ),
    )


def _reported(of: list[list[Judged]], what: str, place: int = 1) -> str:
    """In how many of all recordings a way to state the settings is reported as wrong, or its mistake named (place
    2)."""
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


FEATURES = {"recognized": _recognized, "not there": _invented, "recorded settings right": _alone}


def _quantiles(off: list[tuple[float, float]]) -> str:
    """Median and 90 % quantile of gain and of integral time, in percent."""
    each = np.nanquantile(np.array(off), (0.5, 0.9), axis=0) * 100
    return f"Kp {each[0, 0]:.1f} and {each[1, 0]:.1f} %, Ti {each[0, 1]:.1f} and {each[1, 1]:.1f} %"


if __name__ == "__main__":
    main()
