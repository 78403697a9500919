"""All loops of a plant with their couplings, scan by scan."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np
from numba import njit

LINKS = ("link_from", "link_to", "link_stem", "link_gain", "link_lag", "link_delay")
"""Fields of a plant with one value a coupling; the others have one a loop."""


def _none() -> np.ndarray:
    return np.zeros(0)


@dataclass(frozen=True)
class Plant:
    """Loops and couplings as arrays; times in seconds unless stated otherwise, other values in percent of spans.

    Loops, shape (n,): gain [% PV/% OP] (per `first` where it integrates), two time constants, dead time [scans]; kp,
    ti; sp0, op0 at rest.
    master, slave: their places, -1: none, masters come first; stick, slip: He's two levels of friction [% OP].
    scatter: of the first level from slip to slip [log]; backlash: full width [% OP]; beat: amplitude of its own
        periodic load [% OP].
    Couplings: from the PV or the stem of a loop to the process input of another by gain, lag and delay [scans].
    """

    step: float
    gain: np.ndarray
    first: np.ndarray
    second: np.ndarray
    dead: np.ndarray
    integrating: np.ndarray
    kp: np.ndarray
    ti: np.ndarray
    sp0: np.ndarray
    op0: np.ndarray
    master: np.ndarray
    slave: np.ndarray
    stick: np.ndarray
    slip: np.ndarray
    scatter: np.ndarray
    backlash: np.ndarray
    beat: np.ndarray
    link_from: np.ndarray = field(default_factory=_none)
    link_to: np.ndarray = field(default_factory=_none)
    link_stem: np.ndarray = field(default_factory=_none)
    link_gain: np.ndarray = field(default_factory=_none)
    link_lag: np.ndarray = field(default_factory=_none)
    link_delay: np.ndarray = field(default_factory=_none)

    @property
    def size(self) -> int:
        """Number of loops."""
        return self.gain.size

    def changed(self, i: int, **values: float) -> Plant:
        """With other values at loop i."""
        new = {name: getattr(self, name).copy() for name in values}
        for name, value in values.items():
            new[name][i] = value
        return replace(self, **new)

    def linked(self, *link: float) -> Plant:
        """With one more coupling, its six values in the order of LINKS."""
        new = {name: np.append(getattr(self, name), x) for name, x in zip(LINKS, link, strict=True)}
        return replace(self, **new)

    def part(self, at: list[int]) -> Plant:
        """Those loops alone, without couplings; partners of a cascade that are not included are dropped."""
        new = {
            f.name: getattr(self, f.name)[at]
            for f in fields(self)
            if f.name != "step" and f.name not in LINKS
        }
        place = {old: k for k, old in enumerate(at)}
        for name in ("master", "slave"):
            new[name] = np.array([place.get(int(x), -1) for x in new[name]])
        return replace(self, **new, **{name: _none() for name in LINKS})


@dataclass(frozen=True)
class Trends:
    """Inputs of a plant: set points, loads at the process inputs and noises [%], shape (scans, n).

    own: by loop, the shape of its periodic load, or the normal random numbers for its friction, shape (scans,).
    """

    sp: np.ndarray
    load: np.ndarray
    noise: np.ndarray
    own: dict[int, np.ndarray]

    def part(self, at: list[int]) -> Trends:
        """Of those loops."""
        own = {k: self.own[i] for k, i in enumerate(at) if i in self.own}
        return Trends(self.sp[:, at], self.load[:, at], self.noise[:, at], own)


@dataclass(frozen=True)
class Ran:
    """SP, PV, OP and stem [%], shape (scans, n); the stem only if it is requested."""

    sp: np.ndarray
    pv: np.ndarray
    op: np.ndarray
    stem: np.ndarray


@njit(cache=True)
def _valve(state: np.ndarray, move: float, op: float, valve: np.ndarray, draw: float) -> None:
    """One scan of a valve; state: stem, force held by friction, direction and factor of the last slip; changed."""
    if valve[0] > 0.0:
        force = state[1] + move
        if abs(force) > valve[0] * state[3]:
            way = 1.0 if force > 0.0 else -1.0
            state[0] = op - way * valve[1]
            force = way * valve[1]
            if way != state[2]:
                state[2] = way
                state[3] = max(np.exp(valve[2] * draw), valve[1] / valve[0])
        state[1] = force
    else:
        state[0] = min(max(state[0], op - 0.5 * valve[3]), op + 0.5 * valve[3])


@njit(cache=True)
def _pass_on(
    k: int, ends: np.ndarray, links: np.ndarray, past: np.ndarray, passed: np.ndarray, extra: np.ndarray
) -> None:
    """One scan of the couplings; changes `passed`, the states of their lags, and `extra`, the processes' loads."""
    for j in range(ends.shape[0]):
        was = k - ends[j, 3]
        signal = past[was % past.shape[0], ends[j, 2], ends[j, 0]] if was >= 0 else 0.0
        passed[j] += links[j, 1] * (signal - passed[j])
        extra[ends[j, 1]] += links[j, 0] * passed[j]


@njit(cache=True)
def _run(
    tables: tuple[np.ndarray, ...],
    ends: np.ndarray,
    column: np.ndarray,
    own: np.ndarray,
    drives: tuple[np.ndarray, ...],
    kept: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """PV and OP; the set points in `drives` are overwritten at slaves, `kept` holds the last stems."""
    process, control, valve, links = tables
    sp, load, noise = drives
    n, scans = sp.shape[1], sp.shape[0]
    pv, op = np.empty((scans, n)), np.empty((scans, n))
    waits, late = int(process[:, 3].max()) + 1, (int(ends[:, 3].max()) if ends.shape[0] else 0) + 1
    held, past = np.zeros((waits, n)), np.zeros((late, 2, n))
    x, before, last = np.zeros((2, n)), np.zeros(n), control[:, 3].copy()
    state, passed, extra = np.zeros((n, 4)), np.zeros(ends.shape[0]), np.zeros(n)
    state[:, 0] = last
    state[:, 3] = 1.0
    for k in range(scans):
        for i in range(n):
            true = control[i, 2] + process[i, 0] * x[1, i]
            pv[k, i] = min(max(true + noise[k, i], 0.0), 100.0)
            if control[i, 4] >= 0:
                sp[k, i] = op[k, int(control[i, 4])]
            e = sp[k, i] - pv[k, i]
            new = min(max(last[i] + control[i, 0] * (e - before[i]) + control[i, 1] * e, 0.0), 100.0)
            c = column[i]
            _valve(state[i], new - last[i], new, valve[i], own[k, c] if c >= 0 else 0.0)
            before[i], last[i], op[k, i], kept[k % kept.shape[0], i] = e, new, new, state[i, 0]
            past[k % late, 0, i], past[k % late, 1, i] = true - control[i, 2], state[i, 0] - control[i, 3]
            extra[i] = load[k, i] + (valve[i, 4] * own[k, c] if c >= 0 else 0.0)
        _pass_on(k, ends, links, past, passed, extra)
        for i in range(n):
            s = int(control[i, 5])
            moved = state[i, 0] - control[i, 3]
            if s >= 0:
                moved = control[s, 2] + past[k % late, 0, s] - control[i, 3]
            dead = int(process[i, 3])
            held[k % waits, i] = moved + extra[i]
            u = held[(k - dead) % waits, i] if k >= dead else 0.0
            x[0, i] += process[i, 1] * (u if process[i, 4] > 0.0 else u - x[0, i])
            x[1, i] += process[i, 2] * (x[0, i] - x[1, i])
    return pv, op


def shares(step: float, times: np.ndarray) -> np.ndarray:
    """Step response of first-order lags with those time constants after one scan."""
    return -np.expm1(-step / np.maximum(times, 1e-6))


def simulate(plant: Plant, trends: Trends, stems: bool = False) -> Ran:
    """Run a plant from rest."""
    p, scans = plant, trends.sp.shape[0]
    pace = np.where(p.integrating > 0, p.step / p.first, shares(p.step, p.first))
    process = np.column_stack([p.gain, pace, shares(p.step, p.second), p.dead, p.integrating]).astype(float)
    control = np.column_stack([p.kp, p.kp * p.step / p.ti, p.sp0, p.op0, p.master, p.slave]).astype(float)
    valve = np.column_stack([p.stick, p.slip, p.scatter, p.backlash, p.beat]).astype(float)
    ends = np.column_stack([p.link_from, p.link_to, p.link_stem, p.link_delay]).astype(np.int64)
    links = np.column_stack([p.link_gain, shares(p.step, p.link_lag)])
    column = np.full(p.size, -1)
    column[list(trends.own)] = np.arange(len(trends.own))
    own = np.column_stack(list(trends.own.values())) if trends.own else np.zeros((scans, 1))
    sp, kept = np.array(trends.sp, order="C"), np.empty((scans if stems else 1, p.size))
    drives = (sp, np.ascontiguousarray(trends.load), np.ascontiguousarray(trends.noise))
    pv, op = _run((process, control, valve, links), ends, column, own, drives, kept)
    return Ran(sp, pv, op, kept)
