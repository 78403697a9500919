"""Are controllers as plants have them called wrongly stated? python -m proofs.controllers [--seed 1 2] [--days 3]

Fourteen controllers (proofs/controllers_plant.py, which shares no code with the package) with a healthy valve, a worn
one and set point moves, at 1 and 10 s. Of each the settings are stated as they are, with and without what else the
controller has, and stated in the usual wrong ways. Writes controllers.md here.
"""

from __future__ import annotations

import math
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.judged_stretch import controller_of, differing
from analyzer.loop.measure import time_scale
from analyzer.loop.oscillation import counting, detect
from analyzer.loop.quality import Prepared, prepare
from analyzer.loops.slips import slip
from analyzer.loops.tags import match, read_loops
from identification.models import Pid
from proofs.common import command, command_line, publish, table
from proofs.controllers_plant import FORMS, SCENES, Controlled, controlled

TRUE, WITH_EXTRAS = "as they are", "as they are, extras too"
MISTAKES = ("minutes as s", "repeats/min as s", "band as gain", "engineering as percent", "series as ideal")
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


def _told(
    folder: Path, row: Row, p: Prepared | None, config: Config
) -> tuple[Prepared, Pid, Pid | None, bool]:
    """The recording, the controller stated, the one that is told instead, and whether the slip is named."""
    pd.DataFrame([{"loop": "L", **row}]).to_csv(folder / "loops.csv", index=False)
    export = open_export([folder / "trends"])
    (spec,), *_ = match(read_loops(folder / "loops.csv"), export.tags)
    p = p or prepare(spec, export.read(spec.tags), config.quality)
    stated = controller_of(spec, p)
    assert stated is not None
    scale = time_scale(p.record, counting(detect(p.record, config.oscillation)), stated)
    found = differing(p.record, stated, scale, config.settings)
    return p, stated, found, found is not None and bool(slip(spec, found, p.scale.span))


def judged(c: Controlled, every: int) -> list[tuple[str, bool, bool, tuple[float, float] | None]]:
    """Of each way to state a loop: whether it is told as wrong, whether the slip is named, and how far the gain and
    the integral time that are told are from the true ones [-]."""
    config, p, out = Config(), None, []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "trends").mkdir()
        c.trends("L", every).to_parquet(folder / "trends" / "trends.parquet")
        for what, row in rows_of(c).items():
            p, _, found, named = _told(folder, row, p, config)
            off = None if found is None else _off(found, c.ideal)
            out.append((what, found is not None, named, off))
    return out


def _off(found: Pid, ideal: tuple[float, float, float]) -> tuple[float, float]:
    """How far a gain and an integral time are from the true ones [-]."""
    kp, ti, _ = ideal
    if not kp or not found.kp:
        return math.nan, math.nan
    return abs(found.kp / kp - 1), abs(found.ti_s / ti - 1) if math.isfinite(ti) else math.nan


def main() -> None:
    """Count over all loops of some seeds and write the table."""
    asked = command_line(__doc__, seed=[1], days=3.0)
    told: dict[tuple[str, str, int], list[bool]] = defaultdict(list)
    named: dict[tuple[str, int], list[bool]] = defaultdict(list)
    apart: dict[int, list[tuple[float, float]]] = defaultdict(list)
    for form in FORMS:
        for seed in asked.seed:
            for scene in SCENES:
                c = controlled(form, scene, seed, asked.days)
                for every in (1, 10):
                    for what, wrong, slipped, off in judged(c, every):
                        told[form, what, every].append(wrong)
                        if what in MISTAKES:
                            named[what, every].append(slipped)
                        if what in MISTAKES and form != "fast PI" and off is not None:
                            apart[every].append(off)
        print(form, flush=True)

    def cell(form: str | None, what: str, every: int) -> str:
        each = [
            x
            for (f, w, e), xs in told.items()
            if (form in (None, f), w, e) == (True, what, every)
            for x in xs
        ]
        return f"{sum(each)} of {len(each)}" if each else ""

    heads = "controller | " + " | ".join(
        f"{w}, {e} s" for w in (TRUE, WITH_EXTRAS, *MISTAKES) for e in (1, 10)
    )
    columns = [(w, e) for w in (TRUE, WITH_EXTRAS, *MISTAKES) for e in (1, 10)]
    rows = [[f, *(cell(f, w, e) for w, e in columns)] for f in FORMS]
    rows.append(["all", *(cell(None, w, e) for w, e in columns)])
    slips = ["slip named", *("" if w not in MISTAKES else f"{sum(named[w, e])}" for w, e in columns)]
    off = [f"{e} s: {_quantiles(apart[e])}" for e in (1, 10)]
    publish(
        __file__,
        "Are controllers as plants have them called wrongly stated?",
        command(__file__, seed=asked.seed, days=asked.days),
        "Loops of which the stated settings are told as not the controller's. Stated as they are, each one is a "
        "false complaint; in the other columns each one is right. A fast PI (integral time of 3 to 10 s) at 10 s is "
        "a control: nothing is to be told of it.",
        table(heads, [*rows, slips]),
        "Where wrong settings are told, how far the gain and the integral time told beside them are from the true "
        f"ones, as median and 90 % quantile: {'; '.join(off)}.",
    )


def _quantiles(off: list[tuple[float, float]]) -> str:
    """Median and 90 % quantile of gain and of integral time, in percent."""
    each = np.nanquantile(np.array(off), (0.5, 0.9), axis=0) * 100
    return f"Kp {each[0, 0]:.1f} and {each[1, 0]:.1f} %, Ti {each[0, 1]:.1f} and {each[1, 1]:.1f} %"


if __name__ == "__main__":
    main()
