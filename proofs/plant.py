"""Loops whose fault is known: simulated by the sample mill's physics, which shares no code with the estimators."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from analyzer.config import Config, QualityLimits
from analyzer.history.export import open_export
from analyzer.history.series import Series
from analyzer.loop.decisions import Cause, Finding, Status
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loops.spec import LoopSpec
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.store.store import Store
from identification.models import Pid
from identification.record import Floats, LoopRecord

SAMPLE_DATA = Path(__file__).resolve().parents[1] / "sample_data"
if str(SAMPLE_DATA) not in sys.path:
    sys.path.append(str(SAMPLE_DATA))

from physics import run, wander  # noqa: E402

START_S = 1_772_409_600.0
"""2026-03-02 00:00 UTC."""


@dataclass(frozen=True)
class Sketch:
    """A loop and its fault: seconds, percent of spans; see sample_data/physics.py.

    cause: the simulated cause; load_std, load_s: an Ornstein-Uhlenbeck load at the process input [% OP] and its
    correlation time [s].
    sine, sine_s: a sinusoidal load [% OP] and its period [s]; moves: size of set point steps [% PV] every hour
    and a half.
    """

    cause: str
    process: tuple[float, float, float]
    kp: float
    ti: float
    backlash: float = 0.0
    stickband: float = 0.0
    slip_jump: float = 0.0
    noise: float = 0.05
    load_std: float = 0.2
    load_s: float = 1800.0
    sine: float = 0.0
    sine_s: float = 300.0
    moves: float = 0.0
    kind: str = ""

    @property
    def controller(self) -> Pid:
        """The stated settings."""
        return Pid(self.kp, self.ti, scan_s=1.0)


@dataclass(frozen=True)
class Trends:
    """The trends of a loop as a historian records them, one value a second, shape (n,) each [% of span]."""

    sp: Floats
    pv: Floats
    op: Floats
    stem: Floats


def simulate(sketch: Sketch, hours: float = 3.0, seed: int = 1, extra: Floats | None = None) -> Trends:
    """Simulate a sketch; `extra` is a further load at the process input [% OP], shape (n,)."""
    n = int(hours * 3600)
    rng = np.random.default_rng(seed)
    sp = np.full(n, 50.0)
    if sketch.moves:
        sp += sketch.moves * ((np.arange(n) // 5400) % 2)
    load = wander(rng, n, sketch.load_std, sketch.load_s)
    load += sketch.sine * np.sin(2 * np.pi * np.arange(n) / sketch.sine_s)
    load = load if extra is None else load + extra
    noise = sketch.noise * rng.standard_normal(n)
    friction = 0.5 * (sketch.stickband + sketch.slip_jump), 0.5 * (sketch.stickband - sketch.slip_jump)
    fixed = np.full(n, sketch.kp), np.full(n, sketch.ti), np.zeros(n), np.zeros(n, dtype=bool)
    pv, op, stem = run(sp, load, noise, *fixed, 50.0, (sketch.backlash, *friction), sketch.process)
    return Trends(sp, pv, op, stem)


def series(stamp_s: Floats, value: Floats, bad: np.ndarray | None = None) -> Series:
    """Raw samples of one tag, all good unless `bad` is given."""
    return Series(stamp_s, value, np.zeros(value.size, dtype=bool) if bad is None else bad)


def spec(loop: str = "L", kind: str = "", **stated: object) -> LoopSpec:
    """A loop with tags LOOP.SP, LOOP.PV, LOOP.OP and a PV range from 0 to 100."""
    tags = {"sp": f"{loop}.SP", "pv": f"{loop}.PV", "op": f"{loop}.OP"}
    return LoopSpec(loop, **{"type": kind, "pv_lo": 0.0, "pv_hi": 100.0, **tags, **stated})  # type: ignore[arg-type]


def prepared(trends: Trends, kind: str = "", loop: str = "L") -> Prepared:
    """The trends as the nightly batch prepares them."""
    stamp = START_S + np.arange(trends.pv.size, dtype=float)
    found = {f"{loop}.{name.upper()}": series(stamp, getattr(trends, name)) for name in ("sp", "pv", "op")}
    return prepare(spec(loop, kind), found, QualityLimits())


def record(pv: Floats, sp: Floats | float = 50.0, op: Floats | None = None, dt_s: float = 1.0) -> LoopRecord:
    """A record of given trends, all good; OP is constant at 50 % where none is given."""
    n = pv.size
    fixed = np.broadcast_to(np.asarray(sp, dtype=float), (n,)).copy()
    still = np.full(n, 50.0) if op is None else op
    return LoopRecord("L", START_S, dt_s, fixed, pv, still, np.zeros(n, dtype=bool))


def peer(cause: Cause, evidence: float = 0.0, tuning_pct: float = 0.0) -> Finding:
    """A loop with its own verdict, for the plant-wide pass: evidence of its valve's fault [nat], confidence in its
    tuning [%]."""
    known = {"evidence": evidence}
    return Finding("", "", Status.OK, cause=cause, confidence={Cause.TUNING: tuning_pct}, known=known)


def write_export(path: Path, loops: dict[str, Trends], start_s: float = START_S, dt_s: float = 1.0) -> Path:
    """Trends of many loops as one wide Parquet export with one column a tag, in row groups of the columns of some
    loops."""
    n = next(iter(loops.values())).pv.size
    stamp = np.round((start_s + dt_s * np.arange(n)) * 1e6).astype("datetime64[us]")
    columns: dict[str, object] = {"timestamp": pa.array(stamp)}
    for name, trends in loops.items():
        for role in ("sp", "pv", "op"):
            columns[f"{name}.{role.upper()}"] = getattr(trends, role)
    pq.write_table(pa.table(columns), path)
    return path


CONFIG = Config()


def night_of(
    tags: Mapping[str, Floats], specs: Sequence[LoopSpec], every_s: float, columns: Sequence[str], jobs: int
) -> dict[str, Mapping[str, Any]]:
    """The answer of a night for loops with these trends, shape (n,) by tag, one value every `every_s` seconds: rows
    by loop."""
    n = next(iter(tags.values())).size
    stamp = np.round((START_S + every_s * np.arange(n)) * 1e6).astype("datetime64[us]")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "export.parquet"
        pq.write_table(pa.table({"timestamp": stamp, **tags}), path)
        store = Store(Path(folder) / "store")
        batch.run(Plant(open_export([path]), specs, Config()), store, jobs)
        return {r["loop"]: r for r in store.own_rows("nights", store.nights()[-1], columns)}
