"""A night on a cluster of two workers compared with two processes: python -m benchmarks.cluster [--loops 100]

A scheduler and two workers with one thread each, over TCP on loopback, run the same night as `--jobs 2`, in turns.
The wall time is that of the run alone; the workers are warm from one night before. Writes cluster.md here.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa

from benchmarks.plant_night import Plant, make, tenth
from proofs.common import command, command_line, publish, table
from tests.analyzer.night.dask_cluster import dask_cluster

TURNS = 3
"""Number of nights of each; the median counts."""


def night_s(plant: Plant, folder: Path, *how: str) -> float:
    """Wall time of a night [s]."""
    with tempfile.TemporaryDirectory(dir=folder) as place:
        command = [sys.executable, "-m", "analyzer.cli", "run", *map(str, plant.exports)]
        command += ["--loops", str(plant.loops_csv), "--store", f"{place}/store", *how]
        begun = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        return time.perf_counter() - begun


def main() -> None:
    """Measure and write the table next to this file."""
    loops = command_line(__doc__, loops=100).loops
    pa.set_cpu_count(1)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        plant = make(folder, loops, 24.0, 1, tenth)
        with dask_cluster(folder) as (address, _):
            ways = {"--jobs 2": ("--jobs", "2"), "--scheduler, two workers": ("--scheduler", address)}
            for how in ways.values():
                night_s(plant, folder, *how)
            taken = {name: [] for name in ways}
            for _ in range(TURNS):
                for name, how in ways.items():
                    taken[name].append(night_s(plant, folder, *how))
    local, remote = (float(np.median(x)) for x in taken.values())
    rows = ([name, *(f"{f(x):.1f}" for f in (np.median, min, max))] for name, x in taken.items())
    text = table("how | median s | least | most", rows, numbers=True)
    difference = f"Difference from the processes: {remote / local - 1:+.0%}."
    publish(
        __file__, "A night on a cluster", f"{command(__file__, loops=loops)}, two cores", text, difference
    )


if __name__ == "__main__":
    main()
