"""The indices of the literature on all labelled data: python -m proofs.field_indices SHARED [--seed 16 17] [--each 8]

Worn valves found and sound ones blamed by each index at its published limits, beside this tool's own answer. SHARED
holds recordings/isdb and refinery (labelled by people; a controller counts once, by majority of what its recordings
say), plants and wild (simulated, a and b); the world is benchmarks/world. A worn valve counts where its fault shows:
by the rules of the simulated data's own scoring (the spread of the error at 1.5 times that without the fault, and a
rhythm). Sound are all other loops, whatever makes them swing. Writes field_indices.md here.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.loop.decisions import Cause, Fault, Status, counts
from analyzer.words.decision import indices
from benchmarks.world.__main__ import told as world_rows
from benchmarks.world.draw import KINDS, drawn, run
from benchmarks.world.recorder import recorded
from proofs.common import command, parser_of, publish, table
from proofs.field_peer import asked, labels

COLUMNS = [
    "loop",
    "status",
    "cause",
    "valve_fault",
    "oscillating_pct",
    "action",
    "field_indices",
    "harris_index",
]
SOURCES = {
    "horch": "Horch 1999, Control Eng. Practice 7, 1221–1231: lags above 2/3 and heights above 1/3; no levels",
    "kano": "Kano, Maruta, Kugemoto, Shimizu 2004, DYCOPS, method A: 1/4 is ours; flows",
    "choudhury": "Choudhury, Shah, Thornhill 2004, Automatica 40, 1719–1728: NGI above .001, NLI above .01",
    "yamashita": "Yamashita 2006, Control Eng. Practice 14, 503–510: rho 1 and rho 3 above 1/4; flows",
    "he": "He, Wang, Pottmann, Qin 2007, Ind. Eng. Chem. Res. 46, 4549–4560: above .6; undecided from .4",
}
"""Indices of a valve, with their limits."""
MEASURES = {
    "hagglund": "Hägglund 1995, Control Eng. Practice 3, 1543–1551: more than 10 load disturbances within 50 Ti",
    "idle": "Hägglund 1999, Control Eng. Practice 7, 1505–1511: above .25, ours",
    "ellipse": "Choudhury, Shah, Thornhill, Shook 2006, Control Eng. Practice 14, 1395–1412",
    "harris": "Harris 1989, Can. J. Chem. Eng. 67, 856–861",
}
WORN = ("backlash", "stiction")
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Labelled:
    """A loop and what is known of it: the data it is of; whose it is; whether its valve is worn, and whether it
    oscillates, None where neither is to be asked; what was put into it; the true width [% OP], 0 unknown."""

    data: str
    who: str
    row: Row
    worn: bool | None
    oscillates: bool | None = None
    kind: str = ""
    width: float = 0.0

    def finds(self, index: str) -> bool | str | None:
        """What an index says: True, False, None where undecided, 'abstains'."""
        ours = {
            "triage: cause": (self.row["cause"], (Cause.VALVE,)),
            "triage: valve_fault": (self.row["valve_fault"], WORN),
        }
        if index == "triage: oscillates" or index in ours:
            if self.row["status"] != Status.OK:
                return "abstains"
            if index not in ours:
                return counts(self.row["oscillating_pct"] or 0.0)
            said, faults = ours[index]
            return None if said == Fault.UNDECIDED else said in faults
        found = {x["index"]: x["finds"] for x in indices(self.row)}
        return found.get(index, "abstains")

    def value(self, index: str) -> float | None:
        """The first value of an index."""
        return next((x["values"][0] for x in indices(self.row) if x["index"] == index), None)


def recordings(folder: Path, out: Path, jobs: int) -> list[Labelled]:
    """Real recordings whose valves are labelled."""
    worn, who = labels(folder, "stiction")
    rows = asked(folder, out, COLUMNS, jobs)
    return [Labelled(folder.name, who[loop], rows[loop], at_fault) for loop, at_fault in worn.items()]


def plant_shows(t: Row) -> bool:
    """Whether a loop of plants shows its cause: as shared/score/plant.py."""
    return bool(t["swell"] >= 1.5 and t["rhythm"] >= 0.3)


def wild_shows(t: Row) -> bool:
    """Whether a loop of wild does: as shared/score/wild.py."""
    whole = t["cycles"] >= 5 and t["samples_a_cycle"] >= 4 and t["steady"] >= 0.75
    return bool(whole and t["swell"] >= 1.5 and t["rhythm"] >= 0.15)


def simulated(folder: Path, out: Path, jobs: int, shows: Callable[[Row], bool]) -> list[Labelled]:
    """Simulated loops with their truth."""
    truth = json.loads((folder / "truth.json").read_text("utf-8"))
    made = []
    for loop, row in asked(folder, out, COLUMNS, jobs).items():
        t = truth.get("loops", truth)[loop]
        calm = t["cause"] in ("healthy", "sluggish")
        worn, shown = t["cause"].startswith(WORN), not calm and shows(t)
        swings = None if not calm and not shown else shown
        ask = None if worn and not shown else worn
        made.append(Labelled(folder.parent.name, loop, row, ask, swings, t["cause"]))
    return made


def world(seeds: Sequence[int], each: int, jobs: int) -> list[Labelled]:
    """Loops of benchmarks/world, whose faults all show."""
    made = []
    for seed in seeds:
        for kind in KINDS:
            loops = drawn(seed, each, (kind,))
            rows = world_rows(
                loops, {d.name: recorded(run(d), "plain", d.seed) for d in loops}, jobs, COLUMNS
            )
            data = "world, under a sine" if kind == "worn-sine" else "world"
            made += [
                Labelled(data, f"{seed} {d.name}", rows[d.name], d.fault != "none",
                         kind not in ("healthy", "sluggish"), kind, d.valve.band)
                for d in loops
            ]  # fmt: skip
        print(f"world {seed} done", file=sys.stderr)
    return made


def counted(loops: Sequence[Labelled], index: str) -> str:
    """What an index says of loops, a controller once: found, undecided, abstained, of all."""
    votes: dict[str, Counter[Any]] = defaultdict(Counter)
    for x in loops:
        votes[x.who][x.finds(index)] += 1
    said: Counter[Any] = Counter()
    for of in votes.values():
        told = of[True] + of[False]
        said[of[True] >= of[False] if told else None if of[None] else "abstains"] += 1
    return f"{said[True]}, {said[None]}, {said['abstains']} of {len(votes)}"


def by_data(loops: Sequence[Labelled], names: Sequence[str], kept: Callable[[Labelled], bool]) -> str:
    """A table of indices over sets of data."""
    sets = list(dict.fromkeys(x.data for x in loops if kept(x)))
    rows = [[n, *(counted([x for x in loops if x.data == d and kept(x)], n) for d in sets)] for n in names]
    return table(f"index | {' | '.join(sets)}", rows, numbers=True)


def measured(loops: Sequence[Labelled]) -> str:
    """What the indices without a line are of each kind of loop of the world: median and tenths at both ends."""
    made: dict[str, list[str]] = {}
    for kind in KINDS:
        own = [x for x in loops if x.kind == kind and x.data.startswith("world")]
        found = {n: [(v, x.width) for x in own if (v := x.value(n)) is not None] for n in MEASURES}
        ratios = [v / width for v, width in found["ellipse"] if width > 0.0]
        cells = {n: [v for v, _ in pairs] for n, pairs in found.items()} | {"ratio": ratios}
        made[kind] = [
            "{1:.2g} ({0:.2g} to {2:.2g})".format(*np.quantile(v, (0.1, 0.5, 0.9))) if v else "–"
            for v in cells.values()
        ]
    heads = "loop | Hägglund's count | idle | ellipse % OP | Harris | ellipse over the true width"
    return table(heads, [(kind, *cells) for kind, cells in made.items()], numbers=True)


def main() -> None:
    """Ask all data and write the table beside this file."""
    parser = parser_of(__doc__, folders=1, seed=[16, 17], each=8, jobs=2)
    options = parser.parse_args()
    (place,) = options.folders
    loops: list[Labelled] = []
    with tempfile.TemporaryDirectory() as out:
        for name in ("isdb", "refinery"):
            loops += recordings(place / "recordings" / name, Path(out) / name, options.jobs)
        for name, shows in (("plants", plant_shows), ("wild", wild_shows)):
            for part in "ab":
                folder, store = place / name / part, Path(out) / f"{name}-{part}"
                loops += simulated(folder, store, options.jobs, shows)
                print(f"{name} {part} done", file=sys.stderr)
    loops += world(options.seed, options.each, options.jobs)
    valves = [*SOURCES, "triage: valve_fault", "triage: cause"]
    cycles = ["hagglund", "triage: oscillates"]
    publish(
        __file__,
        "The literature's indices on all labelled data",
        command(__file__, "SHARED", seed=options.seed, each=options.each),
        (__doc__ or "").split("\n\n")[1].replace("\n", " ").split(" Writes ")[0],
        "An index abstains where its own conditions are not met: no cycle found, too few of its samples or cycles, "
        "compressed trends, a level where it is of flows, no integral time where it needs one.",
        "## Worn valves: found, undecided, abstained, of all",
        by_data(loops, valves, lambda x: x.worn is True),
        "## Sound valves: blamed, undecided, abstained, of all",
        by_data(loops, valves, lambda x: x.worn is False),
        "## Loops that oscillate: found, undecided, abstained, of all",
        by_data(loops, cycles, lambda x: x.oscillates is True),
        "## Loops that do not: called oscillating, undecided, abstained, of all",
        by_data(loops, cycles, lambda x: x.oscillates is False),
        "## Sluggish loops, and all others: called sluggish, undecided, abstained, of all",
        by_data(loops, ["idle"], lambda x: x.kind == "sluggish"),
        by_data(loops, ["idle"], lambda x: x.kind not in ("", "sluggish")),
        "## Measures, by kind of loop of the world: median (tenth and nine tenths)",
        measured(loops),
        "## Sources and limits",
        table("index | source", [*SOURCES.items(), *MEASURES.items()]),
    )


if __name__ == "__main__":
    main()
