"""Loops, plants and weeks on which tests/proofs/limits.py asks what each limit does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from analyzer.assess import Assessment, assess, unfit_for_cause
from analyzer.config import Config
from analyzer.decisions import Cause
from analyzer.history.series import Series
from analyzer.loops.spec import LoopSpec
from analyzer.measure import Measured, measure
from analyzer.oscillation import Oscillations, counting, detect
from analyzer.plantwide.source import Peer
from analyzer.quality import Prepared, prepare
from identification.errors import TriageError
from identification.models import Pid
from identification.record import LoopRecord
from tests.analyzer.plant import Sketch, prepared, simulate
from tests.coupled.draw import draw as draw_plant
from tests.proofs.nulls import FAMILIES
from tests.proofs.nulls import record as null
from tests.untidy.draw import draw

LOOPS, MOST = 240, 12_000
"""Untidy loops, and samples of each at most."""
REFITTED, UNFIT, SETTINGS = 12, 8, 60
"""Of how many of them models are fitted anew where a limit acts on fits, whether the cause can be told at all, and
whether settings are wrong."""
OF_FITS = frozenset({"window", "blocks_per_period", "judged", "evidence_jump"})
"""Limits of causes that act on what is fitted; the others act on what was."""
VARIANTS, PLANTS, WEEKS, NULLS = 3, 10, 60, 150
"""Loops of each sketch that are advised on, their gains a tenth apart, coupled plants, pairs of
weeks, and records of each family in which nothing oscillates."""
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
DEFAULT = Config()


@dataclass(frozen=True)
class Raw:
    """A loop as read."""

    spec: LoopSpec
    series: dict[str, Series]
    stated: Pid | None


@cache
def raws() -> tuple[Raw, ...]:
    """Untidy loops, half of them with gaps, a frozen PV or an OP that stands still."""
    out = []
    for seed in range(700_000, 700_000 + 40 * LOOPS):
        drawn = draw(seed)
        if not 600 <= drawn.pv.size <= MOST:
            continue
        rng = np.random.default_rng(seed)
        stamp = START_S + drawn.step_s * np.arange(drawn.pv.size)
        bad = np.zeros(stamp.size, dtype=bool)
        pv, op = drawn.pv.copy(), drawn.op.copy()
        part = slice(int(0.3 * pv.size), int((0.3 + rng.uniform(0.02, 0.5)) * pv.size))
        match len(out) % 6:
            case 0:
                pv[part] = pv[part.start]
            case 1:
                op[part] = op[part.start]
            case 2:
                bad[rng.random(pv.size) < rng.uniform(0.02, 0.6)] = True
        series = {f"L.{n}": Series(stamp, x, bad) for n, x in (("PV", pv), ("OP", op), ("SP", drawn.sp))}
        own = LoopSpec("L", type=drawn.kind, pv="L.PV", op="L.OP", sp="L.SP", pv_lo=0.0, pv_hi=100.0)
        out.append(Raw(own, series, Pid(drawn.plant.kp, drawn.plant.ti, scan_s=1.0)))
        if len(out) == LOOPS:
            break
    return tuple(out)


def tried(task: Callable[[], Any]) -> Any:
    """What a task gives, or the words of its refusal."""
    try:
        return task()
    except TriageError as error:
        return str(error)


@cache
def ready() -> tuple[tuple[Raw, Prepared], ...]:
    """The loops that prepare well by the defaults."""
    found = ((r, tried(lambda r=r: prepare(r.spec, r.series, DEFAULT.quality))) for r in raws())
    return tuple((r, p) for r, p in found if isinstance(p, Prepared))


@cache
def nothing() -> tuple[LoopRecord, ...]:
    """Records of noise, drift and ramps, at rest, on grids and compressed (nulls.py)."""
    made = (null(family, seed) for family in FAMILIES for seed in range(NULLS))
    fixed = ((pv, op, np.full(pv.size, 50.0), np.zeros(pv.size, dtype=bool)) for pv, op in made)
    return tuple(LoopRecord("L", START_S, 1.0, sp, pv, op, bad) for pv, op, sp, bad in fixed)


@cache
def detected() -> tuple[tuple[Raw, Prepared, Oscillations], ...]:
    """Those with what oscillates in them."""
    return tuple((r, p, detect(p.record, DEFAULT.oscillation)) for r, p in ready())


@cache
def measured() -> tuple[tuple[Prepared, Oscillations, Measured], ...]:
    """Those of which models can be fitted, with what was measured of them."""
    out = []
    for r, p, f in detected():
        if unfit_for_cause(p, DEFAULT) or float(np.ptp(p.record.pv)) == 0.0:
            continue
        args = (p.record, counting(f), r.stated, DEFAULT.cause, f.spectrum, r.spec.type)
        m = tried(lambda args=args: measure(*args))
        if isinstance(m, Measured):
            out.append((p, f, m))
    return tuple(out)


@cache
def advised() -> tuple[tuple[Sketch, Assessment], ...]:
    """Simulated loops to be advised on, as assessed by the defaults."""
    sketches = (
        replace(s, process=(s.process[0] * (0.9 + 0.1 * k), *s.process[1:]))
        for s in ADVISED
        for k in range(VARIANTS)
    )
    made = ((s, prepared(simulate(s, 4.0 if s.process[1] < 500 else 8.0))) for s in sketches)
    return tuple((s, assess(p, s.controller, DEFAULT, s.kind)) for s, p in made)


@cache
def plants() -> tuple[tuple[tuple[str, Oscillations, float, Peer], ...], ...]:
    """Loops of coupled plants with what oscillates in them and what their own verdicts say."""
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
                peer = Peer(a.verdict.cause, m.evidence if m else 0.0, a.verdict.confidence[Cause.TUNING])
                loops.append((x.name, a.oscillations, a.start_s + a.duration_s, peer))
        out.append(tuple(loops))
    return tuple(out)


@cache
def weeks() -> tuple[dict[str, np.ndarray], ...]:
    """Hourly figures of two weeks of some loops, the second week changed by nothing to a half."""
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
        hours |= {"sp_travel_pct": 0.2 * moved, "service_pct": 90.0 + 8 * moved, "at_limits_pct": 4 * moved}
        hours |= {"oscillating_pct": 50.0 * moved, "op_variability_pct": noise}
        out.append(hours)
    return tuple(out)
