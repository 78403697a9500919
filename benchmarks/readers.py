"""The time of reading an export relative to pyarrow's own read of it: python -m benchmarks.readers

There is one export at 1 s in each format (--loops 60 --hours 6). Each is opened, its span is determined, and all
loops are read, as in a night. The floor is pyarrow reading the same file once, on one thread. Each runs in its own
process; the table gives processor time and peak memory. Writes readers.md here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as csv
import pyarrow.parquet as pq

from proofs.common import command, command_line, publish, table

ROLES = ("SP", "PV", "OP")

PEAK = """
def PEAK():
    line = next(x for x in open("/proc/self/status") if x.startswith("VmHWM:"))
    return int(line.split()[1]) / 1024
"""
"""Peak memory of a process itself [MB]; its resource usage would include its parent's."""
FLOOR = """
import json, sys, time
import pyarrow as pa, pyarrow.csv as csv, pyarrow.parquet as pq
pa.set_cpu_count(1)
begun = time.process_time()
if sys.argv[1].endswith("parquet"):
    pq.read_table(sys.argv[1], use_threads=False)
else:
    csv.read_csv(sys.argv[1], read_options=csv.ReadOptions(use_threads=False))
print(json.dumps([time.process_time() - begun, PEAK()]))
"""
OURS = """
import json, sys, tempfile, time
from pathlib import Path
from analyzer.history.export import open_export
from analyzer.history.table import ReadOptions
begun = time.process_time()
export = open_export([Path(sys.argv[1])], ReadOptions(scratch=Path(tempfile.mkdtemp(dir=sys.argv[2]))))
export.span()
for k in range(0, len(export.tags), 3):
    export.read(list(export.tags[k : k + 3]))
print(json.dumps([time.process_time() - begun, PEAK()]))
"""


def wide(loops: int, hours: float) -> pa.Table:
    """Random walks with two decimals."""
    n, rng = int(hours * 3600), np.random.default_rng(1)
    stamp = (np.arange(n) * 1_000_000 + 1_772_409_600_000_000).astype("datetime64[us]")
    columns: dict[str, object] = {"timestamp": pa.array(stamp)}
    for k in range(loops):
        for role in ROLES:
            columns[f"FIC{k:04d}.{role}"] = np.round(50 + np.cumsum(rng.normal(0, 0.05, n)), 2)
    return pa.table(columns)


def long(table: pa.Table) -> pa.Table:
    """The same with one row for each sample, in the order of time, with quality."""
    tags = table.column_names[1:]
    n, m = table.num_rows, len(tags)
    values = np.stack([table.column(t).to_numpy() for t in tags], axis=1).ravel()
    return pa.table(
        {
            "TagName": pa.DictionaryArray.from_arrays(
                np.tile(np.arange(m, dtype=np.int32), n), pa.array(tags)
            ),
            "DateTime": pa.array(np.repeat(table.column("timestamp").to_numpy(), m)),
            "Value": values,
            "Quality": np.full(n * m, 192),
        }
    )


def exports(folder: Path, loops: int, hours: float) -> dict[str, Path]:
    """One export in each format."""
    table = wide(loops, hours)
    rows = long(table)
    paths = {
        name: folder / name.replace(", ", "-").replace(" ", "-")
        for name in ("wide.parquet", "long.parquet", "wide.csv", "long.csv")
    }
    pq.write_table(table, paths["wide.parquet"])
    pq.write_table(rows, paths["long.parquet"])
    csv.write_csv(table, paths["wide.csv"])
    decoded = rows.set_column(0, "TagName", rows.column("TagName").cast(pa.string()))
    csv.write_csv(decoded, paths["long.csv"])
    return paths


def measured(code: str, *arguments: str) -> tuple[float, float]:
    """Processor time [s] and peak memory [MB] of a program, the lesser of two runs."""
    found = []
    for _ in range(2):
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
        )
        found.append(json.loads(done.stdout))
    return min(f[0] for f in found), min(f[1] for f in found)


def main() -> None:
    """Measure, print, and write the table next to this file."""
    wanted = command_line(__doc__, loops=60, hours=6.0)
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, path in exports(folder, wanted.loops, wanted.hours).items():
            floor_s, floor_mb = measured(PEAK + FLOOR, str(path))
            ours_s, ours_mb = measured(PEAK + OURS, str(path), name)
            size = path.stat().st_size / 1e6
            times = (f"{floor_s:.2f}", f"{ours_s:.2f}", f"{ours_s / floor_s:.1f}")
            rows.append((kind, f"{size:.0f}", *times, f"{floor_mb:.0f}", f"{ours_mb:.0f}"))
    shown = command(__file__, loops=wanted.loops, hours=wanted.hours)
    about = "All loops of an export at 1 s, three tags each, read as in a night, relative to one read of the file."
    text = table("format | MB | pyarrow s | ours s | ratio | pyarrow MB | ours MB", rows, numbers=True)
    publish(__file__, "What reading costs", shown, about, text)


if __name__ == "__main__":
    main()
