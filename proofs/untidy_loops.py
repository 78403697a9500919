"""What is found and reported on untidy loops: python -m proofs.untidy_loops [--loops 300] [--seed 4]

The loops are those of proofs/untidy, of seeds that set no threshold (1 to 3 did). A loop shows its cause where the
error is 1.5 times as large as without it, in three quarters of the record, over five cycles of four samples, with a
rhythm of at least .15. The cause is clear where the error is twice as large, with eight samples per cycle and without
compression. Writes proofs/untidy_loops.md.
"""

from __future__ import annotations

from dataclasses import replace
from multiprocessing import Pool

import numpy as np

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.assess import judged_where
from analyzer.loop.oscillation.cycling_span import detect_where_it_cycles
from analyzer.loop.oscillation.detection import counting
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loops.spec import LoopSpec
from identification.models import Pid
from proofs.common import command, command_line, publish, table
from proofs.untidy.draw import CAUSES, Drawn, draw

NAMED = {"stiction": "valve", "backlash": "valve", "tuning": "tuning", "load": "load", "healthy": "none"}
VERDICTS = ("valve", "tuning", "load", "undecided", "none")


def shows(drawn: Drawn) -> bool:
    """Whether the cause shows in the recorded error."""
    t = drawn.truth
    clear_ones = t["swell"] >= 1.5 and t["steady"] >= 0.75 and t["rhythm"] >= 0.15
    return t["cause"] == "healthy" or (clear_ones and t["cycles"] >= 5 and t["samples_a_cycle"] >= 4)


def clear(drawn: Drawn) -> bool:
    """Whether it shows so clearly that the cause should be reported."""
    t = drawn.truth
    return shows(drawn) and t["swell"] >= 2 and t["samples_a_cycle"] >= 8 and not t["packed"]


def judged(seed: int) -> tuple[str, bool, bool, bool, str]:
    """Cause, whether it shows, whether it is clear, whether an oscillation is found, named cause."""
    drawn, config = draw(seed), Config()
    prepared, stated = recorded(drawn, config)
    seen, span = detect_where_it_cycles(prepared.record, config.oscillation)
    found, verdict = judged_where(prepared, seen, span, stated, config, drawn.kind)
    return drawn.truth["cause"], shows(drawn), clear(drawn), counting(found) is not None, verdict.cause


def recorded(drawn: Drawn, config: Config) -> tuple[Prepared, Pid | None]:
    """A drawn loop as a night reads it, with its controller where that is stated."""
    t = drawn.truth
    stamp = drawn.step_s * np.arange(drawn.pv.size)
    fine = np.zeros(drawn.pv.size, dtype=bool)
    series = {
        f"L.{n}": Series(stamp, x, fine) for n, x in (("PV", drawn.pv), ("OP", drawn.op), ("SP", drawn.sp))
    }
    spec = LoopSpec("L", pv="L.PV", op="L.OP", sp="L.SP" if t["sp_known"] else None)
    spec = replace(spec, pv_lo=0.0, pv_hi=100.0) if t["known"] else spec
    stated = Pid(drawn.plant.kp, drawn.plant.ti, scan_s=1.0) if t["known"] else None
    return prepare(spec, series, config.quality), stated


def table_of(results: list[tuple[str, bool, bool, bool, str]]) -> str:
    """A Markdown table: cause, loops that show it, found, clear loops, and the causes named for these."""
    rows = []
    for cause in CAUSES:
        mine = [r for r in results if r[0] == cause and r[1]]
        clear_ones = [r for r in mine if r[2] or cause == "healthy"]
        named = [sum(r[4] == s for r in clear_ones) for s in VERDICTS]
        rows.append([cause, len(mine), sum(r[3] for r in mine), len(clear_ones), *named])
    ill = [r for r in results if r[0] != "healthy"]
    right = sum(r[2] and r[4] == NAMED[r[0]] for r in ill)
    heads = " | ".join(["cause | show it | oscillation found | clear", *(f"named {s}" for s in VERDICTS)])
    found = f"Found {sum(r[1] and r[3] for r in ill)} of {sum(r[1] for r in ill)}"
    right_of = f"cause right {right} of {sum(r[2] for r in ill)} clear ones."
    return f"{table(heads, rows)}\n\n{found}; {right_of}"


def main() -> None:
    """Assess all loops and write the table next to this file."""
    options = command_line(__doc__, loops=300, seed=4, jobs=2)
    seeds = [100_000 * options.seed + k for k in range(options.loops)]
    with Pool(options.jobs) as pool:
        text = table_of(pool.map(judged, seeds, chunksize=10))
    publish(__file__, "Untidy loops", command(__file__, loops=options.loops, seed=options.seed), text)


if __name__ == "__main__":
    main()
