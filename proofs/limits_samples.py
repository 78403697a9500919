"""Loops, plants and weeks on which proofs/limits.py measures the effect of each limit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.cause.fitness import unfit_for_cause
from analyzer.loop.decisions import Cause, Finding
from analyzer.loop.identification.measure import Measured, measure
from analyzer.loop.oscillation.detection import Oscillations, counting, detect
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loops.spec import LoopSpec
from identification.errors import TriageError
from identification.models import Pid
from identification.record import LoopRecord
from proofs.coupled.draw import draw as draw_plant
from proofs.nulls import FAMILIES
from proofs.nulls import record as null
from proofs.plant import Sketch, peer, prepared, record, simulate
from proofs.untidy.draw import draw

LOOPS, MOST = 240, 12_000
"""Number of untidy loops, and the most samples of each."""
REFITTED, UNFIT, SETTINGS = 12, 8, 60
"""Number of loops for each of three questions: models fitted again where a limit acts on fits, whether the cause can
be identified, and whether settings are wrong."""
OF_FITS = frozenset({"window", "blocks_per_period", "judged", "evidence_jump"})
"""Limits of causes that act on the fitted data; the others act on the fitted result."""
VARIANTS, PLANTS, WEEKS, NULLS = 3, 20, 60, 150
"""Loops with advice for each sketch (their gains differ by a tenth), coupled plants, pairs of weeks, and records of
each family in which nothing oscillates."""
START_S = 1_772_409_600.0
ADVISED = (
    Sketch("valve", (40.0, 1200.0, 8.0), 0.8, 100.0, backlash=0.8, load_std=0.1),
    Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5),
    Sketch("valve", (2.4, 600.0, 18.0), 3.6, 90.0, backlash=4.0, noise=0.02, load_std=0.3),
    Sketch("valve", (1.2, 8.0, 3.0), 0.4, 20.0, stickband=4.0, slip_jump=3.0, noise=0.08, kind="flow"),
    Sketch("valve", (1.5, 40.0, 8.0), 0.8, 40.0, stickband=3.0, slip_jump=1.5),
    Sketch("valve", (1.5, 400.0, 20.0), 2.0, 150.0, stickband=3.0, slip_jump=1.0),
    Sketch("tuning", (1.2, 260.0, 40.0), 7.8, 170.0, noise=0.03, load_std=0.6, load_s=300.0),
    Sketch("tuning", (1.5, 120.0, 20.0), 4.6, 60.0, noise=0.03, load_std=0.6, load_s=300.0),
    Sketch("tuning", (1.5, 90.0, 10.0), 5.5, 40.0, noise=0.05, load_std=0.6, load_s=300.0),
    Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.3, sine=3.0, sine_s=840.0),
)
SMALL = tuple(
    Sketch(
        "valve", (rate * 8000.0, 8000.0, 6.0), kp, ti, backlash=play, load_std=0.1, sine=sine, sine_s=period
    )
    for rate, kp, ti, period in (
        (0.01, 0.8, 25.0, 170.0),
        (0.005, 1.0, 40.0, 230.0),
        (0.02, 0.3, 40.0, 210.0),
    )
    for play in (1.0, 2.0, 4.0)
    for sine in (0.0, 1.5, 4.0)
)
"""Tanks under a PI with little damping. Their backlash is small compared with OP's range; some have an external
disturbance."""
DEFAULT = Config()


@dataclass(frozen=True)
class Raw:
    """A loop as read."""

    spec: LoopSpec
    series: dict[str, Series]
    stated: Pid | None


def spoilt(kind: int, rng: np.random.Generator, series: dict[str, Series]) -> dict[str, Series]:
    """A loop's samples with defects of historians: values frozen, lost or not readable, OP out of its range, missing
    stamps, a month between two parts."""
    out = dict(series)
    pv, op = series["L.PV"], series["L.OP"]
    n = pv.value.size
    part = slice(int(0.3 * n), int((0.3 + rng.uniform(0.02, 0.5)) * n))
    match kind:
        case 0 | 1:
            tag = ("L.PV", "L.OP")[kind]
            value = out[tag].value.copy()
            value[part] = value[part.start]
            out[tag] = replace(out[tag], value=value)
        case 2:
            bad = rng.random(n) < rng.uniform(0.02, 0.6)
            out = {tag: replace(s, bad=bad) for tag, s in out.items()}
        case 3:
            kept = np.ones(n, dtype=bool)
            for at in rng.integers(0, n, n // 40):
                kept[at : at + int(rng.integers(1, 12))] = False
            out["L.OP"] = Series(op.stamp_s[kept], op.value[kept], op.bad[kept])
        case 4:
            high = op.value - op.value.max() + rng.uniform(100.0, 110.0)
            out["L.OP"] = replace(op, value=np.minimum(high, 100.0) if rng.random() < 0.7 else high)
        case 5:
            lost = rng.random(n) < rng.uniform(0.005, 0.04)
            out["L.PV"] = replace(pv, bad=lost, unread=int(lost.sum()), example="1.2.3")
        case 6:
            apart = np.where(np.arange(n) < n // 2, 0.0, rng.uniform(5.0, 40.0) * np.ptp(pv.stamp_s))
            out = {tag: replace(s, stamp_s=s.stamp_s + apart) for tag, s in out.items()}
    return out


@dataclass(frozen=True)
class Coupled:
    """A loop of a coupled plant: its oscillations, the end of its record, and its own verdict."""

    name: str
    found: Oscillations
    end_s: float
    peer: Finding
    confidence: Mapping[Cause, float]


@cache
def raws() -> tuple[Raw, ...]:
    """Untidy loops, half of them with defects."""
    out = []
    for seed in range(700_000, 700_000 + 40 * LOOPS):
        drawn = draw(seed)
        if not 600 <= drawn.pv.size <= MOST:
            continue
        rng = np.random.default_rng(seed)
        stamp = START_S + drawn.step_s * np.arange(drawn.pv.size)
        fine, trends = (
            np.zeros(stamp.size, dtype=bool),
            (("PV", drawn.pv), ("OP", drawn.op), ("SP", drawn.sp)),
        )
        series = spoilt(len(out) % 14, rng, {f"L.{n}": Series(stamp, x, fine) for n, x in trends})
        own = LoopSpec("L", type=drawn.kind, pv="L.PV", op="L.OP", sp="L.SP", pv_lo=0.0, pv_hi=100.0)
        out.append(Raw(own, series, Pid(drawn.plant.kp, drawn.plant.ti, scan_s=1.0)))
        if len(out) == LOOPS:
            break
    return tuple(out)


def tried(task: Callable[[], Any]) -> Any:
    """The result of a task, or the message of its refusal."""
    try:
        return task()
    except TriageError as error:
        return str(error)


@cache
def ready() -> tuple[tuple[Raw, Prepared], ...]:
    """The loops that can be prepared with the defaults."""
    found = ((r, tried(lambda r=r: prepare(r.spec, r.series, DEFAULT.quality))) for r in raws())
    return tuple((r, p) for r, p in found if isinstance(p, Prepared))


@cache
def nothing() -> tuple[LoopRecord, ...]:
    """Records of noise, drift and ramps, constant, rounded and compressed (nulls.py)."""
    made = (null(family, seed) for family in FAMILIES for seed in range(NULLS))
    fixed = ((pv, op, np.full(pv.size, 50.0), np.zeros(pv.size, dtype=bool)) for pv, op in made)
    return tuple(LoopRecord("L", START_S, 1.0, sp, pv, op, bad) for pv, op, sp, bad in fixed)


@cache
def detected() -> tuple[tuple[Raw, Prepared, Oscillations], ...]:
    """Prepared loops with their oscillations."""
    return tuple((r, p, detect(p.record, DEFAULT.oscillation)) for r, p in ready())


@cache
def measured() -> tuple[tuple[Prepared, Oscillations, Measured], ...]:
    """Loops whose models can be fitted, with their measures."""
    out = []
    for r, p, f in detected():
        if unfit_for_cause(p, None, DEFAULT) or float(np.ptp(p.record.pv)) == 0.0:
            continue
        args = (p.record, counting(f), r.stated, DEFAULT.cause, f.spectrum, r.spec.type)
        m = tried(lambda args=args: measure(*args))
        if isinstance(m, Measured):
            out.append((p, f, m))
    for sketch in SMALL:
        p = prepared(simulate(sketch, 3.0))
        f = detect(p.record, DEFAULT.oscillation)
        out.append((p, f, measure(p.record, counting(f), sketch.controller, DEFAULT.cause, f.spectrum)))
    return tuple(out)


@cache
def wound() -> tuple[LoopRecord, ...]:
    """Records whose PV stays off the set point while OP winds up over a part of its range."""
    n, out = 3600, []
    for k, width in enumerate(range(4, 64, 4)):
        pv = 45.0 + 0.02 * np.random.default_rng(k).standard_normal(n)
        op = 30.0 + width * np.linspace(0.0, 1.0, n)
        out.append(LoopRecord("L", START_S, 1.0, np.full(n, 50.0), pv, op, np.zeros(n, dtype=bool)))
    return tuple(out)


@cache
def advised() -> tuple[tuple[Sketch, Assessment], ...]:
    """Simulated loops for advice, assessed with the defaults."""
    sketches = (
        replace(s, process=(s.process[0] * (0.9 + 0.1 * k), *s.process[1:]))
        for s in ADVISED
        for k in range(VARIANTS)
    )
    made = ((s, prepared(simulate(s, 4.0 if s.process[1] < 500 else 8.0))) for s in sketches)
    return tuple((s, assess(p, s.controller, DEFAULT, s.kind)) for s, p in made)


@cache
def plants() -> tuple[tuple[Coupled, ...], ...]:
    """Loops of coupled plants with their oscillations and their own verdicts."""
    out = []
    for seed in range(46, 46 + PLANTS):
        loops = []
        for x in draw_plant(seed, 30, 1, 8.0, 10.0).loops:
            stamp, fine = START_S + x.stamp_s, np.zeros(x.pv.size, dtype=bool)
            trends = (("SP", x.sp), ("PV", x.pv), ("OP", x.op))
            series = {f"L.{n}": Series(stamp, v, fine) for n, v in trends}
            own = LoopSpec("L", type=x.kind, pv="L.PV", op="L.OP", sp="L.SP", pv_lo=0.0, pv_hi=100.0)
            a = tried(
                lambda s=series, o=own, x=x: assess(prepare(o, s, DEFAULT.quality), Pid(x.kp, x.ti), DEFAULT)
            )
            if isinstance(a, Assessment):
                m = a.verdict.measured
                alone = peer(a.verdict.cause, m.evidence if m else 0.0, a.verdict.confidence[Cause.TUNING])
                end_s, own_pct = a.start_s + a.duration_s, a.verdict.confidence
                loops.append(Coupled(x.name, a.oscillations, end_s, alone, own_pct))
        out.append(tuple(loops))
    return (*out, *pairs())


def pairs() -> list[tuple[Coupled, ...]]:
    """Pairs of loops with one oscillation: the second has only its third harmonic, or both valves are blamed."""
    rng, n, out = np.random.default_rng(5), 28_800, []
    phase = 2 * np.pi * np.arange(n) / 300.0 + np.cumsum(0.005 * rng.standard_normal(n))
    for size in (0.03, 0.04, 0.055, 0.08, 0.11, 0.2):
        errors = (np.sin(phase) + size * np.sin(3 * phase), np.sin(3 * phase))
        out.append(tuple(_sharing(k, e, peer(Cause.LOAD)) for k, e in enumerate(errors)))
    for ratio in (1.0, 2.0, 3.5, 4.5, 8.0):
        errors = (np.sin(phase), np.sin(phase - 0.5))
        blamed = (peer(Cause.VALVE, 4000.0), peer(Cause.VALVE, 4000.0 / ratio))
        out.append(tuple(_sharing(k, e, p) for k, (e, p) in enumerate(zip(errors, blamed, strict=True))))
    return out


def _sharing(k: int, error: np.ndarray, alone: Finding) -> Coupled:
    """A loop with this error [%], one sample a second, and a little noise."""
    own = record(50.0 - error + 0.1 * np.random.default_rng(k).standard_normal(error.size))
    pct = {cause: 100.0 * (cause is alone.cause) for cause in (Cause.VALVE, Cause.TUNING, Cause.LOAD)}
    return Coupled(f"L{k}", detect(own, DEFAULT.oscillation), own.start_s + own.duration_s, alone, pct)


@cache
def weeks() -> tuple[dict[str, np.ndarray], ...]:
    """Hourly figures of two weeks of some loops; the second week changes by 0 to 50 %."""
    out = []
    for seed in range(WEEKS):
        rng = np.random.default_rng(seed)
        n, half = 14 * 24, 7 * 24
        level = np.where(np.arange(n) < half, 1.0, 1.0 - 0.05 * (seed % 12))
        noise = np.exp(0.2 * np.convolve(rng.standard_normal(n), np.ones(6) / 6, mode="same"))
        names = ("average_absolute_error_pct", "valve_travel_pct_per_h", "oscillation_significance")
        hours = {name: level * noise * rng.uniform(0.5, 5) for name in (*names, "variability_pct")}
        names = ("pv_variability_pct", "reversals_per_h", "crossings_per_h", "noise_band_pct", "normal_pct")
        hours |= {name: noise * rng.uniform(1, 5) for name in names}
        hours |= {
            "hour_s": START_S + 3600.0 * np.arange(n),
            "usable_h": (rng.random(n) < 0.55 + 0.04 * (seed % 12)) * 1.0,
        }
        moved = 1.0 + (np.arange(n) >= half) * rng.uniform(-0.7, 0.7)
        hours |= {
            "sp_mean_pct": 50.0 + 3 * moved,
            "pv_mean_pct": 50.0 + 3 * moved,
            "op_mean_pct": 40.0 + 8 * moved,
        }
        hours |= {
            "sp_travel_pct": (0.2, 4.0)[seed % 2] * moved**3,
            "service_pct": 90.0 + 8 * moved,
            "at_limits_pct": 4 * moved,
        }
        hours |= {"oscillating_pct": 50.0 * moved, "op_variability_pct": noise}
        out.append(hours)
    return tuple(out)
