"""Cause, fault and settings on loops of an independent generator: python -m benchmarks.world --seed 1 --each 8
[--ways plain ...]"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loops.spec import LoopSpec
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.store.store import Store
from benchmarks.world.draw import KINDS, Drawn, drawn, run
from benchmarks.world.recorder import Recording, recorded
from proofs.common import command_line, table

START_US = 1_772_409_600_000_000
COLUMNS = (
    *(
        "loop",
        "status",
        "cause",
        "valve_fault",
        "action",
        "oscillating_pct",
        "period_s",
        "backlash_pct",
        "stickband_pct",
    ),
    *(
        "osc_valve_pct",
        "osc_tuning_pct",
        "osc_load_pct",
        "kp_new",
        "ti_new",
        "reason",
        "gain",
        "time_constant_s",
    ),
    *("dead_time_s", "slope_pct_per_s", "advice"),
)


def export(folder: Path, records: dict[str, Recording]) -> list[Path]:
    """One wide file for each loop."""
    for name, r in records.items():
        stamp = (START_US + np.round(r["stamp_s"] * 1e6)).astype("datetime64[us]")
        columns = {f"{name}.{role.upper()}": r[role] for role in ("sp", "pv", "op")}
        pq.write_table(pa.table({"timestamp": stamp, **columns}), folder / f"{name}.parquet")
    return sorted(folder.glob("*.parquet"))


def spec_of(d: Drawn, stated: bool = True) -> LoopSpec:
    """The loop as loops.csv states it, with its settings or without."""
    tags = {role: f"{d.name}.{role.upper()}" for role in ("sp", "pv", "op")}
    c = d.controller
    plain = LoopSpec(d.name, pv_lo=0.0, pv_hi=100.0, **tags)
    return replace(plain, kp=c.kp, ti=c.ti_s, scan_s=c.scan_s) if stated else plain


def night_rows(
    loops: list[Drawn],
    records: dict[str, Recording],
    jobs: int,
    columns: Sequence[str] = COLUMNS,
    stated: bool = True,
) -> dict[str, dict[str, Any]]:
    """Rows of the night by loop; stated: whether loops.csv has the settings."""
    with tempfile.TemporaryDirectory() as folder:
        files = export(Path(folder), records)
        store = Store(Path(folder) / "store")
        specs = tuple(spec_of(d, stated) for d in loops)
        batch.run(Plant(open_export(files), specs, Config()), store, jobs)
        return {r["loop"]: r for r in store.own_rows("nights", store.nights()[-1], columns)}


def right(d: Drawn, row: dict[str, Any]) -> bool:
    """Whether cause and fault agree with the truth."""
    if d.kind == "sluggish":
        return row["cause"] == "none" and row["action"] == "retune"
    if d.kind == "healthy":
        return row["valve_fault"] in ("none", None) and row["cause"] == "none"
    if d.kind in ("backlash", "stiction"):
        return row["cause"] == "valve"
    if d.kind in ("worn-sine", "worn-tight"):
        return row["cause"] in (d.cause, "valve") and row["valve_fault"] not in ("none", None)
    return row["cause"] == d.cause and row["valve_fault"] in ("none", None)


def line(d: Drawn, row: dict[str, Any], answer: str) -> str:
    """One loop's truth and its answer."""
    p, c = d.process, d.controller
    true = f"Ms {d.ms:.1f} P {d.period_s:.0f} L {p.dead_s:.0f} T {p.lag_s:.0f} kp {c.kp:.3g} ti {c.ti_s:.3g}"
    valve = f"band {d.valve.band:.2g} moves {d.moves:.0f}"
    shares = "/".join(f"{row[f'osc_{cause}_pct'] or 0:.0f}" for cause in ("valve", "tuning", "load"))
    seen = f"osc {row['oscillating_pct']} P {row['period_s']} v/t/l {shares}"
    return f"{d.name} {true} {valve}: {answer} {row['action']} {seen} {row['reason']}"


def _count(loops: list[Drawn], way: str, seed: int, counts: Counter[str], options: Any) -> None:
    """Count the answers for one plant's loops, recorded in one way."""
    rows = night_rows(loops, {d.name: recorded(run(d), way, d.seed) for d in loops}, options.jobs)
    for d in loops:
        row = rows[d.name]
        answer = f"{row['cause']}/{row['valve_fault']}" if row["status"] == "ok" else row["status"]
        counts[answer] += 1
        counts["right"] += right(d, row)
        if options.show and not right(d, row):
            print(f"{seed} {line(d, row, answer)}", file=sys.stderr)


def main() -> None:
    """Draw, record, assess, count."""
    options = command_line(__doc__, seed=[1], each=8, ways=["plain"], jobs=2, kinds=list(KINDS), show=False)
    for way in options.ways:
        counts: dict[str, Counter[str]] = {k: Counter() for k in options.kinds}
        for seed in options.seed:
            for kind in (
                options.kinds
            ):  # one plant for each kind, because loops of one seed share their load and noise
                _count(drawn(seed, options.each, (kind,)), way, seed, counts[kind], options)
        n = options.each * len(options.seed)
        print(f"\n{way}\n")
        print(
            table("kind|right|answers", [(k, f"{c.pop('right')} of {n}", dict(c)) for k, c in counts.items()])
        )


if __name__ == "__main__":
    main()
