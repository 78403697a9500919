"""Write a folder of untidy loops: an export for each, loops.csv and truth.json."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd

import proofs.untidy
from proofs.common import parser_of
from proofs.untidy.draw import Drawn, draw

COLUMNS = ("loop", "type", "scan_s", "pv_lo", "pv_hi", "op_lo", "op_hi", "kp", "ti")


def written(folder: Path, name: str, drawn: Drawn) -> dict[str, object]:
    """Write one loop's export; its row of loops.csv."""
    stamp = pd.Timestamp("2026-03-02") + pd.to_timedelta(np.arange(drawn.pv.size) * drawn.step_s, unit="s")
    trends = {f"{name}.PV": drawn.pv, f"{name}.OP": drawn.op}
    if drawn.truth["sp_known"]:
        trends[f"{name}.SP"] = drawn.sp
    pd.DataFrame({"timestamp": stamp, **trends}).to_parquet(folder / f"{name}.parquet")
    row = {"loop": name, "type": drawn.kind, "op_lo": 0, "op_hi": 100}
    if drawn.truth["known"]:
        row.update(scan_s=1.0, pv_lo=0, pv_hi=100, kp=drawn.plant.kp, ti=drawn.plant.ti)
    return row


def main() -> None:
    """Draw and write."""
    parser = parser_of(proofs.untidy.__doc__, loops=90, seed=1)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    truth, rows = {}, []
    for k in range(options.loops):
        name, drawn = f"U{options.seed}{k:04d}", draw(100_000 * options.seed + k)
        rows.append(written(options.folder, name, drawn))
        truth[name] = {**drawn.truth, "plant": asdict(drawn.plant)}
    with (options.folder / "loops.csv").open("w", newline="") as f:
        table = csv.DictWriter(f, COLUMNS)
        table.writeheader()
        table.writerows(rows)
    (options.folder / "truth.json").write_text(json.dumps(truth, indent=1))


if __name__ == "__main__":
    main()
