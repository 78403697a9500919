"""Whether `run` and `explain` name one valve fault: python -m proofs.agreement FOLDER ... [--jobs 2]

The folders hold recordings as ../shared/recordings does (one export for each recording, and loops.csv). Both commands
assess each recording as a whole. The table covers the recordings on which `run` or `explain` names backlash or
stick-slip. It counts where both name the same fault, where the second names another valve fault, and where it names
none. Writes proofs/agreement.md.
"""

from __future__ import annotations

from collections import Counter
from functools import partial
from multiprocessing import Pool
from pathlib import Path

from analyzer import api
from analyzer.api import PlantLoop
from analyzer.loop.decisions import Cause
from identification.errors import NotAssessedError
from proofs.common import command, command_line, publish

FAULTS = ("stiction", "backlash")
Row = tuple[str, str, str]
"""Recording, fault named by `run`, fault named by `explain`."""


def named_by_run(loop: PlantLoop) -> str:
    """The valve fault of `run`, or its cause where it names no valve fault."""
    try:
        verdict = api.assess(loop).verdict
    except NotAssessedError:
        return "abstained"
    return str(verdict.fault if verdict.cause is Cause.VALVE else verdict.cause)


def named_by_explain(loop: PlantLoop) -> str:
    """The verdict of `explain`."""
    try:
        return str(api.explain(loop).said.verdict)
    except NotAssessedError:
        return "abstained"


def answers(path: Path, loops: Path) -> Row:
    """Both answers for one recording."""
    loop = api.read(path, loops=loops).loop(path.stem)
    return path.stem, named_by_run(loop), named_by_explain(loop)


def table(sets: dict[str, list[Row]]) -> str:
    """Counts of each folder, and the recordings on which the two differ."""
    lines = [
        "| recordings | either names a valve fault | the same | another | named by run alone | by explain alone |",
        "|---|---|---|---|---|---|",
    ]
    differing: list[Row] = []
    for name, rows in sets.items():
        either = [r for r in rows if r[1] in FAULTS or r[2] in FAULTS]
        kinds: Counter[str] = Counter()
        for r in either:
            both = r[1] in FAULTS and r[2] in FAULTS
            kinds[
                "same" if r[1] == r[2] else "other" if both else "run" if r[1] in FAULTS else "explain"
            ] += 1
        counts = (len(either), kinds["same"], kinds["other"], kinds["run"], kinds["explain"])
        lines.append(f"| {name} ({len(rows)}) | " + " | ".join(str(c) for c in counts) + " |")
        differing += [r for r in either if r[1] != r[2]]
    lines += [
        "",
        *(f"- {name}: run {by_run}, explain {by_explain}" for name, by_run, by_explain in differing),
    ]
    return "\n".join(lines)


def main() -> None:
    """Run both commands on all recordings and write the table next to this file."""
    options = command_line(__doc__, folders="+", jobs=2)
    sets = {}
    with Pool(options.jobs) as pool:
        for folder in options.folders:
            answers_of = partial(answers, loops=folder / "loops.csv")
            sets[folder.name] = pool.map(answers_of, sorted(folder.glob("*.parquet")), chunksize=1)
    text = table(sets)
    places = (f"../shared/recordings/{f.name}" for f in options.folders)
    publish(__file__, "What run and explain name", command(__file__, *places), text)


if __name__ == "__main__":
    main()
