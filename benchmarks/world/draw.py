"""Loops drawn at random with their truth: the cause of each cycle, and the effect of a perfect repair or retuning."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.world.simulate import (
    BACKLASH,
    HE,
    KANO,
    KARNOPP,
    Controller,
    Floats,
    Process,
    Trends,
    Valve,
    sensitivity,
    simulate,
)

KINDS = ("backlash", "stiction", "tight", "load", "healthy", "worn-sine", "sluggish", "worn-tight")
HOURS = 24
SWELL = 1.5
"""Ratio of the error's spread to that without the fault, from which a loop shows the fault."""
RETURN = 0.35
"""Least first returning peak of the error's autocorrelation for a loop that shows the fault."""


@dataclass(frozen=True)
class Drawn:
    """A loop with its truth.

    kind: as in KINDS; period_s: of the cycle, 0 where there is none; ms: largest sensitivity of the linear loop;
        swell: as SWELL.
    """

    name: str
    kind: str
    process: Process
    controller: Controller
    valve: Valve
    seed: int
    ms: float
    period_s: float
    swell: float
    moves: float

    @property
    def cause(self) -> str:
        """The right value of `cause`."""
        causes = {"backlash": "valve", "stiction": "valve", "tight": "tuning", "worn-tight": "tuning"}
        return causes.get(self.kind, "none" if self.kind in ("healthy", "sluggish") else "load")

    @property
    def fault(self) -> str:
        """The right value of `valve_fault`."""
        if self.valve.kind == BACKLASH:
            return "backlash"
        return "stiction" if self.valve.kind else "none"


def wander(rng: np.random.Generator, n: int, corner_s: float, h: float) -> Floats:
    """White noise through one lag, of variance 1, shape (n,)."""
    pole = math.exp(-h / corner_s)
    start = rng.standard_normal()
    white = rng.standard_normal(n) * math.sqrt(1 - pole**2)
    return np.asarray(lfilter([1.0], [1.0, -pole], white, zi=[pole * start])[0])


def _process(rng: np.random.Generator, kind: str) -> Process:
    """A lag, two lags, an integrator, or a process with a small inverse response."""
    dead = float(np.exp(rng.uniform(math.log(3), math.log(60))))
    form = rng.choice(["lag", "two", "level", "inverse"], p=[0.45, 0.25, 0.22, 0.08])
    ratio = float(np.exp(rng.uniform(math.log(1.2), math.log(25))))
    gain = float(np.exp(rng.uniform(math.log(0.4), math.log(2.5))))
    if form == "level":
        return Process(gain / (ratio * dead * 4), 0.0, 0.2 * dead * (rng.random() < 0.5), dead)
    second = dead * rng.uniform(0.2, 0.8) if form == "two" else 0.0
    return Process(gain, ratio * dead, second, dead, -0.3 * dead if form == "inverse" else 0.0)


def _nominal(p: Process, scan_s: float) -> tuple[float, float]:
    """SIMC settings with tau_c = dead time (Skogestad 2003), half rule for the second lag."""
    late = p.dead_s + 0.5 * p.second_s + max(-p.lead_s, 0.0) + 0.5 * scan_s
    lag = p.lag_s + 0.5 * p.second_s
    if p.lag_s <= 0:
        return 1 / (p.gain * 2 * late), 8 * late
    return lag / (p.gain * 2 * late), min(lag, 8 * late)


def _settings(rng: np.random.Generator, kind: str, p: Process) -> Controller | None:
    """Settings of a kind; None where the drawn settings are not of this kind."""
    scan = 1.0
    kp, ti = _nominal(p, scan)
    if kind in ("tight", "worn-tight"):
        way = rng.choice(["gain", "ti", "both"])
        more = rng.uniform(2.2, 3.6)
        c = Controller(
            kp * (more if way != "ti" else 1.0), ti / (1.0 if way == "gain" else rng.uniform(3, 14)), scan
        )
        ms = sensitivity(p, c)[0]
        return c if 3.8 <= ms <= 9 else None
    if kind == "sluggish":
        return Controller(kp * rng.uniform(0.04, 0.2), ti * rng.uniform(1.0, 6.0), scan)
    if kind in ("backlash", "stiction"):
        c = Controller(kp * rng.uniform(0.5, 1.1), ti * rng.uniform(0.15, 1.0), scan)
    else:
        c = Controller(kp * rng.uniform(0.4, 1.0), ti * rng.uniform(0.9, 2.0), scan)
    return c if sensitivity(p, c)[0] <= 2.3 else None


@dataclass(frozen=True)
class Character:
    """Properties of a plant's loads on all days: corner time [s] and size [% OP] of the random walk, whether it also
    steps, and the standard deviation of PV's noise [% PV]."""

    corner_s: float
    size: float
    steps: bool
    noise: float


def loads(
    d: Drawn, n: int, rng: np.random.Generator, like: Character | None = None
) -> tuple[Floats, Floats, Character]:
    """Load before the process, and noise, shape (n,) each, of a drawn or a given character."""
    h = d.controller.scan_s
    scale = d.process.dead_s + d.process.second_s
    corner = float(np.exp(rng.uniform(math.log(2 * scale), math.log(600 * scale))))
    size = float(np.exp(rng.uniform(math.log(0.15), math.log(0.8))))
    if like is not None:
        corner, size = like.corner_s, like.size
    before = size * wander(rng, n, corner, h)
    steps = rng.random() < 0.4 if like is None else like.steps
    if steps:
        at = rng.integers(0, n, 4)
        for k in at:
            before[k:] += rng.normal() * size * 2
    deviation = float(np.exp(rng.uniform(math.log(0.01), math.log(0.08)))) if like is None else like.noise
    noise = deviation * rng.standard_normal(n)
    if d.kind in ("load", "worn-sine"):
        period = d.period_s
        phase = 2 * math.pi * np.arange(n) * h / period
        if d.kind == "load" and rng.random() < 0.4:  # the period of a neighbour's cycle varies
            phase = phase + 0.15 * np.cumsum(rng.standard_normal(n)) * math.sqrt(h / period) * 2
        periodic = np.sin(phase)
        if d.kind == "load" and rng.random() < 0.3:
            periodic = np.clip(2.0 * periodic, -1, 1)
        before = before + (3.0 if d.kind == "load" else 2.0) * max(size, 0.4) * periodic
    return before, noise, Character(corner, size, steps, deviation)


def set_point(d: Drawn, n: int, rng: np.random.Generator) -> Floats:
    """Set point with d.moves steps a day, shape (n,)."""
    sp = np.full(n, 50.0)
    for k in np.sort(rng.integers(int(0.05 * n), n, int(d.moves))):
        sp[k:] = 50.0 + rng.uniform(-5, 5)
    return sp


def run(
    d: Drawn,
    day: int = 0,
    hours: float = HOURS,
    settings: Controller | None = None,
    valve: Valve | None = None,
    alike: bool = False,
    auto: NDArray[np.bool_] | None = None,
    sp: Floats | None = None,
    more: Floats | None = None,
) -> Trends:
    """One day of a loop, optionally with other settings or another valve under the same load.

    Other days have other loads, of a random character or, with `alike`, of that of the first day. auto, shape (n,):
    False in manual; None: always in automatic. sp: another set point [% PV]; more: a further load before the process
    [% OP], shape (n,).
    """
    n = int(hours * 3600 / d.controller.scan_s)
    like = loads(d, n, np.random.default_rng([d.seed, 0]))[2] if alike and day else None
    rng = np.random.default_rng([d.seed, day])
    before, noise, _ = loads(d, n, rng, like)
    own = set_point(d, n, rng)
    return simulate(
        d.process,
        settings or d.controller,
        d.valve if valve is None else valve,
        own if sp is None else sp,
        before if more is None else before + more,
        np.zeros(n),
        noise,
        auto,
    )


def returning(e: Floats) -> float:
    """First peak of the autocorrelation after its first zero."""
    x = e - e.mean()
    f = np.abs(np.fft.rfft(x, 2 * x.size)) ** 2
    r = np.fft.irfft(f)[: x.size // 3]
    r = r / max(r[0], 1e-30)
    below = np.flatnonzero(r < 0)
    return float(r[below[0] :].max()) if below.size else 0.0


def _period(e: Floats, h: float) -> float:
    """Period of the first returning peak of the autocorrelation [s], 0 where there is none."""
    x = e - e.mean()
    r = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * x.size)) ** 2)[: x.size // 3]
    below = np.flatnonzero(r < 0)
    if not below.size:
        return 0.0
    k = below[0] + int(np.argmax(r[below[0] : below[0] * 6]))
    return float(k * h)


def _valve(rng: np.random.Generator, kind: str) -> Valve:
    band = float(np.exp(rng.uniform(math.log(0.8), math.log(6.0))))
    if kind in ("backlash", "worn-sine", "worn-tight"):
        return Valve(BACKLASH, band)
    if kind == "stiction":
        return Valve(int(rng.choice([HE, KANO, KARNOPP])), band, band * rng.uniform(0.3, 1.0))
    return Valve()


def one(seed: int, kind: str, name: str) -> Drawn | None:
    """A loop of a kind; None where the draw does not show it clearly, or where a loop without a fault oscillates."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    p = _process(rng, kind)
    c = _settings(rng, kind, p)
    if c is None:
        return None
    ms, resonance = sensitivity(p, c)
    valve = _valve(rng, kind)
    moves = float(rng.choice([4, 8, 16] if kind == "sluggish" else [0, 0, 2, 8]))
    d = Drawn(name, kind, p, c, valve, seed, ms, resonance, 1.0, moves)
    if kind in ("load", "worn-sine"):
        d = replace(d, period_s=float(resonance * np.exp(rng.uniform(math.log(0.8), math.log(6)))))
    if kind in ("healthy", "sluggish"):
        return replace(d, period_s=0.0)
    ours = run(d)
    e = ours.pv - ours.sp
    if kind in ("backlash", "stiction"):
        without = run(d, valve=Valve())
        swell = float(np.std(e) / max(np.std(without.pv - without.sp), 1e-9))
        if swell < SWELL or returning(e) < RETURN:
            return None
        return replace(d, swell=swell, period_s=_period(e, c.scan_s))
    if kind == "tight":
        return d if returning(e) >= RETURN else None
    return d if returning(e) >= RETURN else None


def drawn(seed: int, each: int, kinds: tuple[str, ...] = KINDS) -> list[Drawn]:
    """`each` loops of each kind."""
    found: list[Drawn] = []
    for kind in kinds:
        have, k = 0, 0
        while have < each:
            d = one(1000 * seed + k, kind, f"{kind.upper()}{have:03d}")
            k += 1
            if d is not None:
                found.append(d)
                have += 1
    return found
