"""Faults that make a loop oscillate; each is tested on its loop alone before it is used."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from proofs.coupled import response, trends
from proofs.coupled.kernel import Plant, Trends, simulate
from proofs.coupled.measure import lasting, period, returning, spread
from proofs.coupled.trends import log_uniform

CAUSES = ("stiction", "backlash", "tuning", "load")
SHARES = (0.5, 0.22, 0.14, 0.14)
"""Shares of the faults in the draws; valve faults are more often without a cycle than the others."""
SWELL = 1.5
"""Least ratio of a source's error to that without its fault."""
SPARE = 1.1
"""Additional factor of that ratio on the loop alone, because couplings reduce it."""
RHYTHM = {"stiction": 0.3, "backlash": 0.3, "tuning": 0.2, "load": 0.3}
"""Least returning peak of the error's autocorrelation, by cause: ringing that noise sustains is less regular."""
LASTS = 0.75
"""Least share of the record in which a source's error is more than BY times that without its fault."""
BY = 1.2
FINEST = 7.0
"""Least number of samples in a cycle."""
CYCLES = 12.0
"""Least number of cycles in the record."""
TRIES = 10
"""Most draws of one fault."""
STICKBAND = (0.6, 5.0)
"""Stickband of a sticking valve [% OP]."""
BACKLASH = (1.5, 10.0)
"""Width of backlash [% OP]."""
RINGING = (0.86, 0.985)
"""Gain of a loop that rings, relative to the critical gain."""
GROWING = (1.01, 1.08)
"""The same of an unstable loop, whose oscillation grows until OP reaches its limits."""
GROWS = 0.08
"""Share of unstable loops."""
BEAT = 0.4
"""Largest periodic load, relative to one that would move the PV by its whole span at the loop's most sensitive
period."""
SCALES = (0.2, 5.0)
"""Factors by which a loop is made slower or faster to match a period."""


@dataclass(frozen=True)
class Fault:
    """The changes of a fault: values of the loop with and without it, values only with it, its own trend."""

    cause: str
    common: dict[str, float]
    values: dict[str, float]
    own: np.ndarray | None


@dataclass(frozen=True)
class Shown:
    """The effect of a fault on its loop alone: ratio of errors, period [s], amplitudes of PV and stem [%], whether it
    is usable."""

    swell: float
    period_s: float
    pv: float
    stem: float
    good: bool


@dataclass
class Bench:
    """A plant under construction: without and with its faults, its trends, each loop's natural period [s] and height
    (n, 2), the spread of the errors without a fault (n,), scans before the record, and the faults with their
    effects."""

    without_fault: Plant
    faulty: Plant
    trends: Trends
    natural: np.ndarray
    calm: np.ndarray
    warm: int
    faults: dict[int, tuple[Fault, Shown]]

    def keep(self, i: int, fault: Fault, shown: Shown) -> None:
        """Add a fault to the plant."""
        self.without_fault, self.faulty = _pair(self.without_fault, self.faulty, i, fault)
        if fault.own is not None:
            self.trends.own[i] = fault.own
        self.faults[i] = (fault, shown)

    def without(self, at: list[int]) -> Plant:
        """The plant without the faults of those loops."""
        plant = self.faulty
        for i in at:
            plant = plant.changed(
                i, **{k: getattr(self.without_fault, k)[i] for k in self.faults[i][0].values}
            )
        return plant


def _pair(intact: Plant, faulty: Plant, i: int, fault: Fault) -> tuple[Plant, Plant]:
    intact, faulty = (x.changed(i, **fault.common) if fault.common else x for x in (intact, faulty))
    return intact, faulty.changed(i, **fault.values)


def _stiction(rng: np.random.Generator, bench: Bench, i: int) -> Fault:
    band, jump = log_uniform(rng, *STICKBAND), rng.uniform(0.15, 0.9)
    brisk = {
        "kp": bench.without_fault.kp[i] * rng.uniform(0.8, 1.6),
        "ti": bench.without_fault.ti[i] * rng.uniform(0.5, 1),
    }
    values = {"stick": band * (1 + jump) / 2, "slip": band * (1 - jump) / 2}
    values["scatter"] = rng.choice([0.0, 0.1, 0.2])
    return Fault("stiction", brisk, values, rng.standard_normal(bench.trends.sp.shape[0]))


def _backlash(rng: np.random.Generator, bench: Bench, i: int) -> Fault:
    p, brisk = bench.without_fault, {}
    if not p.integrating[i]:
        brisk["ti"] = p.ti[i] * rng.uniform(0.4, 0.8)
        brisk["kp"] = response.critical_gain(p.changed(i, **brisk), i) * rng.uniform(0.45, 0.75)
    else:
        brisk = {"kp": p.kp[i] * rng.uniform(0.7, 1.5), "ti": p.ti[i] * rng.uniform(0.4, 0.9)}
    return Fault("backlash", brisk, {"backlash": log_uniform(rng, *BACKLASH)}, None)


def _tuning(rng: np.random.Generator, bench: Bench, i: int) -> Fault:
    ti = bench.without_fault.ti[i] * log_uniform(rng, 0.25, 1.2)
    critical = response.critical_gain(bench.without_fault.changed(i, ti=ti), i)
    near = rng.uniform(*(GROWING if rng.random() < GROWS else RINGING))
    return Fault("tuning", {}, {"kp": critical * near, "ti": ti}, None)


def _load(rng: np.random.Generator, bench: Bench, i: int, at: float = 0.0) -> Fault:
    step, n = bench.without_fault.step, bench.trends.sp.shape[0]
    cycle = at or max(bench.natural[i, 0] * log_uniform(rng, 0.6, 5), FINEST * step)
    answer = abs(response.load_to_error(bench.without_fault, i, np.array([2 * np.pi / cycle]))[0])
    size = np.sqrt(2) * bench.calm[i] * np.sqrt(log_uniform(rng, 1.8, 6) ** 2 - 1) / max(answer, 1e-6)
    size = min(size, 100 * BEAT / max(bench.natural[i, 1], 1e-6))
    return Fault("load", {}, {"beat": size}, trends.beat(rng, n, cycle / step))


def tried(bench: Bench, i: int, fault: Fault) -> Shown:
    """Simulate a loop alone, with the partner of its cascade, with and without a fault."""
    at = [i, *(int(x[i]) for x in (bench.without_fault.master, bench.without_fault.slave) if x[i] >= 0)]
    at.sort()
    k, part = at.index(i), bench.trends.part(at)
    if fault.own is not None:
        part.own[k] = fault.own
    intact, faulty = _pair(bench.without_fault.part(at), bench.without_fault.part(at), k, fault)
    if not (np.isfinite(list(fault.values.values())).all() and faulty.kp[k] > 0):
        return Shown(0.0, 0.0, 0.0, 0.0, False)
    ran, calm = simulate(faulty, part, stems=True), simulate(intact, part)
    pv, e, op, stem = (x[bench.warm :, k] for x in (ran.pv, ran.sp - ran.pv, ran.op, ran.stem))
    least = spread((calm.sp - calm.pv)[bench.warm :, k])
    swell = float(spread(e) / least)
    if swell < SWELL * SPARE:
        return Shown(swell, 0.0, 0.0, 0.0, False)
    cycle, step = period(pv), bench.without_fault.step
    good = FINEST <= cycle <= pv.size / CYCLES
    good = good and cycling(e, cycle, least, fault.cause) and bool(np.mean((pv <= 0) | (pv >= 100)) < 0.05)
    if good and fault.cause in ("stiction", "backlash"):
        back, height = returning(stem)
        good = height >= RHYTHM[fault.cause] and abs(back / cycle - 1) < 0.2
    if fault.cause != "tuning":
        good = good and bool(np.mean((op <= 0) | (op >= 100)) < 0.1)
    return Shown(swell, cycle * step, np.sqrt(2) * float(spread(pv)), np.sqrt(2) * float(spread(stem)), good)


def cycling(e: np.ndarray, cycle: float, calm: float, cause: str) -> bool:
    """Whether an error is periodic over the whole record, compared with its spread without the fault."""
    return returning(e)[1] >= RHYTHM[cause] and lasting(e, cycle, BY * calm) >= LASTS


def fitting(bench: Bench, i: int, cause: str) -> bool:
    """Whether a loop can have that fault: a master has no valve."""
    return i not in bench.faults and not (
        cause in ("stiction", "backlash") and bench.without_fault.slave[i] >= 0
    )


DRAWS = {"stiction": _stiction, "backlash": _backlash, "tuning": _tuning, "load": _load}


def add(rng: np.random.Generator, bench: Bench, i: int, cause: str) -> bool:
    """Give loop i a visible fault; False where no draw is visible."""
    for _ in range(TRIES):
        fault = DRAWS[cause](rng, bench, i)
        shown = tried(bench, i, fault)
        if shown.good:
            bench.keep(i, fault, shown)
            return True
    return False


def _slower(p: Plant, i: int, fault: Fault, times: float) -> Fault:
    """The same loop and fault with all times of the loop multiplied by a factor."""
    common = {**fault.common}
    for name in ("first", "second", "ti"):
        common[name] = common.get(name, getattr(p, name)[i]) * times
    common["dead"] = max(round(common.get("dead", p.dead[i]) * times), 1)
    values = {k: v * times if k == "ti" else v for k, v in fault.values.items()}
    return replace(fault, common=common, values=values)


def add_matched(
    rng: np.random.Generator, bench: Bench, i: int, cause: str, cycle: float, within: float
) -> bool:
    """Give loop i a fault with nearly that period [s]; False where none is near enough."""
    aim = cycle * (1 + rng.uniform(-within, within))
    for _ in range(3):
        fault = _load(rng, bench, i, aim) if cause == "load" else DRAWS[cause](rng, bench, i)
        for _ in range(5):
            shown = tried(bench, i, fault)
            if shown.good and abs(shown.period_s / cycle - 1) <= within:
                bench.keep(i, fault, shown)
                return True
            first = fault.common.get("first", bench.without_fault.first[i]) / bench.without_fault.first[i]
            if cause == "load" or not shown.period_s:
                break
            if not SCALES[0] <= first * aim / shown.period_s <= SCALES[1]:
                break
            fault = _slower(bench.without_fault, i, fault, aim / shown.period_s)
    return False
