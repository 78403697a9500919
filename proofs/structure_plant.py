"""A plant with its structure: cascades, ratios and single loops, some with a fault, and the truth.

Shares no code with the analyzer or with the other generators. Controllers are PI in position form with back
calculation. A valve sticks by He's model, or has backlash. A slave's set point is its master's OP in the slave's
unit; a ratio loop's set point is a multiple of its leader's PV. Seconds and percent of spans inside, units of the
plant in the recording.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STEP_S = 1.0
"""Scan of all controllers [s]."""


@dataclass(frozen=True)
class Part:
    """A controller with its process: percent of spans and seconds.

    lag_s: 0 for an integrator with `gain` per second; backlash, stick, jump: the valve's faults [% OP], without
    meaning in a master; noise of PV, the load's spread and its time constant at the process input.
    """

    gain: float
    lag_s: float
    dead_s: float
    kp: float
    ti: float
    noise: float = 0.05
    load: float = 0.0
    load_s: float = 1200.0
    backlash: float = 0.0
    stick: float = 0.0
    jump: float = 0.0


@dataclass(frozen=True)
class Unit:
    """Loops that are built together: a single loop, a master with its slave, or a leader with a follower that keeps a
    ratio; `without_fault`: the same parts without the fault."""

    kind: str
    cause: str
    parts: tuple[Part, ...]
    names: tuple[str, ...]
    types: tuple[str, ...]
    spans: tuple[tuple[float, float], ...]
    ratio: float = 1.0
    moves: float = 0.0
    seed: int = 0
    without_fault: tuple[Part, ...] = ()


@dataclass
class Plant:
    """Recorded trends by tag, every `every_s` seconds; the contents of loops.csv; and the truth, by loop."""

    tags: dict[str, Floats] = field(default_factory=dict)
    stated: list[dict[str, object]] = field(default_factory=list)
    truth: dict[str, dict[str, object]] = field(default_factory=dict)
    every_s: float = 2.0


@njit(cache=True)
def stem_after(stem: float, op: float, backlash: float, stick: float, jump: float) -> float:
    """The stem after one scan: moved by the ends of the backlash, or released by a force and held again nearer (He
    2007)."""
    if backlash > 0.0:
        return min(max(stem, op - 0.5 * backlash), op + 0.5 * backlash)
    if stick > 0.0:
        static, kinetic = 0.5 * (stick + jump), 0.5 * (stick - jump)
        push = op - stem
        if abs(push) > static:
            return op - math.copysign(kinetic, push)
        return stem
    return op


@njit(cache=True)
def simulate(
    n: int,
    setting: Floats,
    target: Floats,
    loads: Floats,
    noises: Floats,
    wired: Floats,
) -> tuple[Floats, Floats, Floats]:
    """SP, PV and OP of one or two loops, shape (loops, n), scan by scan.

    setting: for each loop gain, lag, dead time, kp, ti, backlash, stick, jump, shape (loops, 8).
    target: the given set point, shape (n,); loads, noises: shape (loops, n).
    wired: (0, 0) a single loop, (1, 0) the first is the second's master, (2, ratio) the second keeps a ratio to
    the first's PV.
    """
    loops = setting.shape[0]
    sp, pv, op = np.empty((loops, n)), np.empty((loops, n)), np.empty((loops, n))
    x, total, stem = np.zeros(loops), np.full(loops, 50.0), np.full(loops, 50.0)
    longest = int(np.max(setting[:, 2])) + 2
    late = np.full((loops, longest), 50.0)
    for k in range(n):
        for i in range(loops):
            gain, lag, dead, kp, ti, backlash, stick, jump = setting[i]
            if i == 1 and wired[0] == 1.0:
                sp[i, k] = op[0, k]
            elif i == 1 and wired[0] == 2.0:
                sp[i, k] = 50.0 + wired[1] * (pv[0, k] - 50.0)
            else:
                sp[i, k] = target[k]
            pv[i, k] = 50.0 + x[i] + noises[i, k]
            error = sp[i, k] - pv[i, k]
            wanted = total[i] + kp * error
            op[i, k] = min(max(wanted, 0.0), 100.0)
            total[i] += kp * error / ti + (op[i, k] - wanted) / ti
            if i == 1 or wired[0] != 1.0:
                stem[i] = stem_after(stem[i], op[i, k], backlash, stick, jump)
        for i in range(loops):
            gain, lag, dead = setting[i, 0], setting[i, 1], setting[i, 2]
            moved = 50.0 + x[1] if i == 0 and wired[0] == 1.0 else stem[i]
            late[i, k % longest] = moved + loads[i, k]
            drive = late[i, (k - int(dead)) % longest] - 50.0
            if lag > 0.0:
                x[i] += (gain * drive - x[i]) * (1.0 - math.exp(-1.0 / lag))
            else:
                x[i] += gain * drive
    return sp, pv, op


def wander(rng: np.random.Generator, n: int, spread: float, corner_s: float) -> Floats:
    """A load that wanders about zero, with occasional steps."""
    out = np.empty(n)
    keep, level = math.exp(-1.0 / corner_s), 0.0
    kicks = spread * math.sqrt(1.0 - keep**2) * rng.standard_normal(n)
    for k in range(n):
        level = keep * level + kicks[k]
        out[k] = level
    for at in rng.integers(0, n, rng.poisson(n / 14400.0)):
        out[at:] += 1.5 * spread * rng.standard_normal()
    return out


def run(unit: Unit, hours: float) -> tuple[Floats, Floats, Floats]:
    """SP, PV and OP of a unit's loops in percent of spans, one value a second, shape (loops, n)."""
    rng = np.random.default_rng(unit.seed)
    warm, n = 3600, int(3600 * hours) + 3600
    target = np.full(n, 50.0)
    if unit.moves:
        for at in np.cumsum(rng.exponential(5400.0, 2 * int(hours) + 2)).astype(int):
            if at < n:
                target[at:] = 50.0 + unit.moves * rng.uniform(-1.0, 1.0)
    setting = np.array(
        [(p.gain, p.lag_s, p.dead_s, p.kp, p.ti, p.backlash, p.stick, p.jump) for p in unit.parts],
        dtype=float,
    )
    loads = np.array([wander(rng, n, p.load, p.load_s) for p in unit.parts])
    noises = np.array([p.noise * rng.standard_normal(n) for p in unit.parts])
    wired = {"lone": (0.0, 0.0), "cascade": (1.0, 0.0), "ratio": (2.0, unit.ratio)}[unit.kind]
    found = simulate(n, setting, target, loads, noises, np.array(wired))
    return tuple(x[:, warm:] for x in found)  # type: ignore[return-value]


def flow(rng: np.random.Generator) -> Part:
    """A flow with its controller: a lag of one or a few seconds, and an integral time of the same size."""
    gain, lag = float(rng.uniform(0.7, 1.8)), float(rng.uniform(3.0, 8.0))
    kp, ti = float(rng.uniform(0.25, 0.6)) / gain, lag * float(rng.uniform(1.0, 2.0))
    return Part(gain, lag, float(rng.integers(1, 3)), kp, ti, float(rng.uniform(0.05, 0.25)), 0.4, 300.0)


def over(rng: np.random.Generator) -> tuple[Part, str]:
    """The process that a slave's flow moves: a level, or a temperature with a lag; its controller is three to eight
    times as slow."""
    if rng.random() < 0.5:
        rate = float(np.exp(rng.uniform(np.log(2e-4), np.log(2e-3))))
        closed = float(rng.uniform(90.0, 300.0))
        return Part(rate, 0.0, 5.0, 1.0 / (rate * closed), 4.0 * closed, 0.05, 1.0, 2400.0), "level"
    lag, dead = float(rng.uniform(120.0, 600.0)), float(rng.uniform(10.0, 40.0))
    gain = float(rng.uniform(0.6, 1.6))
    closed = 2.0 * dead + float(rng.uniform(20.0, 60.0))
    return Part(
        gain, lag, dead, lag / (gain * (closed + dead)), min(lag, 4 * (closed + dead)), 0.04, 2.0
    ), "temperature"


FAULTS = ("stick", "play", "healthy", "tight master", "tight slave")


def cascade(rng: np.random.Generator, number: int) -> Unit:
    """A cascade with one fault, or none."""
    master, kind = over(rng)
    slave, cause = flow(rng), str(rng.choice(FAULTS, p=(0.35, 0.2, 0.2, 0.15, 0.1)))
    intact = master, slave
    if cause == "stick":
        stick = float(rng.uniform(2.0, 5.0))
        slave = replace(slave, stick=stick, jump=stick * float(rng.uniform(0.3, 0.8)))
    elif cause == "play":
        slave = replace(slave, backlash=float(rng.uniform(2.0, 5.0)))
    elif cause == "tight master":
        master = _tight(master)
    elif cause == "tight slave":
        slave = _tight(slave)
    names = f"{'LIC' if kind == 'level' else 'TIC'}{number}", f"FIC{number}"
    moves = float(rng.choice([0.0, 0.0, 4.0]))
    return Unit(
        "cascade", cause, (master, slave), names, (kind, "flow"), (_span(rng), _span(rng)), moves=moves,
        seed=int(rng.integers(1 << 30)), without_fault=intact,
    )  # fmt: skip


def _tight(part: Part) -> Part:
    """A controller near its stability limit: its gain is slightly below the critical gain of the loop with its dead
    time."""
    if part.lag_s > 0:
        ultimate = (1.0 / part.gain) * (part.lag_s / max(part.dead_s, 1.0)) * 1.5
        return replace(part, kp=0.8 * ultimate, ti=max(2.0 * part.dead_s, 0.5 * part.lag_s))
    ultimate = 1.0 / (part.gain * (part.dead_s + 15.0))
    return replace(part, kp=0.75 * ultimate, ti=4.0 * (part.dead_s + 15.0))


def ratio(rng: np.random.Generator, number: int) -> Unit:
    """Two flows; the second keeps a ratio to the first's PV. In some of them the valve of the first sticks."""
    leader, other = flow(rng), flow(rng)
    intact = leader, other
    cause = str(rng.choice(["healthy", "stick"], p=(0.6, 0.4)))
    if cause == "stick":
        stick = float(rng.uniform(2.0, 5.0))
        leader = replace(leader, stick=stick, jump=stick * 0.6)
    names = f"FIC{number}A", f"FIC{number}B"
    return Unit(
        "ratio", cause, (leader, other), names, ("flow", "flow"), (_span(rng), _span(rng)),
        ratio=float(rng.uniform(0.4, 1.2)), moves=3.0, seed=int(rng.integers(1 << 30)), without_fault=intact,
    )  # fmt: skip


def lone(rng: np.random.Generator, number: int) -> Unit:
    """A single loop: without a fault, or with a valve that sticks or has backlash."""
    part, kind = (flow(rng), "flow") if rng.random() < 0.5 else over(rng)
    cause = str(rng.choice(["healthy", "stick", "play"], p=(0.6, 0.2, 0.2)))
    width, intact = float(rng.uniform(1.5, 4.0)), (part,)
    part = replace(part, **{"stick": width, "jump": 0.5 * width} if cause == "stick" else {})
    part = replace(part, **{"backlash": width} if cause == "play" else {})
    head = {"flow": "FIC", "level": "LIC", "temperature": "TIC"}[kind]
    moves = float(rng.choice([0.0, 3.0]))
    return Unit(
        "lone", cause, (part,), (f"{head}{number}",), (kind,), (_span(rng),), moves=moves,
        seed=int(rng.integers(1 << 30)), without_fault=intact,
    )  # fmt: skip


def _span(rng: np.random.Generator) -> tuple[float, float]:
    """A measuring range as stated by a plant."""
    low = float(rng.choice([0.0, 0.0, 0.0, 20.0]))
    return low, low + float(rng.choice([5.0, 10.0, 40.0, 100.0, 250.0, 1000.0]))


def _spread(error: Floats) -> Floats:
    """Spread of each loop's error."""
    return np.asarray(np.std(error, axis=1))


def plant(seed: int, cascades: int = 10, ratios: int = 4, alone: int = 8, hours: float = 10.0) -> Plant:
    """A plant drawn from a seed, as recorded and as it is; swell is the spread of a loop's error over that without
    the fault."""
    rng = np.random.default_rng(seed)
    drawn = [
        *(cascade(rng, 100 + k) for k in range(cascades)),
        *(ratio(rng, 300 + k) for k in range(ratios)),
        *(lone(rng, 400 + k) for k in range(alone)),
    ]
    out = Plant()
    for unit in drawn:
        sp, pv, op = run(unit, hours)
        swell = _spread(sp - pv) / _spread(
            np.subtract(*run(replace(unit, parts=unit.without_fault), hours)[:2])
        )
        for i, name in enumerate(unit.names):
            low, high = unit.spans[i]
            every = int(out.every_s)
            scale = (high - low) / 100.0
            digits = max(3 - math.floor(math.log10(high - low)), 0) + 1
            for role, x in (("SP", sp), ("PV", pv)):
                out.tags[f"{name}.{role}"] = np.round(low + scale * x[i, ::every], digits)
            out.tags[f"{name}.OP"] = np.round(op[i, ::every], 2)
            p = unit.parts[i]
            out.stated.append(
                {
                    "loop": name,
                    "type": unit.types[i],
                    "pv_lo": low,
                    "pv_hi": high,
                    "kp": round(p.kp, 4),
                    "ti": round(p.ti, 2),
                }
            )
            out.truth[name] = {
                "kind": unit.kind,
                "cause": unit.cause,
                "part": i,
                "master": unit.names[0] if unit.kind == "cascade" and i == 1 else "",
                "ratio_of": unit.names[0] if unit.kind == "ratio" and i == 1 else "",
                "worn": bool(p.stick or p.backlash),
                "swell": float(swell[i]),
            }
    return out
