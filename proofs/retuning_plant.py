"""Loops for the proof of the advice: valves with real friction, second lags, load, noise; without code of the
package.

The stem is that of the concealed recordings (Karnopp's friction with mass, a stiff contact across a gap). The process
is two lags, or an integrator and a lag, behind a pipe, integrated by fourth-order Runge-Kutta steps. The controller
is a PI in position form with its own scan. The historian rounds what it keeps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import lfilter

from proofs.concealed.stem import push_through_gap, stick_slip

Floats = NDArray[np.float64]
STEPS = 10
"""Fine steps a scan."""
ACTUATOR = 0.4
"""Lag of the actuator [scans]."""
FAULT_SHARE = 3.0
"""Ratio of the error with the valve's fault to that without it, from which a loop cycles clearly."""
CYCLES = 20
"""Number of periods after which a loop without noise and load must still cycle."""


@dataclass(frozen=True)
class Rig:
    """One loop: seconds, percent of spans.

    kind: backlash, stiction, `healthy`, load or tight; lag 0: integrator of slope `gain`; second: second lag; gap:
    backlash.
    static, sliding: friction; load, corner: standard deviation [% OP] and correlation time of the load at the
    valve; noise [% PV].
    sine, sine_s: an external periodic load [% OP] and its period; resolution of the historian [%].
    """

    name: str
    kind: str
    gain: float
    lag: float
    second: float
    dead: float
    kp: float
    ti: float
    scan: float
    hours: float
    seed: int
    gap: float = 0.0
    static: float = 0.0
    sliding: float = 0.0
    load: float = 0.0
    corner: float = 1.0
    noise: float = 0.0
    sine: float = 0.0
    sine_s: float = 1.0
    resolution: float = 0.01

    @property
    def slope(self) -> float:
        """Gain over lag [% PV / (% OP s)]."""
        return self.gain / self.lag if self.lag > 0 else self.gain

    @property
    def delay(self) -> float:
        """Dead time, half the second lag (Skogestad's half rule), actuator and half a scan [s]."""
        return self.dead + 0.5 * self.second + (ACTUATOR + 0.5) * self.scan

    @property
    def scans(self) -> int:
        """Scans of one recording."""
        return int(3600 * self.hours / self.scan)

    @property
    def width(self) -> float:
        """Width of backlash, or stickband [% OP]."""
        return self.gap if self.gap > 0 else self.static + self.sliding


@dataclass(frozen=True)
class Outside:
    """External disturbances, one value a scan, each shape (n,): load [% OP], noise [% PV]."""

    load: Floats
    noise: Floats


@dataclass(frozen=True)
class Trends:
    """PV, OP and stem at the scans, each shape (n,) [%]."""

    pv: Floats
    op: Floats
    stem: Floats


@njit(cache=True)
def _slopes(x: float, z: float, feed: float, lag: float, second: float, gain: float) -> tuple[float, float]:
    """d/dt of vessel x [% PV] and second lag z [% OP]."""
    dz = (feed - z) / second
    return (gain * z - x) / lag if lag > 0.0 else gain * z, dz


@njit(cache=True)
def _advance(
    x: float, z: float, feed: float, dt: float, lag: float, second: float, gain: float
) -> tuple[float, float]:
    """Vessel and second lag after one classic Runge-Kutta step."""
    a, p = _slopes(x, z, feed, lag, second, gain)
    b, q = _slopes(x + 0.5 * dt * a, z + 0.5 * dt * p, feed, lag, second, gain)
    c, r = _slopes(x + 0.5 * dt * b, z + 0.5 * dt * q, feed, lag, second, gain)
    d, s = _slopes(x + dt * c, z + dt * r, feed, lag, second, gain)
    return x + dt / 6.0 * (a + 2 * b + 2 * c + d), z + dt / 6.0 * (p + 2 * q + 2 * r + s)


@njit(cache=True)
def _run(
    load: Floats,
    noise: Floats,
    kp: Floats,
    ti: Floats,
    process: tuple[float, float, float, float],
    valve: tuple[float, float, float],
    scan: float,
) -> Floats:
    """PV, OP and stem, shape (3, n), relative to the initial state at 50 %; Kp and Ti may change from scan to
    scan."""
    gain, lag, second, dead = process
    gap, static, sliding = valve
    dt, n = scan / STEPS, load.size
    steps = int(dead / dt)
    part = dead / dt - steps
    pipe = np.zeros(steps + 2)
    out = np.empty((3, n))
    x = z = act = stem = speed = 0.0
    total, before, at = 0.0, 0.0, 0
    for k in range(n):
        e = -(x + noise[k])
        if k > 0 and (kp[k] != kp[k - 1] or ti[k] != ti[k - 1]):
            total = kp[k - 1] * before + total - kp[k] * before
        total += kp[k] * scan / ti[k] * e
        free = kp[k] * e + total
        u = min(max(free, -50.0), 50.0)
        total += u - free
        before = e
        out[0, k], out[1, k], out[2, k] = -e, u, stem
        for _ in range(STEPS):
            act += (u - act) * dt / (ACTUATOR * scan)
            if static > 0.0:
                stem, speed = stick_slip(stem, speed, act, static, sliding, 0.25 * scan, dt)
            else:
                stem = push_through_gap(stem, act, gap) if gap > 0.0 else act
            pipe[at] = stem + load[k]
            old = (at + pipe.size - steps) % pipe.size
            feed = (1.0 - part) * pipe[old] + part * pipe[(old + pipe.size - 1) % pipe.size]
            at = (at + 1) % pipe.size
            x, z = _advance(x, z, feed, dt, lag, second, gain)
    return out


def run(rig: Rig, outside: Outside, kp: Floats, ti: Floats) -> Trends:
    """The loop at a set point of 50 % with Kp [% OP / % PV] and Ti [s] at each scan, shape (n,)."""
    process = (rig.gain, rig.lag, max(rig.second, 0.2 * rig.scan), rig.dead)
    valve = (rig.gap, rig.static, rig.sliding)
    pv, op, stem = 50.0 + _run(outside.load, outside.noise, kp, ti, process, valve, rig.scan)
    return Trends(pv, op, stem)


def wander(rng: np.random.Generator, n: int, corner: float) -> Floats:
    """A smooth random path of unit variance, shape (n,): white noise through two lags of `corner` [scans]."""
    pole = math.exp(-1.0 / corner)
    skip = int(10 * corner)
    path = lfilter(
        [1.0], np.convolve([1.0, -pole], [1.0, -math.exp(-5.0 / corner)]), rng.normal(size=n + skip)
    )
    return np.asarray(path[skip:] / np.std(path[skip:]), dtype=np.float64)


def outside(rig: Rig, n: int) -> Outside:
    """Load and noise of a rig for `n` scans; the same for equal rig and n."""
    rng = np.random.default_rng([rig.seed, 7])
    load = rig.load * wander(rng, n, rig.corner / rig.scan)
    phase = 2 * np.pi * np.arange(n) * rig.scan / rig.sine_s + rng.uniform(0, 6)
    noise = rig.noise * lfilter([0.95], [1.0, -0.3], rng.normal(size=n))
    return Outside(load + rig.sine * np.sin(phase), noise)


def still(n: int) -> Outside:
    """No disturbance except one load pulse that moves the stem."""
    load = np.zeros(n)
    load[10 : n // 20] = 8.0
    return Outside(load, np.zeros(n))


def cycles(rig: Rig) -> bool:
    """Whether the loop without noise and load keeps a limit cycle at its present settings."""
    n = int(CYCLES * 6 * rig.ti / rig.scan) + 2000
    stem = held(rig, still(n), (rig.kp, rig.ti)).stem[-n // 4 :]
    return float(np.ptp(stem)) > 0.1 * rig.width and float(np.abs(np.diff(stem)).sum()) > rig.width


def held(rig: Rig, outside: Outside, settings: tuple[float, float]) -> Trends:
    """The loop with one pair of settings throughout."""
    n = outside.load.size
    return run(rig, outside, np.full(n, settings[0]), np.full(n, settings[1]))


def without_fault(rig: Rig) -> Rig:
    """The same loop with a valve without a fault."""
    return replace(rig, gap=0.0, static=0.0, sliding=0.0)


def matters(rig: Rig) -> bool:
    """Whether the valve's fault, and not load and noise, causes most of the error."""
    acting = outside(rig, 2 * rig.scans)
    with_it, without = (
        float(np.mean(np.abs(held(one, acting, (rig.kp, rig.ti)).pv - 50.0)))
        for one in (rig, without_fault(rig))
    )
    return with_it > FAULT_SHARE * without


def ultimate(rig: Rig) -> float:
    """Stability limit of the loop without fault and load, as a factor on the present gain [-]."""
    low, high = 1.0, 20.0
    while high / low > 1.01:
        middle = math.sqrt(low * high)
        pv = held(without_fault(rig), still(4000), (middle * rig.kp, rig.ti)).pv
        swings = np.ptp(pv[-800:]) > 0.95 * np.ptp(pv[-2400:-1600]) and np.ptp(pv[-800:]) > 1e-3 * np.ptp(pv)
        low, high = (low, middle) if swings else (middle, high)
    return low


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _frame(rng: np.random.Generator, name: str, kind: str, ratios: tuple[float, float], ramp: bool) -> Rig:
    """Process, controller near the nominal tuning, load and noise, for a valve fault of 1 %."""
    scan = float(rng.choice([1.0, 1.0, 2.0, 5.0]))
    dead = scan * rng.uniform(2.0, 8.0)
    second = dead * rng.uniform(0.2, 1.0)
    rig = Rig(name, kind, 1.0, 1.0, second, dead, 1.0, 1.0, scan, 1.0, int(rng.integers(2**31)))
    lag = 0.0 if ramp else rig.delay * _log(rng, *ratios)
    gain = rng.choice([-1.0, 1.0, 1.0]) * _log(rng, 0.06, 0.5) / rig.delay * (lag if lag > 0 else 1.0)
    rig = replace(rig, gain=float(gain), lag=lag)
    kp = 1.0 / (rig.slope * 2.5 * rig.delay) * rng.uniform(0.7, 1.2)
    ti = min(lag if lag > 0 else math.inf, 10.0 * rig.delay) * rng.uniform(0.75, 1.25)
    hours = min(max(40 * 4 * ti / 3600, 5.0), 24.0)
    return replace(
        rig,
        kp=float(kp),
        ti=float(ti),
        hours=hours,
        load=rng.uniform(0.02, 0.1),
        corner=float(rig.delay * _log(rng, 3.0, 60.0)),
        noise=float(rng.uniform(0.02, 0.08) / abs(kp)),
    )


def _sized(rig: Rig, width: float) -> Rig:
    """Load, noise and resolution in proportion to the valve's fault [% OP]."""
    noise = rig.noise * width
    return replace(rig, load=rig.load * width, noise=noise, resolution=min(0.05, 0.5 * noise))


def _backlash(rng: np.random.Generator, name: str, ramp: bool) -> Rig:
    width = _log(rng, 0.6, 4.0)
    return replace(_sized(_frame(rng, name, "backlash", (15.0, 200.0), ramp), width), gap=width)


def _stiction(rng: np.random.Generator, name: str, ramp: bool) -> Rig:
    band, share = _log(rng, 1.0, 5.0), rng.uniform(0.1, 0.6)
    rig = _sized(_frame(rng, name, "stiction", (2.0, 40.0), ramp), band)
    return replace(rig, static=0.5 * band * (1 + share), sliding=0.5 * band * (1 - share))


def _drawn_without_fault(rng: np.random.Generator, name: str, kind: str) -> Rig:
    """A loop with a valve without a fault: no disturbance, with an external periodic load, or tightly tuned."""
    rig = _sized(_frame(rng, name, kind, (2.0, 60.0), False), rng.uniform(1.0, 4.0))
    if kind == "load":
        return replace(rig, sine=5.0 * rig.load, sine_s=rig.delay * _log(rng, 8.0, 40.0))
    return replace(rig, kp=rig.kp * ultimate(rig) * rng.uniform(0.8, 0.95)) if kind == "tight" else rig


COUNTS = {"backlash": (20, 4), "stiction": (10, 2), "healthy": (8, 0), "load": (8, 0), "tight": (4, 0)}
"""Loops of each kind: lags, and integrating levels."""


def drawn(seed: int, counts: dict[str, tuple[int, int]] = COUNTS) -> Iterator[Rig]:
    """All rigs of a seed; valve loops that do not cycle are drawn again."""
    rng = np.random.default_rng([seed, 2])
    for kind, (lags, ramps) in counts.items():
        for k in range(lags + ramps):
            yield _one(rng, kind, f"{kind.upper()}{k:02d}", k >= lags)


def _one(rng: np.random.Generator, kind: str, name: str, ramp: bool) -> Rig:
    makers = {"backlash": _backlash, "stiction": _stiction}
    while True:
        rig = makers[kind](rng, name, ramp) if kind in makers else _drawn_without_fault(rng, name, kind)
        if kind not in makers or (cycles(rig) and matters(rig)):
            return rig
