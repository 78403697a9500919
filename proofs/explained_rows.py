"""`explain` on rows slower than the scan: python -m proofs.explained_rows FOLDER ... [--every 10] [--seed 601]

The folders hold plants as ../shared/plants does (export.parquet, loops.csv, truth.json). With --seed,
benchmarks/world adds loops without a fault and worn valves. Of the rows every tenth is kept, or every --every-th. By
the truth, the table counts loops for which `run` and `explain` name a valve fault, and loops with an effect that does
not exist. It also counts loops whose improved model is worse on held-out data in the loop's frequency band. Worn
valves count from fifteen rows per cycle on. A load is never an invented effect, because each of these loops has one.
Writes proofs/explained_rows.md.
"""

from __future__ import annotations

import json
import tempfile
from collections import Counter
from collections.abc import Iterator
from multiprocessing import Pool
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pyarrow.parquet as pq

from analyzer import api
from analyzer.explain.words import held_out
from analyzer.loop.decisions import Cause
from benchmarks.world.__main__ import export
from benchmarks.world.draw import drawn, run
from benchmarks.world.recorder import recorded
from identification.errors import NotAssessedError
from proofs.common import command, command_line, publish, table
from proofs.sampling import ROWS, settings

VALVE = {"backlash", "stiction", "positioner"}
LOADS = {"load-step", "load-oscillation", "coupling"}
"""Effects that a worn valve has, and effects of a load."""
WORN = ("backlash", "stiction", "backlash-quiet")
"""True causes that are worn valves."""
WORSE = 1.005
"""Ratio of rms misfits from which a model counts as worse: one percent of the mean square, as in the proof."""
EACH = 8
"""Loops of each kind in one draw of the world."""
PARTS = ("loops", "valve by run", "valve by explain", "invented effect", "worse held out")


class Case(NamedTuple):
    """One loop of an export: its name, the files, its true cause, and the interval of the rows [s]."""

    name: str
    file: Path
    loops: Path
    cause: str
    every: int


def judged(case: Case) -> tuple[str, Counter[str]]:
    """The loop's group and its counts; the counts are empty where it is not assessed."""
    try:
        loop = api.read(case.file, loops=case.loops).loop(case.name)
        night, data = api.assess(loop), api.explain(loop).data
    except NotAssessedError:
        return case.cause, Counter()
    cycle, names = night.oscillations.first, {e["name"] for e in data["effects"]}
    group = case.cause
    if group in WORN:
        few = cycle is None or cycle.period_s < ROWS * case.every
        group = "worn, few rows per cycle" if few else "worn"
    there = LOADS | VALVE if case.cause in WORN else LOADS
    worse = bool(names) and held_out(data)[1] > WORSE * held_out(data)[0]
    flags = (True, night.verdict.cause is Cause.VALVE, bool(VALVE & names), bool(names - there), worse)
    return group, Counter({part: int(x) for part, x in zip(PARTS, flags, strict=True)})


def of_plant(folder: Path, every: int, at: Path) -> Iterator[Case]:
    """The loops of a plant, with every `every`-th row."""
    truth = json.loads((folder / "truth.json").read_text("utf-8"))["loops"]
    whole, file = pq.read_table(folder / "export.parquet"), at / f"{folder.name}.parquet"
    pq.write_table(whole.take(list(range(0, whole.num_rows, every))), file)
    yield from (Case(n, file, folder / "loops.csv", t["cause"], every) for n, t in truth.items())


def of_world(seed: int, every: int, at: Path) -> Iterator[Case]:
    """Loops without a fault and worn valves of one draw of the world."""
    loops = drawn(seed, EACH, ("healthy", "backlash", "stiction"))
    stated: list[dict[str, Any]] = [{"loop": d.name, "pv_lo": 0, "pv_hi": 100, **settings(d)} for d in loops]
    pd.DataFrame(stated).to_csv(at / f"{seed}.csv", index=False)
    for d in loops:
        folder = at / f"{seed}-{d.name}"
        folder.mkdir()
        (file,) = export(folder, {d.name: recorded(run(d), f"every {every} s", d.seed)})
        yield Case(d.name, file, at / f"{seed}.csv", d.kind, every)


def counted(every: int, folders: list[Path], seeds: list[int], jobs: int) -> Iterator[tuple[Any, ...]]:
    """Rows of the table at one interval."""
    with tempfile.TemporaryDirectory() as temporary, Pool(jobs) as pool:
        sources = {f.name: of_plant(f, every, Path(temporary)) for f in folders}
        sources |= {f"world {seed}": of_world(seed, every, Path(temporary)) for seed in seeds}
        for name, cases in sources.items():
            groups: dict[str, Counter[str]] = {}
            for group, counts in pool.imap(judged, cases):
                groups.setdefault(group, Counter()).update(counts)
            for group, counts in sorted(groups.items()):
                yield (name, f"{every} s", group, *(counts[part] for part in PARTS))


def main() -> None:
    """Count, and write the table next to this file."""
    options = command_line(__doc__, folders="*", every=[10], seed=[], jobs=2)
    rows = [
        row for every in options.every for row in counted(every, options.folders, options.seed, options.jobs)
    ]
    places = (f"../shared/plants/{f.name}" for f in options.folders)
    words = command(__file__, *places, **({"seed": options.seed} if options.seed else {}))
    publish(
        __file__,
        "Explanations of rows slower than the scan",
        words,
        table("from|every|truth|" + "|".join(PARTS), rows),
    )


if __name__ == "__main__":
    main()
