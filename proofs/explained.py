"""What `explain` reports on untidy loops: python -m proofs.explained [FOLDER ...] [--loops 150] [--seed 9]

The folders are like ../shared/wild (one export for each loop, loops.csv, truth.json). Loops of proofs/untidy are
added, with a seed that set no threshold. Whether a loop shows its cause, and shows it clearly, is defined as in
untidy_loops.py. The table counts three groups: clear loops with a worn valve for which backlash or stick-slip is
reported, loops without a fault with a reported effect of valve or process, and loops with another cause with a
reported effect of the valve. Writes proofs/explained.md.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from analyzer import api
from identification.errors import NotAssessedError
from proofs.common import command, command_line, publish, table

WORN = ("stiction", "backlash")
Row = tuple[str, str, frozenset[str], float]
"""True cause, verdict, blocks of the reported effects, seconds."""


def shows(t: Mapping[str, Any]) -> bool:
    """Whether the cause shows in the recorded error; True for a loop without a fault."""
    visible = t["swell"] >= 1.5 and t["steady"] >= 0.75 and t["rhythm"] >= 0.15
    return t["cause"] == "healthy" or (visible and t["cycles"] >= 5 and t["samples_a_cycle"] >= 4)


def clear(t: Mapping[str, Any]) -> bool:
    """Whether it shows so clearly that it should be reported."""
    return shows(t) and t["swell"] >= 2 and t["samples_a_cycle"] >= 8 and not t["packed"]


def explained(task: tuple[Path, str, str, bool]) -> Row:
    """One explained loop; `integrator` is not counted as a fault of an integrating process."""
    folder, name, cause, integrating = task
    begun = time.process_time()
    try:
        loop = api.read(folder / f"{name}.parquet", loops=folder / "loops.csv").loop(name)
        said = api.explain(loop).said
    except NotAssessedError:
        return cause, "abstained", frozenset(), time.process_time() - begun
    effects = () if said.verdict in ("unexplained", "none") else said.effects
    blocks = frozenset(e.block for e in effects if not (integrating and e.name == "integrator"))
    return cause, said.verdict, blocks, time.process_time() - begun


def line(name: str, rows: list[Row]) -> list[object]:
    """A set's counts as a row of the table."""
    worn = [r for r in rows if r[0] in WORN]
    well = [r for r in rows if r[0] == "healthy"]
    other = [r for r in rows if r[0] not in (*WORN, "healthy")]
    named = sum(r[1] in WORN for r in worn)
    kind = sum(r[1] == r[0] for r in worn)
    wronged = sum(bool(r[2] & {"valve", "process"}) for r in well)
    blamed = sum("valve" in r[2] for r in other)
    most = max(r[3] for r in rows)
    return [
        name,
        f"{named} of {len(worn)}",
        kind,
        f"{wronged} of {len(well)}",
        f"{blamed} of {len(other)}",
        f"{most:.0f}",
    ]


def verdicts(name: str, rows: list[Row]) -> str:
    """A sentence with the verdicts on the worn valves of a set."""
    counts = Counter(r[1] for r in rows if r[0] in WORN)
    return f"{name}: " + ", ".join(f"{verdict} {count}" for verdict, count in counts.most_common()) + "."


def judged(folder: Path, jobs: int) -> list[Row]:
    """All loops of a folder that have no fault or show their cause clearly."""
    truth = json.loads((folder / "truth.json").read_text())
    tasks = [
        (folder, n, t["cause"], bool(t["plant"].get("integrating")))
        for n, t in truth.items()
        if (shows(t) if t["cause"] == "healthy" else clear(t))
    ]
    with Pool(jobs) as pool:
        return pool.map(explained, tasks, chunksize=1)


def main() -> None:
    """Explain all loops and write the tables next to this file."""
    options = command_line(__doc__, folders="*", loops=150, seed=9, jobs=2)
    sets = {f"{f.parent.name}/{f.name}": judged(f, options.jobs) for f in options.folders}
    with tempfile.TemporaryDirectory() as own:
        wanted = ("--loops", str(options.loops), "--seed", str(options.seed))
        subprocess.run([sys.executable, "-m", "proofs.untidy", own, *wanted], check=True)
        sets[f"own, seed {options.seed}"] = judged(Path(own), options.jobs)
    heads = (
        "loops | worn valve reported | its kind right | no fault, valve or process reported "
        "| another cause, valve reported | longest, s of processor"
    )
    text = table(heads, (line(name, rows) for name, rows in sets.items()))
    names = "\n".join(verdicts(name, rows) for name, rows in sets.items())
    places = (f"../shared/wild/{f.name}" for f in options.folders)
    shown = command(__file__, *places, loops=options.loops, seed=options.seed)
    publish(__file__, "Untidy loops explained", shown, text, names)


if __name__ == "__main__":
    main()
