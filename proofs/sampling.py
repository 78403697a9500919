"""Worn valves by the interval of the rows: python -m proofs.sampling FOLDER ... [--every 1 10 30] [--seed 51 52]

The folders hold plants as ../shared/plants does (export.parquet, loops.csv, truth.json). With --seed, worn valves of
benchmarks/world are added. Of each loop with a worn valve one row of every --every is kept, and the loop is assessed.
Loops count whose cycle has fifteen rows or more at that interval. The table counts: the valve's fault named, width of
backlash or stickband within 15 %, slope within 25 %, dead time within 30 % or half a row, and the 90 % interval of
the width containing the truth. Writes proofs/sampling.md.
"""

from __future__ import annotations

import json
import tempfile
from collections import Counter
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq

from analyzer import api
from analyzer.loop.decisions import Cause
from analyzer.loop.identification.intervals import intervals
from benchmarks.world.__main__ import export
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.recorder import recorded
from identification.errors import NotAssessedError
from proofs.common import command, command_line, publish

ROWS = 15
"""Least number of rows per cycle with which a loop counts."""
WORN = 8
"""Number of valves with backlash, and of valves with stick-slip, in one draw of the world."""
KINDS = ("named", "width", "slope", "dead time", "interval")


def judged(name: str, export: Path, loops: Path, truth: dict[str, float], every: int) -> Counter[str]:
    """The right answers for one loop; empty where its cycle has too few rows or is not found."""
    try:
        found = api.assess(api.read(export, loops=loops).loop(name))
    except NotAssessedError:
        return Counter()
    cycle, m = found.oscillations.first, found.verdict.measured
    if cycle is None or m is None or cycle.period_s < ROWS * every:
        return Counter()
    fit = found.verdict.fit if found.verdict.cause is Cause.VALVE else m.backlash
    width, slope = truth.get("backlash") or truth["stick_S"], truth["K"] / truth["T"]
    said = intervals(fit, True, api.Config().advice, m.controller)
    held = said.get("stickband_pct") or said.get("backlash_pct")
    return Counter(
        {
            "loops": 1,
            "named": int(found.verdict.cause is Cause.VALVE),
            "width": int(abs(fit.valve.stickband / width - 1) <= 0.15),
            "slope": int(abs(fit.slope / slope - 1) <= 0.25),
            "dead time": int(abs(fit.process.dead_time_s - truth["L"]) <= max(0.3 * truth["L"], 0.5 * every)),
            "interval": int(held is not None and held.low <= width <= held.high),
        }
    )


def of_plant(folder: Path, every: int, jobs: int) -> Counter[str]:
    """Counts of one plant's worn valves at one interval."""
    truth = json.loads((folder / "truth.json").read_text("utf-8"))["loops"]
    worn: dict[str, Any] = {n: t["plant"] for n, t in truth.items() if t["cause"] in ("backlash", "stiction")}
    with tempfile.TemporaryDirectory() as temporary:
        export = Path(temporary) / "export.parquet"
        whole = pq.read_table(folder / "export.parquet")
        pq.write_table(whole.take(list(range(0, whole.num_rows, every))), export)
        asked = partial(judged, export=export, loops=folder / "loops.csv", every=every)
        with Pool(jobs) as pool:
            each = [pool.apply_async(asked, (n,), {"truth": t}) for n, t in worn.items()]
            return sum((x.get() for x in each), Counter())


def of_world(seed: int, every: int, jobs: int) -> Counter[str]:
    """Counts of the worn valves of one draw of benchmarks/world at one interval."""
    loops = drawn(seed, WORN, ("backlash", "stiction"))
    with tempfile.TemporaryDirectory() as temporary, Pool(jobs) as pool:
        folder = Path(temporary)
        stated = [{"loop": d.name, "pv_lo": 0, "pv_hi": 100, **settings(d)} for d in loops]
        pd.DataFrame(stated).to_csv(folder / "loops.csv", index=False)
        each = []
        for d in loops:
            (folder / d.name).mkdir()
            (file,) = export(folder / d.name, {d.name: recorded(run(d), f"every {every} s", d.seed)})
            truth = {
                "backlash": d.valve.band,
                "K": d.process.gain,
                "T": d.process.lag_s or 1.0,
                "L": d.process.dead_s,
            }
            each.append(pool.apply_async(judged, (d.name, file, folder / "loops.csv", truth, every)))
        return sum((x.get() for x in each), Counter())


def settings(d: Drawn) -> dict[str, float]:
    """What loops.csv states of a loop's controller."""
    return {"kp": d.controller.kp, "ti": d.controller.ti_s, "scan_s": d.controller.scan_s}


def main() -> None:
    """Count each plant at each interval and write the table next to this file."""
    options = command_line(__doc__, folders="*", every=[1, 10, 30], seed=[], jobs=2)
    lines = ["| plant | every | loops | " + " | ".join(KINDS) + " |", "|---|--:|" + "--:|" * (1 + len(KINDS))]
    for folder in options.folders:
        for every in options.every:
            counts = of_plant(folder, every, options.jobs)
            cells = " | ".join(str(counts[k]) for k in KINDS)
            lines.append(f"| {folder.name} | {every} s | {counts['loops']} | {cells} |")
    for seed in options.seed:
        for every in options.every:
            counts = of_world(seed, every, options.jobs)
            cells = " | ".join(str(counts[k]) for k in KINDS)
            lines.append(f"| world {seed} | {every} s | {counts['loops']} | {cells} |")
    places = (f"../shared/plants/{f.name}" for f in options.folders)
    asked = command(__file__, *places, **({"seed": options.seed} if options.seed else {}))
    publish(__file__, "Worn valves by the interval of the rows", asked, "\n".join(lines))


if __name__ == "__main__":
    main()
