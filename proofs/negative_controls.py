"""False alarms on records in which nothing is wrong: python -m proofs.negative_controls [--records 1000]

Writes proofs/negative_controls.md.
"""

from __future__ import annotations

import argparse
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.assess import convicted
from analyzer.loop.oscillation import counting, detect
from analyzer.loop.quality import prepare
from analyzer.loops.spec import LoopSpec
from proofs.nulls import FAMILIES, record

OUT = Path(__file__).with_suffix(".md")


def judged(case: tuple[str, int]) -> tuple[str, bool, bool]:
    """Family, whether an oscillation was claimed, whether the valve was blamed."""
    family, seed = case
    pv, op = record(family, seed)
    stamp = np.arange(pv.size, dtype=float)
    fine = np.zeros(pv.size, dtype=bool)
    series = {"L.PV": Series(stamp, pv, fine), "L.OP": Series(stamp, op, fine)}
    series["L.SP"] = Series(stamp, np.full(pv.size, 50.0), fine)
    spec = LoopSpec("L", sp="L.SP", pv="L.PV", op="L.OP", pv_lo=0.0, pv_hi=100.0)
    config = Config()
    prepared = prepare(spec, series, config.quality)
    seen = detect(prepared.record, config.oscillation)
    found, verdict = convicted(prepared, seen, None, config, "")
    claimed = counting(found) is not None
    return family, claimed, verdict.cause == "valve"


def table(records: int, jobs: int) -> str:
    """A Markdown table: family, records, oscillation claimed, valve blamed."""
    cases = [(family, seed) for family in FAMILIES for seed in range(records)]
    with Pool(jobs) as pool:
        results = pool.map(judged, cases, chunksize=50)
    lines = ["| family | records | oscillation claimed | valve blamed | either % |", "|---|---|---|---|---|"]
    for family in FAMILIES:
        mine = [r for r in results if r[0] == family]
        either = sum(o or v for _, o, v in mine)
        claimed, blamed = sum(o for _, o, _ in mine), sum(v for _, _, v in mine)
        lines.append(f"| {family} | {len(mine)} | {claimed} | {blamed} | {100 * either / len(mine):.2f} |")
    return "\n".join(lines)


def main() -> None:
    """Run all records and write the table beside this file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    text = table(options.records, options.jobs)
    command = f"python -m proofs.negative_controls --records {options.records}"
    OUT.write_text(f"# Negative controls\n\n`{command}`\n\n{text}\n")
    print(text)


if __name__ == "__main__":
    main()
