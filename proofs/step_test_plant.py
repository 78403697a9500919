"""Step tests of known processes, for proofs: an independent simulator, which shares no code with the packages.

Each test is drawn by a seed: lag, two lags, integrator or inverse response; one to six moves; noise up to a third of
the response; drift; backlash; one sample in 1 to 60 s; irregular stamps. Processes are integrated by small Euler
steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
FINE = 60
"""Euler steps in the shortest time constant of a process."""


@dataclass(frozen=True)
class Truth:
    """The drawn constants.

    gain [% PV/% OP], for an integrator its slope [1/s]; lags [s]; dead time [s]; zero of an inverse response [s];
    backlash [% OP]; noise relative to the response [-]; moves; sample [s]; scatter of stamps relative to the
    sample; drift over the record relative to the response.
    """

    kind: str
    gain: float
    lags_s: tuple[float, ...]
    dead_s: float
    zero_s: float
    backlash: float
    noise: float
    moves: int
    sample_s: float
    scatter: float
    drift: float


@dataclass(frozen=True)
class Recorded:
    """Stamps [s], PV and OP [% of span], shape (n,) each."""

    stamp_s: Floats
    pv: Floats
    op: Floats


def drawn(seed: int) -> Truth:
    """A process and its test."""
    rng = np.random.default_rng(seed)
    kind = rng.choice(["lag", "two lags", "integrator", "inverse response"], p=[0.45, 0.35, 0.12, 0.08])
    slow = float(np.exp(rng.uniform(np.log(60.0), np.log(1500.0))))
    lags = {"lag": (slow,), "integrator": ()}.get(kind, (slow, slow * float(rng.uniform(0.15, 0.7))))
    total = sum(lags) or slow
    moves = int(rng.integers(1, 7))
    # moves in one direction and reversals distinguish backlash from gain; fewer moves do not
    play = float(rng.uniform(0.05, 0.3)) if moves >= 4 and rng.random() < 0.4 else 0.0
    sample = float(np.clip(np.exp(rng.uniform(0.0, np.log(60.0))), 1.0, min(60.0, total / 40.0)))
    gain = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.3), np.log(3.0))))
    return Truth(
        str(kind),
        gain / (5.0 * slow) if kind == "integrator" else gain,
        lags,
        float(rng.uniform(0.1, 1.0)) * slow * (0.4 if kind == "integrator" else 1.0),
        slow * float(rng.uniform(0.3, 1.0)) if kind == "inverse response" else 0.0,
        play,
        float(rng.uniform(0.01, 1.0 / 3.0)),
        moves,
        max(round(sample), 1.0),
        float(rng.choice([0.0, 0.1, 0.3])),
        float(rng.choice([0.0, 1.0]) * rng.uniform(-0.4, 0.4)),
    )


def recorded(t: Truth, seed: int) -> Recorded:
    """The test as a historian records it."""
    rng = np.random.default_rng([seed, 1])
    stamps, op, clean, noise = undisturbed(t, rng, t)
    return Recorded(stamps, clean + noise * rng.normal(size=clean.size), op)


def undisturbed(t: Truth, rng: np.random.Generator, planned: Truth) -> tuple[Floats, Floats, Floats, float]:
    """Stamps [s], OP, PV without noise and the size of the noise [%] of a process whose test was planned for another
    one.

    The other process determines the test. Therefore PV can be differentiated with respect to the constants of a
    process.
    """
    p = planned
    scale = (sum(p.lags_s) + p.dead_s) if p.lags_s else 6.0 * p.dead_s
    ways = directions(p, rng)
    sizes = rng.uniform(4.0, 8.0, p.moves)
    rests = scale * rng.uniform(4.0, 6.0, p.moves + 1)
    rests[0] = scale * rng.uniform(1.5, 3.0)
    end_s = float(rests.sum())
    shortest = min([x for x in (*p.lags_s, p.zero_s, p.dead_s) if x > 0.0])
    fine_s = min(shortest / FINE, p.sample_s / 2.0)
    clock = np.arange(0.0, end_s, fine_s)
    op = np.full(clock.size, 45.0)
    for at, way, size in zip(np.cumsum(rests)[:-1], ways, sizes, strict=True):
        op[clock >= at] += way * size
    stem = behind_backlash(op, t.backlash * float(sizes.mean()), float(rng.uniform()))
    clean = response(t, stem - stem[0], fine_s)
    answer = abs(p.gain) * float(sizes.mean()) * (float(rests.mean()) if p.kind == "integrator" else 1.0)
    stamps = np.arange(0.0, end_s - p.sample_s, p.sample_s)
    stamps = stamps + p.scatter * p.sample_s * rng.uniform(-0.5, 0.5, stamps.size) + 0.5 * p.sample_s
    late = np.interp(stamps - t.dead_s, clock, clean, left=0.0)
    at = np.minimum((stamps / fine_s).astype(int), clock.size - 1)
    return stamps, op[at], 50.0 + late + t.drift * answer * stamps / end_s, p.noise * answer


def best_scatter(t: Truth, seed: int, name: str) -> float:
    """Smallest standard deviation of an unbiased estimate of a constant, by the bound of Cramer and Rao.

    The noise is white and normal; offset, drift and all constants of the process are unknown (Kay 1993, ch. 3).
    """
    columns = [_slope(t, seed, field) for field in _constants(t)]
    columns += [np.ones_like(columns[0]), np.linspace(0.0, 1.0, columns[0].size)]
    noise = undisturbed(t, np.random.default_rng([seed, 1]), t)[3]
    matrix = np.array(columns).T
    scale = np.linalg.norm(matrix, axis=0)
    spread = np.linalg.inv((matrix / scale).T @ (matrix / scale))
    k = _constants(t).index(name)
    return float(noise * np.sqrt(spread[k, k]) / scale[k])


def _constants(t: Truth) -> list[str]:
    """Names of a process's constants; `lags_s:0` is the first lag."""
    named = ["gain", "dead_s", *(f"lags_s:{k}" for k in range(len(t.lags_s)))]
    return named + [x for x in ("zero_s", "backlash") if getattr(t, x) > 0.0]


def _slope(t: Truth, seed: int, constant: str) -> Floats:
    """The derivative of PV with respect to a constant, at its stamps."""
    name, _, at = constant.partition(":")
    value = t.lags_s[int(at)] if at else getattr(t, name)
    step = 0.02 * abs(value)
    ends = []
    for x in (value + step, value - step):
        put = tuple(x if k == int(at) else lag for k, lag in enumerate(t.lags_s)) if at else x
        moved = undisturbed(replace(t, **{name: put}), np.random.default_rng([seed, 1]), t)
        ends.append(moved[2])
    return np.asarray((ends[0] - ends[1]) / (2.0 * step))


def directions(t: Truth, rng: np.random.Generator) -> Floats:
    """Directions of the moves: random; with backlash one reversal and two moves in one direction."""
    while True:
        ways = rng.choice([-1.0, 1.0], t.moves)
        if abs(ways.cumsum()).max() > 3:
            continue
        same = (ways[1:] == ways[:-1]).any() and (ways[1:] != ways[:-1]).any()
        if t.backlash == 0.0 or same:
            return np.asarray(ways)


def behind_backlash(op: Floats, width: float, begun: float) -> Floats:
    """The stem behind a backlash of that width; `begun` is its initial position as a share of the gap."""
    out, at = np.empty(op.size), op[0] + (begun - 0.5) * width
    for k, x in enumerate(op):
        at = min(max(at, x - 0.5 * width), x + 0.5 * width)
        out[k] = at
    return out


def response(t: Truth, moved: Floats, step_s: float) -> Floats:
    """The response of the process to a delayed stem, by Euler steps."""
    if t.kind == "integrator":
        return np.asarray(t.gain * step_s * np.cumsum(moved))
    x, states = moved, []
    for lag in t.lags_s:
        y, at = np.empty(x.size), 0.0
        for k, u in enumerate(x):
            at += step_s / lag * (u - at)
            y[k] = at
        states.append(y)
        x = y
    rate = np.diff(x, prepend=0.0) / step_s
    return np.asarray(t.gain * (x - t.zero_s * rate))
