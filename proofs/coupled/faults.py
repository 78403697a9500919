"""Faults that make a loop oscillate, each tried on its loop alone before it is kept."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from proofs.coupled import response, trends
from proofs.coupled.kernel import Plant, Trends, simulate
from proofs.coupled.measure import lasting, period, returning, spread
from proofs.coupled.trends import log_uniform

CAUSES = ("stiction", "backlash", "tuning", "load")
SHARES = (0.5, 0.22, 0.14, 0.14)
"""How often each is drawn; valves fail to cycle oftener than the others."""
SWELL = 1.5
"""A source's error is spread at least so much more than without its fault."""
SPARE = 1.1
"""So much more than that alone on its loop, as couplings take some away."""
RHYTHM = {"stiction": 0.3, "backlash": 0.3, "tuning": 0.2, "load": 0.3}
"""Least returning peak of the error, by cause: ringing that noise sustains is less regular."""
LASTS = 0.75
"""Least share of the record in which a source's error is spread by more than BY times that without its fault."""
BY = 1.2
FINEST = 7.0
"""Samples in a cycle at least."""
CYCLES = 12.0
"""Cycles in the record at least."""
TRIES = 10
"""Draws of one fault at most."""
STICKBAND = (0.6, 5.0)
"""Of a sticking valve [% OP]."""
PLAY = (1.5, 10.0)
"""Of a worn linkage [% OP]."""
RINGING = (0.86, 0.985)
"""Gain of a loop that rings, over the critical one."""
GROWING = (1.01, 1.08)
"""Of one that grows until OP meets its limits."""
GROWS = 0.08
"""Share of those."""
BEAT = 0.4
"""Largest periodic load over what would move the PV by its whole span at the loop's most sensitive period."""
SCALES = (0.2, 5.0)
"""How far a loop is made slower or faster to match a period."""


@dataclass(frozen=True)
class Fault:
    """What a fault changes: values of the loop with and without it, what with it alone, its own trend."""

    cause: str
    common: dict[str, float]
    values: dict[str, float]
    own: np.ndarray | None


@dataclass(frozen=True)
class Shown:
    """What a fault did on its loop alone: swell, period [s], amplitudes of PV and stem [%], whether it will do."""

    swell: float
    period_s: float
    pv: float
    stem: float
    good: bool


@dataclass
class Bench:
    """A plant being drawn: without and with its faults, its trends, each loop's natural period [s] and height
    (n, 2), the spread of sound errors (n,), scans before the record, and the faults so far with what they did."""

    sound: Plant
    faulty: Plant
    trends: Trends
    natural: np.ndarray
    calm: np.ndarray
    warm: int
    faults: dict[int, tuple[Fault, Shown]]

    def keep(self, i: int, fault: Fault, shown: Shown) -> None:
        """Take a fault into the plant."""
        self.sound, self.faulty = _pair(self.sound, self.faulty, i, fault)
        if fault.own is not None:
            self.trends.own[i] = fault.own
        self.faults[i] = (fault, shown)

    def without(self, at: list[int]) -> Plant:
        """The plant with those loops' faults taken away."""
        plant = self.faulty
        for i in at:
            plant = plant.changed(i, **{k: getattr(self.sound, k)[i] for k in self.faults[i][0].values})
        return plant


def _pair(sound: Plant, faulty: Plant, i: int, fault: Fault) -> tuple[Plant, Plant]:
    sound, faulty = (x.changed(i, **fault.common) if fault.common else x for x in (sound, faulty))
    return sound, faulty.changed(i, **fault.values)


def _stiction(rng: np.random.Generator, bench: Bench, i: int) -> Fault:
    band, jump = log_uniform(rng, *STICKBAND), rng.uniform(0.15, 0.9)
    brisk = {"kp": bench.sound.kp[i] * rng.uniform(0.8, 1.6), "ti": bench.sound.ti[i] * rng.uniform(0.5, 1)}
    values = {"stick": band * (1 + jump) / 2, "slip": band * (1 - jump) / 2}
    values["scatter"] = rng.choice([0.0, 0.1, 0.2])
    return Fault("stiction", brisk, values, rng.standard_normal(bench.trends.sp.shape[0]))


def _backlash(rng: np.random.Generator, bench: Bench, i: int) -> Fault:
    p, brisk = bench.sound, {}
    if not p.integrating[i]:
        brisk["ti"] = p.ti[i] * rng.uniform(0.4, 0.8)
        brisk["kp"] = response.critical_gain(p.changed(i, **brisk), i) * rng.uniform(0.45, 0.75)
    else:
        brisk = {"kp": p.kp[i] * rng.uniform(0.7, 1.5), "ti": p.ti[i] * rng.uniform(0.4, 0.9)}
    return Fault("backlash", brisk, {"play": log_uniform(rng, *PLAY)}, None)


def _tuning(rng: np.random.Generator, bench: Bench, i: int) -> Fault:
    ti = bench.sound.ti[i] * log_uniform(rng, 0.25, 1.2)
    critical = response.critical_gain(bench.sound.changed(i, ti=ti), i)
    near = rng.uniform(*(GROWING if rng.random() < GROWS else RINGING))
    return Fault("tuning", {}, {"kp": critical * near, "ti": ti}, None)


def _load(rng: np.random.Generator, bench: Bench, i: int, at: float = 0.0) -> Fault:
    step, n = bench.sound.step, bench.trends.sp.shape[0]
    turn = at or max(bench.natural[i, 0] * log_uniform(rng, 0.6, 5), FINEST * step)
    answer = abs(response.load_to_error(bench.sound, i, np.array([2 * np.pi / turn]))[0])
    size = np.sqrt(2) * bench.calm[i] * np.sqrt(log_uniform(rng, 1.8, 6) ** 2 - 1) / max(answer, 1e-6)
    size = min(size, 100 * BEAT / max(bench.natural[i, 1], 1e-6))
    return Fault("load", {}, {"beat": size}, trends.beat(rng, n, turn / step))


def tried(bench: Bench, i: int, fault: Fault) -> Shown:
    """Run a fault on its loop alone, with the partner of its cascade, and without it."""
    at = [i, *(int(x[i]) for x in (bench.sound.master, bench.sound.slave) if x[i] >= 0)]
    at.sort()
    k, part = at.index(i), bench.trends.part(at)
    if fault.own is not None:
        part.own[k] = fault.own
    sound, faulty = _pair(bench.sound.part(at), bench.sound.part(at), k, fault)
    if not (np.isfinite(list(fault.values.values())).all() and faulty.kp[k] > 0):
        return Shown(0.0, 0.0, 0.0, 0.0, False)
    ran, calm = simulate(faulty, part, stems=True), simulate(sound, part)
    pv, e, op, stem = (x[bench.warm :, k] for x in (ran.pv, ran.sp - ran.pv, ran.op, ran.stem))
    least = spread((calm.sp - calm.pv)[bench.warm :, k])
    swell = float(spread(e) / least)
    if swell < SWELL * SPARE:
        return Shown(swell, 0.0, 0.0, 0.0, False)
    turn, step = period(pv), bench.sound.step
    good = FINEST <= turn <= pv.size / CYCLES
    good = good and cycling(e, turn, least, fault.cause) and bool(np.mean((pv <= 0) | (pv >= 100)) < 0.05)
    if good and fault.cause in ("stiction", "backlash"):
        back, height = returning(stem)
        good = height >= RHYTHM[fault.cause] and abs(back / turn - 1) < 0.2
    if fault.cause != "tuning":
        good = good and bool(np.mean((op <= 0) | (op >= 100)) < 0.1)
    return Shown(swell, turn * step, np.sqrt(2) * float(spread(pv)), np.sqrt(2) * float(spread(stem)), good)


def cycling(e: np.ndarray, turn: float, calm: float, cause: str) -> bool:
    """Whether an error comes back all through the record, against its spread without the fault."""
    return returning(e)[1] >= RHYTHM[cause] and lasting(e, turn, BY * calm) >= LASTS


def fitting(bench: Bench, i: int, cause: str) -> bool:
    """Whether a loop can have that fault: a master has no valve."""
    return i not in bench.faults and not (cause in ("stiction", "backlash") and bench.sound.slave[i] >= 0)


DRAWS = {"stiction": _stiction, "backlash": _backlash, "tuning": _tuning, "load": _load}


def add(rng: np.random.Generator, bench: Bench, i: int, cause: str) -> bool:
    """Give loop i a fault that shows; False: none of the draws did."""
    for _ in range(TRIES):
        fault = DRAWS[cause](rng, bench, i)
        shown = tried(bench, i, fault)
        if shown.good:
            bench.keep(i, fault, shown)
            return True
    return False


def _slower(p: Plant, i: int, fault: Fault, times: float) -> Fault:
    """The same loop and fault with all times of the loop scaled."""
    common = {**fault.common}
    for name in ("first", "second", "ti"):
        common[name] = common.get(name, getattr(p, name)[i]) * times
    common["dead"] = max(round(common.get("dead", p.dead[i]) * times), 1)
    values = {k: v * times if k == "ti" else v for k, v in fault.values.items()}
    return replace(fault, common=common, values=values)


def add_matched(
    rng: np.random.Generator, bench: Bench, i: int, cause: str, turn: float, within: float
) -> bool:
    """Give loop i a fault of nearly that period [s]; False: none came that near."""
    aim = turn * (1 + rng.uniform(-within, within))
    for _ in range(3):
        fault = _load(rng, bench, i, aim) if cause == "load" else DRAWS[cause](rng, bench, i)
        for _ in range(5):
            shown = tried(bench, i, fault)
            if shown.good and abs(shown.period_s / turn - 1) <= within:
                bench.keep(i, fault, shown)
                return True
            first = fault.common.get("first", bench.sound.first[i]) / bench.sound.first[i]
            if cause == "load" or not shown.period_s:
                break
            if not SCALES[0] <= first * aim / shown.period_s <= SCALES[1]:
                break
            fault = _slower(bench.sound, i, fault, aim / shown.period_s)
    return False
