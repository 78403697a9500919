"""What the proposed settings do on plants that the estimator's simulator did not make.

    python -m tests.proofs.retuning --seed 1 2

Loops with play or sticking stems, second lags, load and noise are recorded for some hours; `triage run` reads the
export and proposes; the settings are typed in on the true plant, and the same load and noise go on under the old
and under the new tuning. Writes retuning.md and retuning.png beside this file.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analyzer import batch
from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.rank import ranked
from analyzer.store import Store
from analyzer.tags import match, read_loops
from tests.proofs.retuning_plant import COUNTS, Outside, Rig, Trends, drawn, held, outside, run, sound

OUT = Path(__file__).with_suffix(".md")
FIGURE = Path(__file__).with_suffix(".png")
START = pd.Timestamp("2026-03-02")
SETTLE = 0.25
"""Share of the time after the change that is left for the loop to settle."""
STATED_PEAK, STATED_INTEGRAL = 2.0, 3.5
"""Largest deviation after a load step over that of the nominal tuning, and the error's integral over that of the
nominal gain with Ti = max(T, nominal Ti): the factors that a proposal may have (tuning/limits.py)."""
STATED_INTEGRAL_RAMP = 10.0
"""The second on an integrating level."""
ERROR_MOST = 1.05
"""Error after over error before that no loop may exceed [-]."""
TI_UNITS = ("s", "min", "repeats/min")

Settings = tuple[float, float]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Figures:
    """Stem travel [%/h] and average absolute error [% PV] of one stretch."""

    travel: float
    error: float


@dataclass(frozen=True)
class Rejection:
    """Answer to a unit load step at the valve, friction and play left out: largest deviation, integral of its
    absolute value [% PV, % PV s], and whether it dies away."""

    peak: float
    integral: float
    dies: bool


@dataclass(frozen=True)
class Outcome:
    """One loop: what was said, and the true plant under the old, the new, and the rule's settings."""

    rig: Rig
    row: dict[str, Any]
    new: Settings | None
    old: Figures
    after: Figures
    rule: Figures
    rule_found: Figures
    rejection: Rejection | None
    rejection_old: Rejection
    nominal: Rejection
    reference: float

    @property
    def travel(self) -> float:
        """Stem travel after over before [-]."""
        return self.after.travel / max(self.old.travel, 1e-9)

    @property
    def error(self) -> float:
        """Average absolute error after over before [-]."""
        return self.after.error / max(self.old.error, 1e-9)

    @property
    def peak(self) -> float:
        """Peak after a load step over nominal, or over the old tuning's where that is higher [-]."""
        most = max(self.nominal.peak, self.rejection_old.peak / STATED_PEAK)
        return (self.rejection.peak if self.rejection else 0.0) / most

    @property
    def integral(self) -> float:
        """Integral of the error after a load step over that of nominal gain and Ti >= T [-]."""
        return (self.rejection.integral if self.rejection else 0.0) / self.reference

    @property
    def failures(self) -> list[str]:
        """What the proposal must not do and does."""
        if self.new is None or self.rejection is None:
            return []
        most = STATED_INTEGRAL_RAMP if self.rig.lag == 0 else STATED_INTEGRAL
        said = {
            "unstable": not self.rejection.dies,
            "error": self.error > ERROR_MOST,
            "sleepy (peak)": self.peak > 1.001 * STATED_PEAK,
            "sleepy (integral)": self.integral > 1.001 * most,
        }
        return [name for name, holds in said.items() if holds]


def nominal(rig: Rig) -> Settings:
    """SIMC on the true plant, closed-loop time constant 1.5 effective delays."""
    lag = rig.lag + 0.5 * rig.second if rig.lag > 0 else math.inf
    return 1.0 / (rig.slope * 2.5 * rig.delay), min(lag, 10.0 * rig.delay)


def rejection(rig: Rig, settings: Settings, horizon: float) -> Rejection:
    """The plant without its valve's fault after a load step of 1 %, for `horizon` seconds."""
    n = int(min(max(horizon / rig.scan, 400), 400_000))
    load = np.ones(n)
    load[:3] = 0.0
    t = held(sound(rig), Outside(load, np.zeros(n)), settings)
    off = np.abs(t.pv - 50.0)
    left = float(off[-n // 8 :].max())
    return Rejection(float(off.max()), float(off.sum() * rig.scan), left < 0.2 * float(off.max()))


def figures(rig: Rig, t: Trends, first: int) -> Figures:
    """Travel and error from one scan on."""
    stem, pv = t.stem[first:], t.pv[first:]
    hours = pv.size * rig.scan / 3600
    return Figures(float(np.abs(np.diff(stem)).sum()) / hours, float(np.mean(np.abs(pv - 50.0))))


def changed(rig: Rig, settings: Settings) -> Trends:
    """Both recordings in a row, the settings typed in between them."""
    n = rig.scans
    kp, ti = np.full(2 * n, rig.kp), np.full(2 * n, rig.ti)
    kp[n:], ti[n:] = settings
    return run(rig, outside(rig, 2 * n), kp, ti)


def recorded(rig: Rig) -> Trends:
    """The recording before any change."""
    n = rig.scans
    t = changed(rig, (rig.kp, rig.ti))
    return Trends(t.pv[:n], t.op[:n], t.stem[:n])


def kept(x: Floats, step: float) -> Floats:
    """What the historian keeps."""
    return np.asarray(np.round(x / step) * step, dtype=np.float64)


def write_export(rig: Rig, folder: Path) -> None:
    """One Parquet file with SP, PV and OP of a loop."""
    t = recorded(rig)
    stamp = START + pd.to_timedelta(np.arange(t.pv.size) * rig.scan, unit="s")
    tags = {"SP": np.full(t.pv.size, 50.0), "PV": kept(t.pv, rig.resolution), "OP": kept(t.op, 0.01)}
    frame = pd.DataFrame({"timestamp": stamp, **{f"{rig.name}.{k}": v for k, v in tags.items()}})
    frame.to_parquet(folder / f"{rig.name}.parquet")


def ti_unit(rig: Rig) -> str:
    """Every loop states its integral time in one of three units."""
    return TI_UNITS[rig.seed % 3]


def converted(ti: float, unit: str) -> float:
    """Seconds to the unit stated, or back: min and repeats/min."""
    return {"s": ti, "min": ti / 60.0, "repeats/min": 60.0 / ti}[unit]


def seconds(ti: float, unit: str) -> float:
    """The unit stated to seconds."""
    return {"s": ti, "min": ti * 60.0, "repeats/min": 60.0 / ti}[unit]


def write_loops(rigs: Sequence[Rig], path: Path) -> None:
    """loops.csv: what the plant knows of its controllers."""
    rows = [
        {"loop": r.name, "pv_lo": 0, "pv_hi": 100, "kp": r.kp, "ti": converted(r.ti, ti_unit(r)),
         "ti_unit": ti_unit(r), "scan_s": r.scan, "type": "level" if r.lag == 0 else ""}
        for r in rigs
    ]  # fmt: skip
    pd.DataFrame(rows).to_csv(path, index=False)


def triaged(rigs: Sequence[Rig], folder: Path) -> dict[str, dict[str, Any]]:
    """Rows of the morning list, by loop: what `triage run` and `triage rank` do."""
    trends = folder / "trends"
    trends.mkdir()
    for rig in rigs:
        write_export(rig, trends)
    write_loops(rigs, folder / "loops.csv")
    export = open_export([trends])
    specs = match(read_loops(folder / "loops.csv"), export.tags)[0]
    store = Store(folder / "store")
    batch.run(export, specs, store, Config())
    return {row["loop"]: row for row in ranked(store, "oscillation_significance")[0]}


def proposed(rig: Rig, row: dict[str, Any]) -> Settings | None:
    """The settings to type in [% OP / % PV], [s]; None where none are proposed."""
    if row["kp_new"] is None or row["ti_new"] is None:
        return None
    return float(row["kp_new"]), seconds(float(row["ti_new"]), ti_unit(rig))


def outcome(rig: Rig, row: dict[str, Any]) -> Outcome:
    """Type the proposal in, and the rule with the true and with the identified time constant beside it."""
    new, now = proposed(rig, row), (rig.kp, rig.ti)
    first = int((1 + SETTLE) * rig.scans)
    found = row["time_constant_s"] or 0.0
    tried = [now, new or now, (rig.kp, max(rig.ti, rig.lag)), (rig.kp, max(rig.ti, found))]
    got = [figures(rig, changed(rig, s), first) for s in tried]
    best = nominal(rig)
    horizon = 20 * rig.delay + 8 * max(rig.lag, best[1], new[1] if new else 0.0)
    reference = rejection(rig, (best[0], max(rig.lag, best[1])), horizon).integral
    answers = [rejection(rig, s, horizon) for s in (now, best)]
    return Outcome(
        rig, row, new, *got, rejection(rig, new, horizon) if new else None, answers[0], answers[1], reference
    )


def examined(seed: int, counts: dict[str, tuple[int, int]] = COUNTS) -> list[Outcome]:
    """All loops of a seed."""
    rigs = list(drawn(seed, counts))
    with tempfile.TemporaryDirectory() as folder:
        rows = triaged(rigs, Path(folder))
    return [outcome(rig, rows[rig.name]) for rig in rigs]
