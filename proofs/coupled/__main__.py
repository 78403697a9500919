"""Write folders of coupled plants: an export, loops.csv and truth.json each."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pandas as pd

import proofs.coupled
from proofs.common import parser_of
from proofs.coupled.draw import Drawn, draw, stamps

COLUMNS = ("loop", "type", "area", "master", "kp", "ti", "scan_s", "pv_lo", "pv_hi", "op_lo", "op_hi")


def written(folder: Path, drawn: Drawn, seed: int) -> None:
    """Write one plant."""
    folder.mkdir(parents=True, exist_ok=True)
    parts, rows = [], []
    for x in drawn.loops:
        trends = {f"{x.name}.SP": x.sp, f"{x.name}.PV": x.pv, f"{x.name}.OP": x.op}
        parts.append(pd.DataFrame(trends, index=pd.DatetimeIndex(stamps(drawn, x), name="timestamp")))
        ranges = {"pv_lo": 0, "pv_hi": 100, "op_lo": 0, "op_hi": 100}
        rows.append({"loop": x.name, "type": x.kind, "area": x.area, "master": x.master})
        rows[-1] |= {"kp": round(x.kp, 5), "ti": round(x.ti, 3), "scan_s": drawn.step_s, **ranges}
    pd.concat(parts, axis=1, sort=True).reset_index().to_parquet(folder / "export.parquet")
    with (folder / "loops.csv").open("w", newline="") as f:
        table = csv.DictWriter(f, COLUMNS)
        table.writeheader()
        table.writerows(rows)
    truth = {"seed": seed, "step_s": drawn.step_s, "loops": drawn.truth}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1))


def main() -> None:
    """Draw and write."""
    parser = parser_of(proofs.coupled.__doc__, plants=1, seed=1)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--loops", type=int)
    options = parser.parse_args()
    for seed in range(options.seed, options.seed + options.plants):
        written(options.folder / f"plant{seed}", draw(seed, options.loops), seed)


if __name__ == "__main__":
    main()
