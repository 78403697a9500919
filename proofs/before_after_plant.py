"""Two weeks of loops of benchmarks/world: between them the loop changes, or only its load, or nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.world.draw import Drawn, one, wander
from benchmarks.world.recorder import Recording, plain
from benchmarks.world.simulate import Controller, Floats, Trends, Valve, sensitivity, simulate

DAYS, DAY_S = 7, 86400
CHANGES = ("retuned", "repaired", "tightened", "slowed")
LOADS = ("load doubled", "load halved", "noise tripled", "set point every hour", "sine from outside")
NOTHING = "nothing"


@dataclass(frozen=True)
class World:
    """Inputs of the loop in one week: size [% OP] and corner [s] of its load, noise [% PV], set point moves per day,
    size [% OP] and period [s] of an external sine."""

    size: float
    corner_s: float
    noise: float
    moves: float
    sine: float = 0.0
    sine_s: float = 300.0


@dataclass(frozen=True)
class Changed:
    """A loop with its truth: the event (of CHANGES, LOADS or NOTHING), settings and valve afterwards, and the inputs
    of both weeks. `stated`: the settings are stated with the change; `every`: seconds between kept samples."""

    drawn: Drawn
    what: str
    controller: Controller
    valve: Valve
    before: World
    after: World
    stated: bool
    every: int
    seed: int
    weeks: tuple[Trends, Trends] = field(repr=False, compare=False, default=())  # type: ignore[assignment]


def _settings_after(d: Drawn, what: str, rng: np.random.Generator) -> Controller:
    """New settings by event: lower gain for a tight loop, longer Ti for a valve with friction, a higher or lower gain
    for a loop without a fault. Where only the load changed, the gain changes by 2 %."""
    c = d.controller
    if what == "retuned":
        late = d.process.dead_s + 0.5 * d.process.second_s
        ti = max(c.ti_s, min(d.process.lag_s or 8 * late, 8 * late)) * rng.uniform(1.0, 2.0)
        kp = c.kp if d.kind == "backlash" else c.kp * rng.uniform(0.35, 0.5)
        return replace(c, kp=kp, ti_s=ti if d.kind != "backlash" else c.ti_s * rng.uniform(3.0, 8.0))
    if what == "tightened":
        return replace(c, kp=c.kp * rng.uniform(1.8, 2.4), ti_s=c.ti_s / rng.uniform(1.5, 3.0))
    if what == "slowed":
        return replace(c, kp=c.kp * rng.uniform(0.3, 0.5))
    return replace(c, kp=c.kp * rng.choice([0.98, 1.02]))


def _world_after(d: Drawn, w: World, what: str) -> World:
    if what == "load doubled":
        return replace(w, size=2.0 * w.size)
    if what == "load halved":
        return replace(w, size=0.5 * w.size)
    if what == "noise tripled":
        return replace(w, noise=3.0 * w.noise)
    if what == "set point every hour":
        return replace(w, moves=24.0)
    if what == "sine from outside":
        return replace(
            w, sine=3.0 * max(w.size, 0.4), sine_s=d.ms and 2.0 * sensitivity(d.process, d.controller)[1]
        )
    return w


def _sequences(w: World, d: Drawn, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Load, noise and set point of a week, shape (n,) each; the days differ by about 15 %."""
    n, h = DAYS * DAY_S, d.controller.scan_s
    strength = np.repeat(np.exp(0.15 * rng.standard_normal(DAYS)), DAY_S)
    load = w.size * strength * wander(rng, n, w.corner_s, h)
    load += w.sine * np.sin(2 * math.pi * np.arange(n) * h / max(w.sine_s, 1.0))
    sp = np.full(n, 50.0)
    starts = np.arange(0, n, 3600) if w.moves == 24 else np.sort(rng.integers(0, n, round(w.moves * DAYS)))
    for k in starts:
        sp[k:] = 50.0 + rng.uniform(-3, 3)
    return load, w.noise * rng.standard_normal(n), sp


def week(c: Changed, after: bool, new: bool) -> Trends:
    """The old or the new loop under the load of one week."""
    d = c.drawn
    load, noise, sp = _sequences(
        c.after if after else c.before, d, np.random.default_rng([c.seed, int(after)])
    )
    pid, valve = (c.controller, c.valve) if new else (d.controller, d.valve)
    return simulate(d.process, pid, valve, sp, load, np.zeros(load.size), noise)


def recorded(c: Changed) -> Recording:
    """Both weeks as a historian records them: first the old loop, then the new one."""
    parts = [plain(week(c, after, after), c.every) for after in (False, True)]
    joined = {name: np.concatenate([p[name] for p in parts]) for name in ("sp", "pv", "op")}
    return {"stamp_s": np.arange(joined["pv"].size) * float(c.every), **joined}


def _figures(t: Trends) -> tuple[float, float, float]:
    """Average absolute error [%], stem travel, and OP travel beyond the deadband of the store on its grid [%/h]."""
    hours = t.pv.size * t.scan_s / 3600.0
    moved = (float(np.abs(np.diff(_held(x[::10]))).sum()) / hours for x in (t.stem, t.op))
    return (float(np.mean(np.abs(t.sp - t.pv))), *moved)


def _held(x: Floats, band: float = 0.1) -> Floats:
    """Output of a backlash of width `band` for the input x, shape of x."""
    out, at = np.empty(x.size), x[0]
    for k, value in enumerate(x.tolist()):
        at = min(max(at, value - 0.5 * band), value + 0.5 * band)
        out[k] = at
    return out


def truth(c: Changed) -> dict[str, tuple[float, float]]:
    """Each figure's change by the loop itself and by the load, as logarithms of ratios: means over the loads of both
    weeks and over both loops."""
    of = {
        (a, n): np.log(np.maximum(_figures(week(c, a, n)), 1e-3))
        for a in (False, True)
        for n in (False, True)
    }
    own = 0.5 * (of[False, True] - of[False, False] + of[True, True] - of[True, False])
    load = 0.5 * (of[True, False] - of[False, False] + of[True, True] - of[False, True])
    names = ("average_absolute_error_pct", "stem_travel_pct_per_h", "valve_travel_pct_per_h")
    return {name: (float(a), float(b)) for name, a, b in zip(names, own, load, strict=True)}


def _kind_for(what: str, k: int) -> str:
    if what == "retuned":
        return ("tight", "backlash")[k % 2]
    if what == "repaired":
        return ("backlash", "stiction")[k % 2]
    if what in ("tightened", "slowed"):
        return "healthy"
    return ("healthy", "healthy", "backlash", "tight")[k % 4]


def changed(seed: int, loops: int) -> list[Changed]:
    """`loops` loops, in turn of CHANGES, LOADS and NOTHING, a third each."""
    found, tried = [], 0
    for k in range(loops):
        group, turn = k % 3, k // 3
        what = (CHANGES[turn % 4], LOADS[turn % 5], NOTHING)[group]
        d = None
        while d is None or d.process.dead_s < 6:
            d = one(100_000 * seed + tried, _kind_for(what, turn // (4 if group == 0 else 1)), f"L{k:03d}")
            tried += 1
        rng = np.random.default_rng([seed, k])
        pid = _settings_after(d, what, rng)
        if not sensitivity(d.process, pid)[0] < 8:
            pid = replace(pid, kp=0.75 * pid.kp, ti_s=1.3 * pid.ti_s)
        stated = what in ("retuned", "tightened", "slowed") or (group > 0 and k % 2 == 0)
        pid = pid if stated else d.controller
        scale = d.process.dead_s + d.process.second_s
        size, noise = np.exp(rng.uniform(np.log([0.15, 0.01]), np.log([0.8, 0.08])))
        w = World(
            float(size),
            float(scale * np.exp(rng.uniform(math.log(4), math.log(200)))),
            float(noise),
            float(rng.choice([0, 2])),
        )
        valve = Valve() if what == "repaired" else d.valve
        every = 2 if d.process.dead_s < 10 else 5 if d.process.dead_s < 25 else 10
        found.append(
            Changed(d, what, pid, valve, w, _world_after(d, w, what), stated, every, 1000 * seed + k)
        )
    return found
