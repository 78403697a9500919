"""The time of a loop's night relative to the time of reading it: python -m benchmarks.night [--loops 60]

Each loop of an export is read, prepared and assessed. Between two loops the floor is measured on the same loop:
pyarrow reads its columns and numpy takes one rfft of each. Both run on one core, one after the other, so that other
processes affect both. Without --export a plant of 24 h at 1 s is simulated. Writes night.md here.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from analyzer.config import Config
from analyzer.history.export import Export, open_export
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.decisions import counts
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import controller, find_loops, match, read_loops
from identification.errors import TriageError
from proofs.common import command, parser_of, publish
from proofs.plant import Sketch, simulate, write_export

REPEATS = 3
"""Number of runs of each; the fastest counts."""
HEALTHY = (
    Sketch("none", (0.9, 15.0, 4.0), 0.8, 16.0, noise=0.15, load_std=0.8, kind="flow"),
    Sketch("none", (1.5, 40.0, 8.0), 1.2, 40.0, noise=0.1, load_std=0.8),
    Sketch("none", (1.2, 400.0, 40.0), 2.5, 420.0, noise=0.03, load_std=1.0),
)
FAULTY = (
    Sketch("valve", (40.0, 1200.0, 8.0), 0.8, 100.0, backlash=0.8, load_std=0.1),
    Sketch("valve", (1.2, 8.0, 3.0), 0.4, 20.0, stickband=4.0, slip_jump=3.0, noise=0.08, kind="flow"),
    Sketch("tuning", (1.5, 120.0, 20.0), 4.6, 60.0, noise=0.03, load_std=0.6, load_s=300.0),
    Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, noise=0.08, load_std=0.3, sine=3.0, sine_s=840.0),
)

Made = TypeVar("Made")


@dataclass(frozen=True)
class Cost:
    """One loop: time of the floor and of the night [s], and whether it oscillates."""

    loop: str
    floor_s: float
    night_s: float
    oscillates: bool

    @property
    def ratio(self) -> float:
        """Night over floor."""
        return self.night_s / self.floor_s


def plant(loops: int, hours: float, folder: Path) -> tuple[Path, dict[str, Sketch]]:
    """An export of loops, three of four without a fault, and their sketches."""
    sketches = {}
    for k in range(loops):
        kinds = FAULTY if k % 4 == 3 else HEALTHY
        sketches[f"L{k:03d}"] = kinds[(k // 4) % len(kinds)]
    trends = {name: simulate(sketch, hours, k) for k, (name, sketch) in enumerate(sketches.items())}
    return write_export(folder / "day.parquet", trends), sketches


def stated(specs: Sequence[LoopSpec], sketches: dict[str, Sketch]) -> list[LoopSpec]:
    """Loops with the range and the settings of their sketches."""
    return [
        replace(
            s,
            pv_lo=0.0,
            pv_hi=100.0,
            kp=sketches[s.loop].kp,
            ti=sketches[s.loop].ti,
            type=sketches[s.loop].kind,
        )
        for s in specs
    ]


def fastest(task: Callable[[], Made]) -> tuple[float, Made]:
    """Least time of a few runs [s], and the result of the last one."""
    least = np.inf
    for _ in range(REPEATS):
        begun = time.perf_counter()
        made = task()
        least = min(least, time.perf_counter() - begun)
    return least, made


def floor(path: Path, columns: Sequence[str]) -> float:
    """pyarrow reads the columns and the stamps, numpy takes one rfft of each column."""
    table = pq.read_table(path, columns=["timestamp", *columns], use_threads=False)
    table.column("timestamp").to_numpy()
    return sum(abs(np.fft.rfft(table.column(c).to_numpy())[1]) for c in columns)


def one_night(export: Export, spec: LoopSpec, config: Config) -> Assessment:
    """Reading, quality, oscillation, cause and assessments of one loop."""
    prepared = prepare(spec, export.read(spec.tags), config.quality)
    pid = controller(spec, prepared.scale.span)
    pid = None if pid is None else replace(pid, scan_s=prepared.record.dt_s)
    return assess(prepared, pid, config, spec.type)


def measured(path: Path, export: Export, specs: Sequence[LoopSpec]) -> list[Cost]:
    """Costs of all loops that can be assessed; the first is also run before, to load and compile."""
    config = Config()
    found = []
    for spec in (specs[0], *specs):
        try:
            night_s, made = fastest(lambda spec=spec: one_night(export, spec, config))
        except TriageError:
            continue
        floor_s, _ = fastest(lambda spec=spec: floor(path, spec.tags))
        first = made.oscillations.first
        oscillates = first is not None and counts(first.oscillating_pct)
        found.append(Cost(spec.loop, floor_s, night_s, oscillates))
    return found[1:]


def quartiles(costs: Sequence[Cost]) -> str:
    """Loops, median floor and night [ms], and quartiles of the ratio as cells of a table."""
    if not costs:
        return "0 | | | | | "
    low, middle, high = np.quantile([c.ratio for c in costs], [0.25, 0.5, 0.75])
    floor_ms, night_ms = (1000 * np.median([getattr(c, n) for c in costs]) for n in ("floor_s", "night_s"))
    return f"{len(costs)} | {floor_ms:.1f} | {night_ms:.1f} | {low:.1f} | {middle:.1f} | {high:.1f}"


def table(costs: Sequence[Cost]) -> str:
    """A Markdown table over all loops, loops without a fault and oscillating loops."""
    lines = [
        "| loops | number | floor ms | night ms | ratio, lower quartile | median | upper quartile |",
        "|---|---|---|---|---|---|---|",
    ]
    groups = {
        "all": list(costs),
        "not oscillating": [c for c in costs if not c.oscillates],
        "oscillating": [c for c in costs if c.oscillates],
    }
    return "\n".join(lines + [f"| {name} | {quartiles(group)} |" for name, group in groups.items()])


def main() -> None:
    """Measure and write the table next to this file."""
    parser = parser_of(__doc__)
    parser.add_argument("--loops", type=int, default=60, help="loops of the simulated plant")
    parser.add_argument("--hours", type=float, default=24.0, help="length of its night")
    parser.add_argument("--export", type=Path, help="a wide Parquet export to measure on instead")
    parser.add_argument("--loops-csv", type=Path, help="its loops")
    options = parser.parse_args()
    pa.set_cpu_count(1)
    with tempfile.TemporaryDirectory() as folder:
        sketches: dict[str, Sketch] = {}
        path = options.export
        if path is None:
            path, sketches = plant(options.loops, options.hours, Path(folder))
        export = open_export([path])
        specs = (
            find_loops(export.tags)
            if options.loops_csv is None
            else match(read_loops(options.loops_csv), export.tags)[0]
        )
        costs = measured(path, export, stated(specs, sketches) if sketches else specs)
    text = table(costs)
    if options.export is not None:
        print(text)
    else:
        shown = command(__file__, loops=options.loops, hours=options.hours)
        about = (
            "Night: reading, quality, oscillation, cause and assessments of one loop. Floor: pyarrow reads the same\n"
            "columns and numpy takes one rfft of each. One core, interleaved loop by loop, the fastest of three runs."
        )
        publish(__file__, "What a night costs", shown, about, text)


if __name__ == "__main__":
    main()
