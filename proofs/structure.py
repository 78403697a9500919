"""Cascades and ratios identified from trends alone: python -m proofs.structure [--seed 201 202 203 204 205 206]
[--jobs 2]

Each plant has ten cascades, four ratios and eight single loops (proofs/structure_plant.py), ten hours, recorded every
two seconds; loops.csv states no master. The table counts the masters and leaders that are reported, and reported
links of loops that depend on no loop or on another one. It counts faults reported at the right loop, of faults that
increase the loop's error by .3. It also counts three kinds of false alarms. They are a valve fault of a master, which
has no valve; a blamed valve without a fault; and new settings for a loop without a fault. Writes structure.md here.
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
"""The cause of a loop with its own fault, by kind of unit, fault, and place in the unit."""
SHOWS = 1.3
"""Ratio of the error's spread to that without the fault, from which a fault shows."""


def night_rows(built: Plant, jobs: int) -> dict[str, Mapping[str, Any]]:
    """The rows of a night for the loops of a plant."""
    stated = [
        spec(str(s["loop"]), str(s["type"]), **{k: s[k] for k in ("pv_lo", "pv_hi", "kp", "ti")})
        for s in built.stated
    ]
    return night_of(built.tags, stated, built.every_s, COLUMNS, jobs)


def counted(
    built: Plant, rows: Mapping[str, Mapping[str, Any]]
) -> tuple[Counter[str], list[tuple[str, ...]]]:
    """Right and wrong answers for one plant, and the loops with a wrong answer."""
    out: Counter[str] = Counter()
    missed = []
    for loop, true in built.truth.items():
        row, before = rows[loop], out.copy()
        for column, name in (("master", "masters"), ("ratio_of", "leaders")):
            if true[column]:
                out[name] += 1
                out[f"{name} reported"] += row[column] == true[column]
            out["links that do not exist"] += bool(row[column]) and row[column] != true[column]
        kind, part = str(true["kind"]), int(str(true["part"]))
        fault = FAULT.get((kind, str(true["cause"]), part))
        fault = fault if float(str(true["swell"])) >= SHOWS else None
        name = f"{kind}: {true['cause']}"
        if fault is not None:
            out[f"fault {name}"] += 1
            out[f"right {name}"] += row["cause"] == fault
        out["masters with a reported valve fault"] += (
            kind == "cascade" and part == 0 and row["cause"] == Cause.VALVE
        )
        blamed = row["cause"] == Cause.VALVE or row["valve_fault"] in (Fault.BACKLASH, Fault.STICTION)
        out["valves without a fault blamed"] += blamed and not true["worn"]
        out["loops without a fault retuned"] += true["swell"] == 1.0 and row["action"] == Action.RETUNE
        bad = (
            "links that do not exist",
            "masters with a reported valve fault",
            "valves without a fault blamed",
            "loops without a fault retuned",
        )
        if any(out[k] > before[k] for k in bad) or (fault is not None and row["cause"] != fault):
            shown = (row["cause"], row["action"], row["source_loop"], row["master"] or row["ratio_of"])
            missed.append((loop, name, *(str(x or "") for x in shown)))
    return out, missed


def main() -> None:
    """Run the plants and write the page."""
    given = command_line(__doc__, seed=[201, 202, 203, 204, 205, 206], jobs=2)
    total: Counter[str] = Counter()
    missed = []
    for seed in given.seed:
        built = plant(seed)
        found, more = counted(built, night_rows(built, given.jobs))
        total += found
        missed += [(str(seed), *m) for m in more]
        print(f"plant {seed} done", file=sys.stderr)
    faults = sorted(k.removeprefix("fault ") for k in total if k.startswith("fault "))
    bad = (
        "links that do not exist",
        "masters with a reported valve fault",
        "valves without a fault blamed",
        "loops without a fault retuned",
    )
    loops = len(given.seed) * 36
    publish(
        __file__,
        "Cascades and ratios identified from trends alone",
        command(__file__, seed=given.seed),
        (__doc__ or "").split("\n\n")[1].replace("\n", " ").split(" Writes structure.md")[0],
        f"{loops} loops. Masters reported: {total['masters reported']} of {total['masters']}; leaders of a ratio: "
        f"{total['leaders reported']} of {total['leaders']}.",
        table("fault | loops | reported", [(k, total[f"fault {k}"], total[f"right {k}"]) for k in faults]),
        table("wrong | loops", [(k, total[k]) for k in bad]),
        "Loops with a missed or wrong answer:",
        table("plant | loop | truth | cause | action | source | depends on", missed),
    )


if __name__ == "__main__":
    main()
