"""Loops drawn by seed, with their truths."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from proofs.untidy import trends
from proofs.untidy.loop import Plant, Stem, critical_gain, run
from proofs.untidy.recorder import rounded, swinging_door

CAUSES = ("healthy", "stiction", "backlash", "tuning", "load")
SHARES = (0.35, 0.31, 0.08, 0.1, 0.16)
"""Shares of the causes."""
KINDS = ("flow", "pressure", "level", "temperature")
LONGEST = 90_000
"""Most scans that are simulated."""


@dataclass(frozen=True)
class Drawn:
    """A recorded loop: SP, PV and OP [%], shape (n,), at step_s [s]; plant; truth with the names of wild's
    truth.json."""

    sp: np.ndarray
    pv: np.ndarray
    op: np.ndarray
    step_s: float
    kind: str
    plant: Plant
    truth: dict[str, Any]


def _plant(rng: np.random.Generator, kind: str) -> Plant:
    """A process of that kind with a controller between slow and fast (internal model control, Rivera 1986)."""
    ranges = {
        "flow": (2, 8, 1, 3),
        "pressure": (8, 50, 1, 6),
        "level": (200, 800, 1, 8),
        "temperature": (40, 160, 4, 35),
    }
    low, high, soon, late = ranges[kind]
    first, dead = np.exp(rng.uniform(math.log(low), math.log(high))), rng.uniform(soon, late)
    gain = rng.uniform(0.6, 2.5)
    second = first * rng.uniform(0, 0.3) if rng.random() < 0.5 else 0.0
    lag = rng.choice([1.0, 1.0, rng.uniform(1.5, 5)])
    wait = dead + 0.5 * second + lag
    closed = wait * rng.uniform(1.2, 4)
    if kind == "level":
        gain *= first / 60.0
        kp, ti = first / gain * 1.0 / (closed + wait), 4 * (closed + wait) * rng.uniform(0.8, 1.6)
    else:
        kp, ti = (
            (first + 0.5 * second) / gain / (closed + wait),
            (first + 0.5 * second) * rng.uniform(0.9, 1.3),
        )
    if kind == "flow" and rng.random() < 0.6:
        slow = rng.uniform(1.2, 4)
        kp, ti = kp / slow, ti * rng.uniform(0.5, 1.2)
    return Plant(gain, first, second, dead, kind == "level", kp, max(ti, 1.5), lag)


def _stem(rng: np.random.Generator, cause: str) -> Stem:
    lag = rng.uniform(0.3, 1.2)
    if cause == "backlash":
        return Stem(lag=lag, backlash=rng.uniform(1.5, 8))
    if cause != "stiction":
        return Stem(lag=lag, backlash=rng.choice([0.0, rng.uniform(0.02, 0.1)]))
    size = rng.uniform(1, 6)
    stem = Stem(size * rng.uniform(0.1, 0.8) ** 1.3, size, rng.choice([0.0, 0.1, 0.25]), lag=lag)
    if rng.random() < 0.15:
        stem = replace(stem, place=50 + rng.normal(0, 2), width=rng.uniform(2, 6))
    if rng.random() < 0.12:
        stem = replace(stem, hunting=rng.uniform(0.05, 0.4))
    return stem


def _correlations(x: np.ndarray, most: int) -> np.ndarray:
    """Unbiased autocorrelation at lags 0 to most."""
    x = x - x.mean()
    f = np.fft.rfft(x, 2 * x.size)
    r = np.fft.irfft(np.abs(f) ** 2)[: min(most, x.size - 1) + 1]
    return r / max(r[0], 1e-300) * x.size / (x.size - np.arange(r.size))


def _returning(x: np.ndarray, most: int) -> tuple[float, float]:
    """Lag [samples] and height of the autocorrelation's highest peak after its first trough; 0, 0: none."""
    r = _correlations(x, most)
    below = np.flatnonzero(r < 0)
    if not below.size:
        return 0.0, 0.0
    at = below[0] + int(np.argmax(r[below[0] :]))
    return float(at), float(r[at])


def _natural(plant: Plant, stem: Stem) -> float:
    """Estimated period of such a loop [scans].

    A stem that slips by J waits while the integral of the remaining error moves OP by the stickband S.
    """
    cycle = (
        6 * plant.ti
        if plant.kp * plant.gain < 0.5 and not plant.integrating
        else 3 * plant.ti + 6 * plant.dead
    )
    jump = 2 * (stem.static - stem.coulomb)
    if plant.integrating or jump <= 0:
        return cycle
    return max(
        cycle, min(4 * (stem.static + stem.coulomb) * plant.ti / (plant.kp * plant.gain * jump), 15 * cycle)
    )


def _signals(
    rng: np.random.Generator, plant: Plant, n: int, scale: float, size: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, str]:
    sp, kind = trends.setpoint(rng, n, rng.uniform(0.1, 1), scale)
    load = trends.load(rng, n, size / max(plant.gain, 0.3) * (0.15 if plant.integrating else 1.0), scale)
    return 50 + sp, load, trends.noise(rng, n, rng.uniform(0.02, 0.3)), kind


def _period(cause: str, with_it: np.ndarray, sp: np.ndarray, guess: float) -> float:
    """True period [scans]: that of the load, of two reversals of the stem, or of the error's autocorrelation."""
    if cause == "tuning":
        r = _correlations(with_it[0] - sp, int(12 * guess))
        quarter = int(np.argmax(r < 0)) or 1
        back = r[2 * quarter : 6 * quarter + 2]
        return float(2 * quarter + np.argmax(back)) if back.size else guess
    reversals = _reversals(with_it[2], int(6 * guess)) if cause in ("stiction", "backlash") else 0
    return 2 * sp.size / reversals if reversals > 5 else guess


def _turning(plant: Plant, stem: Stem, guess: float) -> float:
    """Period [scans] of a loop with its valve under little load, simulated for thirty estimated periods."""
    n = int(min(max(30 * guess, 2000), 40_000))
    rng = np.random.default_rng(1)
    load = 0.05 * rng.standard_normal(n).cumsum() / np.sqrt(np.arange(1, n + 1))
    return _period("stiction", run(plant, stem, np.full(n, 50.0), load, np.zeros(n), rng), load, guess)


def _reversals(stem: np.ndarray, window: int) -> int:
    """Reversals of a stem by more than half of its range within a window [scans], without its slow drift."""
    rows = max(stem.size // max(window, 1), 1)
    cut = stem[: rows * (stem.size // rows)].reshape(rows, -1)
    size = 0.5 * float(np.median(np.ptp(cut, axis=1)))
    reversals, way, far = 0, 0.0, float(stem[0])
    for x in stem:
        if way * (x - far) > 0 or way == 0:
            way = way or float(np.sign(x - far))
            far = x
        elif abs(x - far) > size:
            reversals, way, far = reversals + 1, -way, x
    return reversals


CYCLES = (4.0, 160.0)
"""Least and most cycles in a record."""


def draw(
    seed: int, cause: str | None = None, lengths: tuple[float, float] = CYCLES, worn: bool = False
) -> Drawn:
    """One recorded loop; `worn`: the stem has a visible backlash even where a load is the cause."""
    rng = np.random.default_rng([4711, seed])
    cause = cause or str(rng.choice(CAUSES, p=SHARES))
    kind = (
        "level"
        if cause == "backlash" and rng.random() < 0.6
        else str(rng.choice(KINDS, p=(0.4, 0.2, 0.2, 0.2)))
    )
    plant = without_fault = _plant(rng, kind)
    if cause == "tuning":
        plant = replace(plant, kp=critical_gain(plant) * rng.uniform(0.85, 1.1))
    cycles = float(np.exp(rng.uniform(*np.log(lengths))))
    stem, back = _stem(rng, cause), None
    stem = Stem(lag=stem.lag, backlash=rng.uniform(0.3, 2.5)) if worn else stem
    if cause in ("stiction", "backlash"):
        plant = without_fault = replace(
            plant, kp=plant.kp * rng.uniform(1, 2.5), ti=plant.ti * rng.uniform(0.5, 1)
        )
    period = _natural(plant, stem)
    if cause in ("stiction", "backlash"):
        period = _turning(plant, stem, period)
    if cause == "load":
        period = period * np.exp(rng.uniform(math.log(0.5), math.log(6)))
    n = int(min(max(1.5 * cycles * period, 900), LONGEST))
    sp, load, noise, moves = _signals(rng, plant, n, period, rng.uniform(0.02, 0.3))
    if cause == "load":
        back = trends.periodic(rng, n, period) * rng.uniform(0.5, 4) * (0.3 if plant.integrating else 1.0)
    state = int(rng.integers(2**31))
    with_it = run(plant, stem, sp, load if back is None else load + back, noise, np.random.default_rng(state))
    idle = Stem(lag=stem.lag)
    without = run(without_fault, idle, sp, load, noise, np.random.default_rng(state))
    return _recorded(rng, (sp, with_it, without), cause, kind, plant, cycles, period, moves)


def _recorded(
    rng: np.random.Generator,
    runs: tuple[np.ndarray, np.ndarray, np.ndarray],
    cause: str,
    kind: str,
    plant: Plant,
    cycles: float,
    guess: float,
    moves: str,
) -> Drawn:
    sp, with_it, without = runs
    begin = sp.size // 10
    sp, with_it, without = sp[begin:], with_it[:, begin:], without[:, begin:]
    period = _period(cause, with_it, sp, guess)
    n = int(min(max(cycles * period, 250), sp.size))
    step = max(int(period / np.exp(rng.uniform(math.log(4), math.log(100)))), 1)
    step = max(min(step, 60, n // 220), 1)
    sp, pv, op = sp[:n], with_it[0, :n], with_it[1, :n]
    e, calm = sp - pv, sp - without[0, :n]
    parts = np.array(
        [
            np.std(a) / max(np.std(b), 1e-9)
            for a, b in zip(np.array_split(e, 8), np.array_split(calm, 8), strict=True)
        ]
    )
    grid = float(rng.choice([0.0, 0.0, 0.02, 0.1, 0.3]))
    kept = [rounded(x[::step], g) for x, g in ((sp, 0.01), (pv, grid), (op, rng.choice([0.0, 0.01, 0.1])))]
    packed = bool(rng.random() < 0.22)
    if packed:
        share = rng.uniform(0.1, 0.5)
        kept[1:] = [swinging_door(x, share * np.std(np.diff(x, n=1)) + 0.02, 120) for x in kept[1:]]
    truth = {
        "cause": cause,
        "kind": kind,
        "swell": float(np.std(e) / max(np.std(calm), 1e-9)),
        "steady": float(np.mean(parts >= 1.3)),
        "rhythm": _returning(kept[0] - kept[1], int(1.5 * period / step) + 2)[1]
        if cause != "healthy"
        else 0.0,
        "cycles": n / period,
        "samples_a_cycle": period / step,
        "period": period,
        "step": step,
        "packed": packed,
        "known": bool(rng.random() < 0.5),
        "sp_known": bool(rng.random() < 0.7),
        "moves": moves,
    }
    return Drawn(kept[0], kept[1], kept[2], float(step), kind, plant, truth)
