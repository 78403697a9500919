"""A plant of nine loops with one loop for each state that a night reports: ten hours, a sample every 5 s.

The simulator of benchmarks/world shares no code with the analysis, and the fault of each loop is known.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.world.draw import wander
from benchmarks.world.simulate import (
    BACKLASH,
    Controller,
    Floats,
    Process,
    Trends,
    Valve,
    simulate,
)

START_US = 1_772_409_600_000_000
HOURS, EVERY_S = 10, 5
N = HOURS * 3600
FROZEN, SLUGGISH, TIGHT, SINE, BACKLASH_ON_LEVEL = "FT101", "TC102", "PC103", "PC104", "LC105"
LIMITED, NO_FAULT, WORN, MANUAL = "TC106", "FC107", "TC108", "FC109"
SINE_S, FROZEN_FROM, MANUAL_FROM = 840.0, 0.6, 0.25
"""Period of the load of PC104 [s]; start of the constant PV of FT101 and of manual of FC109 as a share of the
night.
"""
WIDTHS = {BACKLASH_ON_LEVEL: 3.0, WORN: 4.0}
"""True widths of the backlash [% OP]."""
TYPES = {"F": "flow", "T": "temperature", "P": "pressure", "L": "level"}


def _load(seed: int, size: float, corner_s: float) -> Floats:
    return size * wander(np.random.default_rng(seed), N, corner_s, 1.0)


def _noise(seed: int, size: float = 0.03) -> Floats:
    return size * np.random.default_rng(seed + 100).standard_normal(N)


def _steps(seed: int, count: int, size: float = 4.0) -> Floats:
    """A set point with `count` moves."""
    rng, sp = np.random.default_rng(seed + 200), np.full(N, 50.0)
    for k in np.sort(rng.integers(int(0.05 * N), int(0.95 * N), count)):
        sp[k:] = 50.0 + rng.uniform(-size, size)
    return sp


LOOPS: dict[str, tuple[Process, Controller, Valve]] = {
    FROZEN: (Process(0.9, 15.0, 0.0, 4.0), Controller(0.8, 20.0), Valve()),
    SLUGGISH: (Process(1.2, 240.0, 0.0, 20.0), Controller(0.25, 1200.0), Valve()),
    TIGHT: (Process(1.2, 60.0, 0.0, 10.0), Controller(5.5, 40.0), Valve()),
    SINE: (Process(1.4, 90.0, 0.0, 8.0), Controller(1.5, 90.0), Valve()),
    BACKLASH_ON_LEVEL: (
        Process(0.03, 0.0, 0.0, 8.0),
        Controller(1.2, 120.0),
        Valve(BACKLASH, WIDTHS["LC105"]),
    ),
    LIMITED: (Process(1.1, 300.0, 0.0, 20.0), Controller(2.0, 250.0), Valve()),
    NO_FAULT: (Process(0.9, 15.0, 0.0, 4.0), Controller(0.9, 18.0), Valve()),
    WORN: (Process(2.2, 400.0, 0.0, 15.0), Controller(3.0, 120.0), Valve(BACKLASH, WIDTHS["TC108"])),
    MANUAL: (Process(0.8, 20.0, 0.0, 5.0), Controller(0.8, 25.0), Valve()),
}
"""Process, controller and valve of each loop."""


def _trends(loop: str, seed: int) -> tuple[Trends, np.ndarray]:
    """The trends of a loop, and the mask of its time in automatic."""
    process, controller, valve = LOOPS[loop]
    before, behind, sp = _load(seed, 0.3, 300.0), np.zeros(N), np.full(N, 50.0)
    auto, rest = np.ones(N, dtype=bool), 50.0
    if loop == SLUGGISH:
        before, sp = _load(seed, 1.5, 900.0), _steps(seed, 7)
    elif loop == TIGHT:
        before = _load(seed, 1.0, 30.0)
    elif loop == SINE:
        before = before + 4.0 * np.sin(2.0 * math.pi * np.arange(N) / SINE_S)
    elif loop == LIMITED:
        before, rest = _load(seed, 1.0, 3000.0) - 2.0, 99.0
    elif loop == MANUAL:
        auto[int(MANUAL_FROM * N) :] = False
    found = simulate(process, controller, valve, sp, before, behind, _noise(seed), auto, rest)
    if loop != FROZEN:
        return found, auto
    # with a constant PV, the controller integrates the constant error until OP reaches its limit
    at = int(FROZEN_FROM * N)
    pv, op = found.pv.copy(), found.op.copy()
    pv[at:] = pv[at] + 1.0
    error = 50.0 - pv[at]
    ramp = controller.kp * error * np.arange(N - at) / controller.ti_s
    op[at:] = np.clip(op[at] + controller.kp * (error + ramp / controller.kp), 0.0, 100.0)
    return Trends(found.sp, pv, op, found.stem, found.scan_s), auto


def written(folder: Path) -> tuple[Path, Path]:
    """The export and its loops.csv."""
    stamp = (START_US + np.arange(0, N, EVERY_S) * 1_000_000).astype("datetime64[us]")
    columns: dict[str, object] = {"timestamp": stamp}
    lines = ["loop,type,area,pv_lo,pv_hi,pv_unit,kp,ti,importance"]
    for seed, (loop, (_, controller, _)) in enumerate(LOOPS.items(), 1):
        found, auto = _trends(loop, seed)
        columns |= {
            f"{loop}.{k}": np.round(getattr(found, k.lower())[::EVERY_S], 3) for k in ("SP", "PV", "OP")
        }
        columns[f"{loop}.MODE"] = np.where(auto[::EVERY_S], "AUTO", "MAN")
        kind = TYPES[loop[0]]
        lines.append(f"{loop},{kind},Area {1 + seed % 2},0,100,%,{controller.kp},{controller.ti_s},1")
    export, loops = folder / "nine.parquet", folder / "loops.csv"
    pq.write_table(pa.table(columns), export)
    loops.write_text("\n".join(lines) + "\n")
    return export, loops
