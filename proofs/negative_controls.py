"""False alarms on records in which nothing is wrong: python -m proofs.negative_controls [--records 1000]

Writes proofs/negative_controls.md.
"""

from __future__ import annotations

from multiprocessing import Pool

import numpy as np

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.assess import judged_where
from analyzer.loop.oscillation.cycling_span import detect_where_it_cycles
from analyzer.loop.oscillation.detection import counting
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from proofs.common import command, command_line, publish, table
from proofs.nulls import FAMILIES, record


def judged(case: tuple[str, int]) -> tuple[str, bool, bool]:
    """Family, whether an oscillation was reported, whether the valve was blamed."""
    family, seed = case
    pv, op = record(family, seed)
    stamp = np.arange(pv.size, dtype=float)
    fine = np.zeros(pv.size, dtype=bool)
    series = {"L.PV": Series(stamp, pv, fine), "L.OP": Series(stamp, op, fine)}
    series["L.SP"] = Series(stamp, np.full(pv.size, 50.0), fine)
    spec = LoopSpec("L", sp="L.SP", pv="L.PV", op="L.OP", pv_lo=0.0, pv_hi=100.0)
    config = Config()
    prepared = prepare(spec, series, config.quality)
    seen, span = detect_where_it_cycles(prepared.record, config.oscillation)
    found, verdict = judged_where(prepared, seen, span, None, config, "")
    claimed = counting(found) is not None
    return family, claimed, verdict.cause == "valve"


def table_of(records: int, jobs: int) -> str:
    """A Markdown table: family, records, oscillation reported, valve blamed."""
    cases = [(family, seed) for family in FAMILIES for seed in range(records)]
    with Pool(jobs) as pool:
        results = pool.map(judged, cases, chunksize=50)
    rows = []
    for family in FAMILIES:
        mine = [r for r in results if r[0] == family]
        either = sum(o or v for _, o, v in mine)
        claimed, blamed = sum(o for _, o, _ in mine), sum(v for _, _, v in mine)
        rows.append([family, len(mine), claimed, blamed, f"{100 * either / len(mine):.2f}"])
    return table("family | records | oscillation claimed | valve blamed | either %", rows)


def main() -> None:
    """Run all records and write the table next to this file."""
    options = command_line(__doc__, records=1000, jobs=2)
    text = table_of(options.records, options.jobs)
    publish(__file__, "Negative controls", command(__file__, records=options.records), text)


if __name__ == "__main__":
    main()
