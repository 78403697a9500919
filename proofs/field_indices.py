"""The indices of the literature on all labelled data: python -m proofs.field_indices SHARED [--seed 16 17] [--each 8]

The tables compare each index, at its published limits, with the answer of this tool: worn valves found, and other
valves blamed. SHARED holds recordings/isdb and refinery, plants and wild. The first two are labelled by people; a
controller counts once, by the majority of its recordings. Plants and wild are simulated (a and b); the world is
benchmarks/world. A worn valve counts where its fault shows, by the rules that score the simulated data. By these
rules the spread of the error is 1.5 times that without the fault, and the error has a rhythm. All other loops are
without a valve fault, also where they oscillate. Writes field_indices.md here.
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
from benchmarks.world.__main__ import night_rows as world_rows
from benchmarks.world.draw import KINDS, drawn, run
from benchmarks.world.recorder import recorded
from proofs.common import command, parser_of, publish, table
from proofs.field_peer import labels, night_rows

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
    """A loop and its truth: data set, controller, row of the night, whether its valve is worn and whether it
    oscillates (None: not counted), its simulated cause, and the true width [% OP] (0: unknown)."""

    data: str
    who: str
    row: Row
    worn: bool | None
    oscillates: bool | None = None
    kind: str = ""
    width: float = 0.0

    def finds(self, index: str) -> bool | str | None:
        """The answer of an index: True, False, None where undecided, 'abstains'."""
        ours = {
            "triage: cause": (self.row["cause"], (Cause.VALVE,)),
            "triage: valve_fault": (self.row["valve_fault"], WORN),
        }
        if index == "triage: oscillates" or index in ours:
            if self.row["status"] != Status.OK:
                return "abstains"
            if index not in ours:
                return counts(self.row["oscillating_pct"] or 0.0)
            answer, faults = ours[index]
            return None if answer == Fault.UNDECIDED else answer in faults
        found = {x["index"]: x["finds"] for x in indices(self.row)}
        return found.get(index, "abstains")

    def value(self, index: str) -> float | None:
        """The first value of an index."""
        return next((x["values"][0] for x in indices(self.row) if x["index"] == index), None)


def recordings(folder: Path, out: Path, jobs: int) -> list[Labelled]:
    """Real recordings whose valves are labelled."""
    worn, who = labels(folder, "stiction")
    rows = night_rows(folder, out, COLUMNS, jobs)
    return [Labelled(folder.name, who[loop], rows[loop], at_fault) for loop, at_fault in worn.items()]


def plant_shows(t: Row) -> bool:
    """Whether a loop of plants shows its cause, as in shared/score/plant.py."""
    return bool(t["swell"] >= 1.5 and t["rhythm"] >= 0.3)


def wild_shows(t: Row) -> bool:
    """Whether a loop of wild shows its cause, as in shared/score/wild.py."""
    whole = t["cycles"] >= 5 and t["samples_a_cycle"] >= 4 and t["steady"] >= 0.75
    return bool(whole and t["swell"] >= 1.5 and t["rhythm"] >= 0.15)


def simulated(folder: Path, out: Path, jobs: int, shows: Callable[[Row], bool]) -> list[Labelled]:
    """Simulated loops with their truth."""
    truth = json.loads((folder / "truth.json").read_text("utf-8"))
    made = []
    for loop, row in night_rows(folder, out, COLUMNS, jobs).items():
        t = truth.get("loops", truth)[loop]
        steady = t["cause"] in ("healthy", "sluggish")
        worn, shown = t["cause"].startswith(WORN), not steady and shows(t)
        swings = None if not steady and not shown else shown
        counted_as = None if worn and not shown else worn
        made.append(Labelled(folder.parent.name, loop, row, counted_as, swings, t["cause"]))
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
    """Counts of an index over loops, one for each controller: found, undecided, abstained, of all."""
    votes: dict[str, Counter[Any]] = defaultdict(Counter)
    for x in loops:
        votes[x.who][x.finds(index)] += 1
    answers: Counter[Any] = Counter()
    for of in votes.values():
        decided = of[True] + of[False]
        answers[of[True] >= of[False] if decided else None if of[None] else "abstains"] += 1
    return f"{answers[True]}, {answers[None]}, {answers['abstains']} of {len(votes)}"


def by_data(loops: Sequence[Labelled], names: Sequence[str], selected: Callable[[Labelled], bool]) -> str:
    """A table of indices over sets of data."""
    sets = list(dict.fromkeys(x.data for x in loops if selected(x)))
    rows = [
        [n, *(counted([x for x in loops if x.data == d and selected(x)], n) for d in sets)] for n in names
    ]
    return table(f"index | {' | '.join(sets)}", rows, numbers=True)


def measured(loops: Sequence[Labelled]) -> str:
    """Values of the indices without a limit, for each kind of loop of the world: median, first and last decile."""
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
    """Assess all data and write the table next to this file."""
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
        "An index abstains where its own conditions are not met. Examples are no cycle found, too few samples or "
        "cycles, compressed trends, a level where the index is for flows, and a missing integral time.",
        "## Worn valves: found, undecided, abstained, of all",
        by_data(loops, valves, lambda x: x.worn is True),
        "## Valves without a fault: blamed, undecided, abstained, of all",
        by_data(loops, valves, lambda x: x.worn is False),
        "## Loops that oscillate: found, undecided, abstained, of all",
        by_data(loops, cycles, lambda x: x.oscillates is True),
        "## Loops that do not oscillate: called oscillating, undecided, abstained, of all",
        by_data(loops, cycles, lambda x: x.oscillates is False),
        "## Sluggish loops, and all other loops: called sluggish, undecided, abstained, of all",
        by_data(loops, ["idle"], lambda x: x.kind == "sluggish"),
        by_data(loops, ["idle"], lambda x: x.kind not in ("", "sluggish")),
        "## Measures, by kind of loop of the world: median (first and last decile)",
        measured(loops),
        "## Sources and limits",
        table("index | source", [*SOURCES.items(), *MEASURES.items()]),
    )


if __name__ == "__main__":
    main()
