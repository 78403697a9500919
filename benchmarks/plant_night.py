"""The time of a plant's whole night relative to reading it: python -m benchmarks.plant_night [--loops 1500] [--hours
24]

A plant is simulated and written as exports of areas with its loops.csv. Then `triage run` does the work of a whole
night: opening, screening, cause, advice, groups, the store. There are three plants: loops that do not oscillate, one
loop in ten flagged, and half of the valves worn. Processor time is that of all processes of the run. The floor is
measured before and after it: pyarrow reads the same columns and numpy takes one rfft of each. `--growth` runs plants
of 100, 1,000 and 10,000 loops of 2 h at 5 s instead. Writes plant_night.md or plant_growth.md here.
"""

from __future__ import annotations

import csv
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from analyzer.loop.decisions import COUNTS_PCT
from analyzer.store.store import Store
from benchmarks import adopt, spent
from benchmarks.night import FAULTY, HEALTHY
from proofs.common import parser_of, publish
from proofs.plant import Sketch, Trends, simulate, write_export

OUT = Path(__file__).with_suffix(".md")
GROWTH = Path(__file__).with_name("plant_growth.md")
IN_A_FILE = 100
"""Loops of an area's export."""
DISTINCT = 60
"""Number of loops that are simulated; the others are copies with different sensor noise."""
WORN = tuple(replace(s, backlash=b) for s, b in zip(HEALTHY, (0.6, 0.8, 0.3), strict=True))
"""Loops with a harmless backlash."""


@dataclass(frozen=True)
class Plant:
    """Exports, loops.csv and the number of loops of a plant on disk."""

    exports: tuple[Path, ...]
    loops_csv: Path
    loops: int


@dataclass(frozen=True)
class Night:
    """Resources of a run: processor and wall time [s], largest memory of a process [MB], floor [s], loops flagged."""

    loops: int
    processor_s: float
    wall_s: float
    memory_mb: float
    floor_s: float
    flagged: int

    @property
    def ratio(self) -> float:
        """Processor time over the floor."""
        return self.processor_s / self.floor_s


def healthy(k: int) -> Sketch:
    """No loop oscillates."""
    return HEALTHY[k % len(HEALTHY)]


def tenth(k: int) -> Sketch:
    """One in ten oscillates."""
    return FAULTY[(k // 10) % len(FAULTY)] if k % 10 == 9 else HEALTHY[k % len(HEALTHY)]


def old_valves(k: int) -> Sketch:
    """Half of the valves are worn: one in ten oscillates, four in ten have a harmless backlash."""
    if k % 10 == 9:
        return FAULTY[(k // 10) % 2]
    return WORN[k % len(WORN)] if k % 10 < 4 else HEALTHY[k % len(HEALTHY)]


PLANTS: dict[str, Callable[[int], Sketch]] = {
    "none oscillates": healthy,
    "one in ten flagged": tenth,
    "half of the valves worn": old_valves,
}


def make(
    folder: Path,
    loops: int,
    hours: float,
    dt_s: int,
    sketch_of: Callable[[int], Sketch],
    area_of: int = IN_A_FILE,
) -> Plant:
    """Write a plant's exports and loops.csv; progress to stderr."""
    sketches = [sketch_of(k) for k in range(min(loops, DISTINCT))]
    made = [simulate(s, hours, k) for k, s in enumerate(sketches)]
    rng, exports, rows = np.random.default_rng(1), [], []
    for first in range(0, loops, area_of):
        area: dict[str, Trends] = {}
        for k in range(first, min(first + area_of, loops)):
            trends, sketch, name = made[k % len(made)], sketches[k % len(made)], f"A{k:05d}"
            pv = trends.pv + 0.02 * rng.standard_normal(trends.pv.size)
            area[name] = Trends(*(x[::dt_s] for x in (trends.sp, pv, trends.op, trends.stem)))
            rows.append((name, sketch.kind, 0, 100, sketch.kp, sketch.ti))
        exports.append(write_export(folder / f"area{first // area_of:03d}.parquet", area, dt_s=dt_s))
        print(f"\rwritten {len(rows)} of {loops} loops ", end="", file=sys.stderr, flush=True)
    listed = folder / "loops.csv"
    with listed.open("w", newline="") as f:
        csv.writer(f).writerows([("loop", "type", "pv_lo", "pv_hi", "kp", "ti"), *rows])
    return Plant(tuple(exports), listed, loops)


def floor(plant: Plant) -> float:
    """Processor time [s] of reading each loop's columns and one rfft of each."""
    begun = time.process_time()
    for path in plant.exports:
        columns = pq.read_schema(path).names[1:]
        for k in range(0, len(columns), 3):
            table = pq.read_table(path, columns=["timestamp", *columns[k : k + 3]], use_threads=False)
            for name in columns[k : k + 3]:
                np.fft.rfft(table.column(name).to_numpy())
    return time.process_time() - begun


def night(plant: Plant, jobs: int) -> Night:
    """Run `triage run` over a plant, between two floors."""
    before = floor(plant)
    with tempfile.TemporaryDirectory() as folder:
        store, start = Path(folder) / "store", time.perf_counter()
        adopt()
        earlier = spent()
        command = [sys.executable, "-m", "analyzer.cli", "run", *map(str, plant.exports)]
        command += ["--loops", str(plant.loops_csv), "--store", str(store), "--jobs", str(jobs)]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
        wall, now = time.perf_counter() - start, spent()
        if done.returncode:
            raise SystemExit(f"triage run ended with {done.returncode}: {done.stdout}")
        shares = Store(store).read("nights", Store(store).require(), ["oscillating_pct"])["oscillating_pct"]
        flagged = sum((share or 0.0) >= COUNTS_PCT for share in shares.to_pylist())
    floor_s = 0.5 * (before + floor(plant))
    processor = now.ru_utime + now.ru_stime - earlier.ru_utime - earlier.ru_stime
    return Night(plant.loops, processor, wall, now.ru_maxrss / 1024, floor_s, flagged)


def line(name: str, n: Night) -> str:
    """A night as a row of the table."""
    cells = (n.loops, n.flagged, f"{n.floor_s:.1f}", f"{n.processor_s:.1f}", f"{n.ratio:.1f}")
    more = (f"{1000 * n.processor_s / n.loops:.0f}", f"{n.wall_s:.0f}", f"{n.memory_mb:.0f}")
    return "| " + " | ".join((name, *map(str, cells), *more)) + " |"


HEAD = (
    "| plant | loops | flagged | floor s | night s | ratio | ms a loop | wall s | largest process MB |\n"
    "|---|--:|--:|--:|--:|--:|--:|--:|--:|"
)


def measured(
    plants: Sequence[tuple[str, Callable[[int], Sketch], int]], hours: float, dt_s: int, jobs: int
) -> str:
    """Rows of a table over plants of a name, kind and number of loops."""
    rows = [HEAD]
    for name, kind, loops in plants:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(line(name, night(make(Path(folder), loops, hours, dt_s, kind), jobs)))
        print(rows[-1], flush=True)
    return "\n".join(rows)


def main() -> None:
    """Measure and write the table next to this file."""
    parser = parser_of(__doc__, loops=1500, hours=24.0, jobs=2)
    parser.add_argument("--growth", action="store_true", help="100, 1,000 and 10,000 loops of 2 h at 5 s")
    options = parser.parse_args()
    pa.set_cpu_count(1)
    if options.growth:
        sizes = [("one in ten flagged", tenth, n) for n in (100, 1000, 10_000)]
        text = measured(sizes, 2.0, 5, options.jobs)
        title, command, out = "What a loop costs as plants grow", "--growth", GROWTH
    else:
        text = measured([(n, f, options.loops) for n, f in PLANTS.items()], options.hours, 1, options.jobs)
        title, out = "What a plant's night costs", OUT
        command = f"--loops {options.loops} --hours {options.hours:g} --jobs {options.jobs}"
    about = "Processor time of all processes of `triage run`, advice, groups and store included; see the docstring."
    publish(out, title, f"`python -m benchmarks.plant_night {command}`", about, text)


if __name__ == "__main__":
    main()
