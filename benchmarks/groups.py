"""The time of the plant-wide pass as a plant grows: python -m benchmarks.groups [--loops 1000 3000 10000]

The oscillations are like those of a night of 24 h: one to five of every loop, with periods from 20 s to 50 min. Three
in ten loops oscillate; a third of these are in groups of 2 to 40 loops with a shared oscillation. The table gives the
time on one core over that of the floor, and the peak memory. The floor reads the table of oscillations and takes an
rfft of its lines. Each size runs in its own process. Writes groups.md here.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from analyzer.config import PlantLimits
from analyzer.loop.decisions import Cause, Finding, Status
from analyzer.plantwide.night import trace
from analyzer.plantwide.oscillation_lines import (
    EXTRA_LINES,
    REACH,
    OscillationLines,
    oscillation_table,
    oscillations_in,
)
from proofs.common import command, parser_of, publish, table

DAY_S = 86_400.0
PERIODS = (20.0, 3000.0)
PART = 2**16
"""Lines in one transform of the floor."""
GROUPED = 0.1
"""Share of loops in groups."""


def shape(rng: np.random.Generator, period: float) -> tuple[int, np.ndarray, np.ndarray]:
    """First line, noise and an independent oscillation near a period, shape (m,) each."""
    line = DAY_S / period
    first = max(int(line / REACH) - EXTRA_LINES, 0)
    at = np.arange(first, int(line * REACH) + EXTRA_LINES)
    noise = 0.05 * (rng.standard_normal(at.size) + 1j * rng.standard_normal(at.size))
    width = max(0.01 * line, 1.0)
    own = rng.standard_normal(at.size) + 1j * rng.standard_normal(at.size)
    return first, noise, own * np.exp(-0.5 * ((at - line) / width) ** 2)


def oscillation(
    rng: np.random.Generator, loop: str, period: float, shared: np.ndarray | None, own: bool
) -> OscillationLines:
    """One oscillation of a loop: noise, and a shared or an independent oscillation."""
    first, noise, mine = shape(rng, period)
    lines = noise + (shared if shared is not None else mine if own else 0.0)
    clear = 60.0 if own else 2.0
    return OscillationLines(
        loop, period, 1, own, 0.0, DAY_S, first, clear, 0.5, 0.1, lines.astype(np.complex64)
    )


def plant(loops: int, seed: int = 1) -> list[OscillationLines]:
    """Oscillations of a plant."""
    rng = np.random.default_rng(seed)
    out: list[OscillationLines] = []
    at = 0
    while at < loops:
        size = int(rng.integers(2, 41)) if rng.random() < GROUPED / 10 else 1
        size = min(size, loops - at)
        period = float(np.exp(rng.uniform(*np.log(PERIODS))))
        shared = shape(rng, period)[2] if size > 1 else None
        for k in range(at, at + size):
            out.append(oscillation(rng, f"L{k:06d}", period, shared, size > 1 or rng.random() < 0.22))
            for _ in range(int(rng.integers(0, 5))):
                out.append(
                    oscillation(rng, f"L{k:06d}", float(np.exp(rng.uniform(*np.log(PERIODS)))), None, False)
                )
        at += size
    return out


def peak_mb() -> float:
    """Largest memory of this process [MB]; the resource module would include its parent's."""
    peak = Path("/proc/self/status").read_text().split("VmHWM:")[1]
    return float(peak.split()[0]) / 1024


def measured(path: Path) -> tuple[float, float, float, int, int]:
    """Time of the floor and of the pass [s], peak memory [MB], oscillations, and groups of a table of
    oscillations."""
    trace(plant(20), {}, PlantLimits())  # compiles, or loads the compiled kernels
    begun = time.perf_counter()
    table = pq.read_table(path)
    lines = table.column("real").combine_chunks().flatten().to_numpy()
    for part in range(0, lines.size - PART + 1, PART):
        np.fft.rfft(lines[part : part + PART])
    floor = time.perf_counter() - begun
    count, names = table.num_rows, set(table.column("loop").to_pylist())
    del table, lines
    begun = time.perf_counter()
    alone = {name: Finding(name, "", Status.OK, cause=Cause.LOAD) for name in names}
    found = trace(oscillations_in([pq.read_table(path)]), alone, PlantLimits())
    took = time.perf_counter() - begun
    return floor, took, peak_mb(), count, len(found)


def row(loops: int, folder: Path) -> list[str]:
    """One size: generated here, measured in its own process."""
    path = folder / f"{loops}.parquet"
    pq.write_table(oscillation_table(plant(loops)), path, compression="zstd")
    alone = [sys.executable, "-m", "benchmarks.groups", "--alone", str(path)]
    printed = subprocess.run(alone, capture_output=True, text=True, check=True).stdout.split()
    floor, took, memory = map(float, printed[:3])
    measured_s = (f"{floor:.2f}", f"{took:.1f}", f"{took / floor:.1f}", f"{memory:.0f}")
    return [str(loops), printed[3], printed[4], *measured_s]


def main() -> None:
    """Measure sizes and write."""
    parser = parser_of(__doc__, loops=[1000, 3000, 10000])
    parser.add_argument("--alone", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        print(*measured(options.alone))
        return
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for loops in options.loops:
            lines.append(row(loops, Path(folder)))
            print(lines[-1], flush=True)
    about = f"{command(__file__)}, one core, both within one run of the same machine."
    heads = "loops | oscillations | groups | floor [s] | pass [s] | over floor | memory [MB]"
    publish(__file__, "What the plant-wide pass costs", about, table(heads, lines, numbers=True))


if __name__ == "__main__":
    main()
