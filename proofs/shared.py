"""Overrides, split ranges and batches: python -m proofs.shared [--seed 301 302 303 304] [--jobs 2]

Each plant has six overrides, six split ranges and six batch loops (proofs/shared_plant.py), twelve hours, recorded
every two seconds. The table counts right answers. Overrides: which loop has the valve (within two percent of the
time), and windup reported where an output winds up and not where it follows. Split ranges: the change-over (within
two percent of the output), and the answer to a half (within a factor of 1.35 where it is reported). Faults: those
reported at the faulty valve, of faults that increase the loop's error by .3. Batches: phases of a programme with
their repetitions. It also counts blamed loops without a fault. Writes shared.md here.
"""

from __future__ import annotations

import json
import math
import sys
from collections import Counter
from collections.abc import Mapping
from typing import Any

from analyzer.loop.decisions import Action, Cause, Fault
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import match
from proofs.common import command, command_line, publish, table
from proofs.plant import night_of
from proofs.shared_plant import EVERY, FAULT, Plant, plant

COLUMNS = (
    *(
        "loop",
        "cause",
        "valve_fault",
        "action",
        "source_loop",
        "lanes",
        "phases",
        "valve_pct",
        "split_at_pct",
    ),
    *("split_slope", "half_slope", "oscillating_pct"),
)
Row = Mapping[str, Any]
SHOWS = 1.3
"""Ratio of the error's spread to that without the fault, from which a fault shows."""


def night_rows(built: Plant, jobs: int) -> dict[str, Row]:
    """The rows of a night for the loops of a plant."""
    specs, _ = match([LoopSpec(**s) for s in built.stated], built.tags)  # type: ignore[arg-type]
    return night_of(built.tags, specs, EVERY, COLUMNS, jobs)


def of_override(row: Row, true: Row) -> dict[str, bool]:
    """Which answers are right for a loop that shares a valve."""
    out = {"share of the valve": abs((row["valve_pct"] or 0.0) - true["share"]) <= 2.0}
    winds = "windup" in (row["lanes"] or "")
    out["windup" if true["winds_up"] else "none where the output follows"] = winds == true["winds_up"]
    return out


def of_half(row: Row, true: Row) -> dict[str, bool]:
    """Which answers are right for a half of a split range."""
    out = {"change-over": abs((row["split_at_pct"] or math.inf) - true["at"]) <= 2.0}
    if row["half_slope"] is not None:
        off = abs(math.log(max(row["half_slope"] * true["lag"] / true["gain"], 1e-3)))
        out["answer to a half, where reported"] = off <= math.log(1.35)
    return out


def of_batch(row: Row, true: Row) -> dict[str, bool]:
    """Whether the answer is right for a loop with a programme: a phase that rises by the first step, in all batches
    except one."""
    found = json.loads(row["phases"] or "[]")
    rise = [p for p in found if abs(p["end"] - p["begin"] - true["rise"]) < 1.0]
    return {"phases": bool(rise) and len(rise[0]["start_s"]) >= true["batches"] - 1}


OF = {"override": of_override, "half": of_half, "batch": of_batch}


def counted(built: Plant, rows: Mapping[str, Row]) -> tuple[Counter[str], list[tuple[str, ...]]]:
    """Tested and right answers of one plant, wrong answers, and the loops with a missed or wrong answer."""
    out: Counter[str] = Counter()
    missed = []
    for loop, true in built.truth.items():
        row, kind = rows[loop], str(true["kind"])
        answers = OF[kind](row, true) if kind in OF else {}
        worn = true["cause"] in FAULT and kind != "split"
        blamed = row["cause"] == Cause.VALVE or row["valve_fault"] in (Fault.BACKLASH, Fault.STICTION)
        if worn and true["swell"] >= SHOWS:
            answers[f"worn valve of a {kind} loop"] = blamed
        for name, right in answers.items():
            out[f"tested {kind}: {name}"] += 1
            out[f"right {kind}: {name}"] += right
        wrong = {
            "valves without a fault blamed": blamed and not worn and true["cause"] not in FAULT,
            "controllers of a split range blamed for a half's valve": kind == "split" and blamed,
            "hand-overs reported as cycles": kind in ("override", "half")
            and true["cause"] == "healthy"
            and (row["oscillating_pct"] or 0.0) >= 50.0,
            "loops without a fault retuned": true["cause"] == "healthy" and row["action"] == Action.RETUNE,
        }
        out.update({f"wrong {name}": int(is_so) for name, is_so in wrong.items()})
        bad = [name for name, right in answers.items() if not right] + [k for k, v in wrong.items() if v]
        if bad:
            shown = (row["cause"], row["action"], row["source_loop"])
            missed.append((loop, f"{kind}: {true['cause']}", "; ".join(bad), *(str(x or "") for x in shown)))
    return out, missed


def main() -> None:
    """Run the plants and write the page."""
    given = command_line(__doc__, seed=[301, 302, 303, 304], jobs=2)
    total: Counter[str] = Counter()
    missed = []
    for seed in given.seed:
        built = plant(seed)
        found, more = counted(built, night_rows(built, given.jobs))
        total.update(found)
        missed += [(str(seed), *m) for m in more]
        print(f"plant {seed} done", file=sys.stderr)
    tested = sorted(k.removeprefix("tested ") for k in total if k.startswith("tested "))
    wrong = sorted(k.removeprefix("wrong ") for k in total if k.startswith("wrong "))
    publish(
        __file__,
        "Overrides, split ranges and batches",
        command(__file__, seed=given.seed),
        (__doc__ or "").split("\n\n")[1].replace("\n", " ").split(" Writes shared.md")[0],
        table("answer | tested | right", [(k, total[f"tested {k}"], total[f"right {k}"]) for k in tested]),
        table("wrong | loops", [(k, total[f"wrong {k}"]) for k in wrong]),
        "Loops with a missed or wrong answer:",
        table("plant | loop | truth | what | cause | action | source", missed),
    )


if __name__ == "__main__":
    main()
