"""Real recordings with labels, assessed by this tool and by two open methods.

    python -m proofs.field_peer RECORDINGS --peer PYTHON

Valves (isdb, refinery): PyPI's `stictionanalyser` fits ellipses to OP over PV cycle by cycle. A valve counts as named
where the package finds stiction in half of the cycles or more. benchmarks/peer.py describes its environment; without
--peer its column is empty. Cycles (isdb-op): the regularity of the zero crossings of the error's autocorrelation
(Thornhill, Huang, Zhang 2003). Regular means that a third of mean over deviation of the first intervals is above 1.
The band filter, which the user sets by hand, is not applied. Recordings of one controller count once, by majority.
Writes field_peer.md here.
"""

from __future__ import annotations

import csv
import json
import subprocess
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from analyzer.store.store import Store
from benchmarks.peer import PEER
from identification.record import Floats
from identification.signals.correlation import lag_sums
from proofs.common import command, parser_of, publish, table

VALVES, CYCLES = ("isdb", "refinery"), ("isdb-op",)
INTERVALS = 11
"""Number of zero crossings of the autocorrelation, as in the paper."""
SHARE = 0.5
"""Share of cycles with stiction from which the ellipses name a valve."""
COLUMNS = ["loop", "cause", "oscillating_pct"]
NightDecision = Mapping[str, bool]


def night_rows(
    folder: Path, out: Path, columns: list[str] = COLUMNS, jobs: int = 2
) -> dict[str, dict[str, object]]:
    """The night's rows of a folder of recordings, by loop."""
    order = ["triage", "run", folder, "--loops", folder / "loops.csv", "--store", out, "--jobs", jobs]
    subprocess.run([str(part) for part in order], check=True, capture_output=True)
    store = Store(out)
    return {r["loop"]: r for name in store.nights() for r in store.rows("nights", name, columns)}


def trends(folder: Path, loop: str) -> tuple[Floats, Floats | None]:
    """Error (or PV about its mean where no SP is recorded) and OP of a recording, without gaps."""
    import pandas as pd

    held = pd.read_parquet(folder / f"{loop}.parquet")
    of = {name.rsplit(".", 1)[-1]: held[name] for name in held.columns if "." in name}
    some = (
        pd.DataFrame({role: of[role] for role in ("SP", "PV", "OP") if role in of})
        .dropna(how="all")
        .ffill()
        .dropna()
    )
    pv = some["PV"].to_numpy(float)
    error = pv - (some["SP"].to_numpy(float) if "SP" in some else pv.mean())
    return error, some["OP"].to_numpy(float) if "OP" in some else None


def regular(error: Floats) -> bool:
    """Whether the autocorrelation crosses zero at regular intervals."""
    x = error - error.mean()
    if x.size < 50 or not x.any():
        return False
    r = lag_sums(x, x.size // 2)
    at = np.flatnonzero(np.diff(np.signbit(r)))[: INTERVALS + 1]
    between = np.diff(at)
    if between.size < 3:
        return False
    return bool(between.mean() > 3.0 * max(between.std(ddof=1), 1e-9))


def ellipses(folder: Path, loops: list[str], python: Path) -> NightDecision:
    """The answer of the other package for each recording."""
    with tempfile.TemporaryDirectory() as place:
        paths = {loop: Path(place) / f"{k}.npz" for k, loop in enumerate(loops)}
        for loop, path in paths.items():
            error, op = trends(folder, loop)
            np.savez(path, op=np.zeros(error.size) if op is None else op, error=error)
        done = subprocess.run(
            [str(python), "-c", PEER, *map(str, paths.values())], check=True, capture_output=True, text=True
        )
    answers = json.loads(done.stdout)
    counts = {loop: answers[str(path)]["cycles"] for loop, path in paths.items()}
    return {loop: cycles > 0 and sticking / cycles >= SHARE for loop, (sticking, cycles) in counts.items()}


def counted(truth: NightDecision, answers: NightDecision, who: Mapping[str, str]) -> str:
    """Faults found and false alarms; a controller counts once."""
    votes: dict[str, list[tuple[bool, bool]]] = defaultdict(list)
    for loop, at_fault in truth.items():
        votes[who[loop]].append((at_fault, answers.get(loop, False)))
    of = [tuple(2 * sum(v) >= len(v) for v in zip(*pairs, strict=True)) for pairs in votes.values()]
    found, faults = sum(t and s for t, s in of), sum(t for t, _ in of)
    return f"{found} of {faults}, {sum(s and not t for t, s in of)} of {len(of) - faults}"


def labels(folder: Path, column: str) -> tuple[dict[str, bool], dict[str, str]]:
    """The label of each recording, and its controller."""
    with (folder / "labels.csv").open(encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if r[column] in ("0", "1")]
    return {r["loop"]: r[column] == "1" for r in rows}, {
        r["loop"]: r.get("controller") or r["loop"] for r in rows
    }


def row_of(folder: Path, python: Path | None, out: Path) -> list[str]:
    """A row of the table: the result of each method for a folder of recordings."""
    valves = folder.name in VALVES
    truth, who = labels(folder, "stiction" if valves else "oscillates")
    found = night_rows(folder, out)
    if not valves:
        ours = {loop: (r["oscillating_pct"] or 0.0) >= 50.0 for loop, r in found.items()}
        peer = {loop: regular(trends(folder, loop)[0]) for loop in truth}
        return [f"{folder.name}: oscillates", counted(truth, ours, who), "–", counted(truth, peer, who)]
    ours = {loop: r["cause"] == "valve" for loop, r in found.items()}
    counts = counted(truth, ellipses(folder, list(truth), python), who) if python else "–"
    return [f"{folder.name}: valve at fault", counted(truth, ours, who), counts, "–"]


def main() -> None:
    """Run all methods and write the table next to this file."""
    parser = parser_of(__doc__, folders=1)
    parser.add_argument("--peer", type=Path, help="the Python of stictionanalyser's environment")
    options = parser.parse_args()
    (place,) = options.folders
    with tempfile.TemporaryDirectory() as out:
        rows = [row_of(place / n, options.peer, Path(out) / n) for n in (*VALVES, *CYCLES)]
    about = (
        "Each cell shows the loops found of those with the label, and the false alarms of the others; recordings of "
        "a controller count once. In records of two hours at 10 s the ellipses find few cycles, and mostly none."
    )
    text = table(
        "recordings and question | triage | stictionanalyser | regularity of the autocorrelation", rows
    )
    publish(
        __file__,
        "Real recordings: comparison with open methods",
        command(__file__, "RECORDINGS", peer="PYTHON"),
        about,
        text,
    )


if __name__ == "__main__":
    main()
