"""Cascades and ratios told from trends alone: python -m proofs.structure [--seed 201 202 203 204 205 206] [--jobs 2]

Plants of ten cascades, four ratios and eight lone loops (proofs/structure_plant.py), ten hours every two seconds;
loops.csv states no master. Counted are masters and leaders that are told, those told of loops that hang on nothing
or on another; faults told where they are, of those that swell the loop's error by .3; and what is blamed that is
sound: masters of a valve, for they have none, loops whose valve is sound, and loops without a fault that are to be
retuned. Writes structure.md here.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping
from typing import Any

from analyzer.loop.decisions import Action, Cause, Fault
from proofs.common import command, command_line, publish, table
from proofs.plant import night_of, spec
from proofs.structure_plant import Plant, plant

COLUMNS = ("loop", "cause", "valve_fault", "action", "source_loop", "master", "ratio_of", "kp_new")
FAULT = {
    ("cascade", "stick", 1): Cause.VALVE,
    ("cascade", "play", 1): Cause.VALVE,
    ("cascade", "tight master", 0): Cause.TUNING,
    ("cascade", "tight slave", 1): Cause.TUNING,
    ("ratio", "stick", 0): Cause.VALVE,
    ("lone", "stick", 0): Cause.VALVE,
    ("lone", "play", 0): Cause.VALVE,
}
"""The cause of a loop that has a fault of its own, by kind of unit, what is wrong with it, and place in it."""
SHOWS = 1.3
"""Spread of the error over that without the fault from which a fault shows."""


def told(built: Plant, jobs: int) -> dict[str, Mapping[str, Any]]:
    """What a night tells of a plant's loops."""
    stated = [
        spec(str(s["loop"]), str(s["type"]), **{k: s[k] for k in ("pv_lo", "pv_hi", "kp", "ti")})
        for s in built.stated
    ]
    return night_of(built.tags, stated, built.every_s, COLUMNS, jobs)


def counted(
    built: Plant, rows: Mapping[str, Mapping[str, Any]]
) -> tuple[Counter[str], list[tuple[str, ...]]]:
    """What is right and wrong in one plant, and the loops of which something is wrong."""
    out: Counter[str] = Counter()
    missed = []
    for loop, true in built.truth.items():
        row, before = rows[loop], out.copy()
        for column, name in (("master", "masters"), ("ratio_of", "leaders")):
            if true[column]:
                out[name] += 1
                out[f"{name} told"] += row[column] == true[column]
            out["links that are not"] += bool(row[column]) and row[column] != true[column]
        kind, part = str(true["kind"]), int(str(true["part"]))
        fault = FAULT.get((kind, str(true["cause"]), part))
        fault = fault if float(str(true["swell"])) >= SHOWS else None
        name = f"{kind}: {true['cause']}"
        if fault is not None:
            out[f"fault {name}"] += 1
            out[f"right {name}"] += row["cause"] == fault
        out["masters told a valve"] += kind == "cascade" and part == 0 and row["cause"] == Cause.VALVE
        blamed = row["cause"] == Cause.VALVE or row["valve_fault"] in (Fault.BACKLASH, Fault.STICTION)
        out["sound valves blamed"] += blamed and not true["worn"]
        out["sound loops retuned"] += true["swell"] == 1.0 and row["action"] == Action.RETUNE
        bad = ("links that are not", "masters told a valve", "sound valves blamed", "sound loops retuned")
        if any(out[k] > before[k] for k in bad) or (fault is not None and row["cause"] != fault):
            said = (row["cause"], row["action"], row["source_loop"], row["master"] or row["ratio_of"])
            missed.append((loop, name, *(str(x or "") for x in said)))
    return out, missed


def main() -> None:
    """Run the plants and write the page."""
    given = command_line(__doc__, seed=[201, 202, 203, 204, 205, 206], jobs=2)
    total: Counter[str] = Counter()
    missed = []
    for seed in given.seed:
        built = plant(seed)
        found, more = counted(built, told(built, given.jobs))
        total += found
        missed += [(str(seed), *m) for m in more]
        print(f"plant {seed} done", file=sys.stderr)
    faults = sorted(k.removeprefix("fault ") for k in total if k.startswith("fault "))
    bad = ("links that are not", "masters told a valve", "sound valves blamed", "sound loops retuned")
    loops = len(given.seed) * 36
    publish(
        __file__,
        "Cascades and ratios told from trends alone",
        command(__file__, seed=given.seed),
        (__doc__ or "").split("\n\n")[1].replace("\n", " ").split(" Writes structure.md")[0],
        f"{loops} loops. Masters told: {total['masters told']} of {total['masters']}; leaders of a ratio: "
        f"{total['leaders told']} of {total['leaders']}.",
        table("fault | loops | told", [(k, total[f"fault {k}"], total[f"right {k}"]) for k in faults]),
        table("wrong | loops", [(k, total[k]) for k in bad]),
        "Loops of which something is missed or wrong:",
        table("plant | loop | truth | cause | action | source | hangs on", missed),
    )


if __name__ == "__main__":
    main()
