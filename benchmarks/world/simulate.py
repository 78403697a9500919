"""One control loop, step by step: controller, valve with friction or backlash, process, load, noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
NO_FAULT, BACKLASH, HE, KANO, KARNOPP = range(5)
"""Valves: ideal; backlash of full width; stick-slip after He et al. 2007 and Kano 2004; Coulomb and static friction
with a spring that follows OP (as Karnopp 1985)."""


@dataclass(frozen=True)
class Process:
    """gain [%/%] (slope [%/(% s)] of an integrator), lag (0: integrator) and second lag [s], dead time [s], lead [s]:
    negative for an inverse response, bend of the valve's curve [-]: its gain is 1 + bend (stem - 50)/50."""

    gain: float
    lag_s: float
    second_s: float
    dead_s: float
    lead_s: float = 0.0
    bend: float = 0.0


@dataclass(frozen=True)
class Controller:
    """Ideal PI in position form: kp [%/%], ti [s], scan [s], filter of PV [s]."""

    kp: float
    ti_s: float
    scan_s: float = 1.0
    pv_filter_s: float = 0.0


@dataclass(frozen=True)
class Valve:
    """Kind as above, its band (full width of the backlash, or stickband) and slip jump [% OP]."""

    kind: int = NO_FAULT
    band: float = 0.0
    jump: float = 0.0


@njit(cache=True)
def _stem(kind: int, band: float, jump: float, op: float, state: Floats) -> float:
    """Stem position [% OP]; state: stem, direction, OP at rest, 1 while it moves."""
    if kind == 1:
        half = 0.5 * band
        state[0] = min(max(state[0], op - half), op + half)
    elif kind == 2:  # it jumps when the force exceeds static friction, and stops at once
        static, kinetic = 0.5 * (band + jump), 0.5 * (band - jump)
        gap = op - state[0]
        if gap > static:
            state[0] = op - kinetic
        elif gap < -static:
            state[0] = op + kinetic
    elif kind == 3:  # it moves further until OP reverses or stops
        change = op - state[2]
        if state[3] == 1.0:
            if change * state[1] <= 0.0:
                state[3] = 0.0
                state[4] = state[2]
            else:
                state[0] = op - state[1] * 0.5 * (band - jump)
        if state[3] == 0.0:
            travel = op - state[4]
            need = band if travel * state[1] < 0.0 else jump
            if abs(travel) > need:
                state[1] = 1.0 if travel > 0.0 else -1.0
                state[3] = 1.0
                state[0] = op - state[1] * 0.5 * (band - jump)
        state[2] = op
    elif kind == 4:  # mass-less stem behind a spring with a moving and a static friction, sub-steps
        static, kinetic = 0.5 * (band + jump), 0.5 * (band - jump)
        for _ in range(4):
            force = op - state[0]
            if state[3] == 0.0 and abs(force) > static:
                state[3] = 1.0
            if state[3] == 1.0:
                left = abs(force) - kinetic
                if left <= 0.0:
                    state[3] = 0.0
                else:
                    state[0] += math.copysign(0.6 * left, force)
                    if left < 0.05 * max(band, 1e-9):
                        state[3] = 0.0
    else:
        state[0] = op
    return state[0]


@njit(cache=True)
def _run(
    sp: Floats,
    load_in: Floats,
    load_out: Floats,
    noise: Floats,
    auto: NDArray[np.bool_],
    loop: Floats,
    h: float,
) -> tuple[Floats, Floats, Floats]:
    """PV, OP and stem, one value a scan; loop: gain, lags, dead, lead, bend, kp, ti, filter, valve, band, jump, OP
    at rest."""
    gain, lag, second, dead, lead, bend, kp, ti, smooth, kind, band, jump, rest = loop
    n = sp.size
    pv, op, stem = np.empty(n), np.empty(n), np.empty(n)
    delay = dead / h
    whole, part = int(delay), delay - int(delay)
    x1, x2, seen = 0.0, 0.0, 0.0
    a1 = 1.0 - math.exp(-h / lag) if lag > 0.0 else h
    a2 = 1.0 - math.exp(-h / second) if second > 0.0 else 1.0
    af = 1.0 - math.exp(-h / smooth) if smooth > 0.0 else 1.0
    state = np.array([rest, 1.0, rest, 1.0, rest])
    integral, out, first = rest, rest, True
    for k in range(n):
        i = k - 1 - whole
        late = stem[i] if i >= 0 else rest
        later = stem[i - 1] if i >= 1 else rest
        opened = (1.0 - part) * late + part * later
        u = opened - rest + bend * ((opened - 50.0) ** 2 - (rest - 50.0) ** 2) / 100.0 + load_in[k]
        before = x1
        if lag > 0.0:
            x1 += a1 * (gain * u - x1)
        else:
            x1 += a1 * gain * u
        shaped = x1 + lead * (x1 - before) / h
        x2 += a2 * (shaped - x2)
        pv[k] = 50.0 + x2 + load_out[k] + noise[k]
        seen = pv[k] if first else seen + af * (pv[k] - seen)
        first = False
        e = sp[k] - seen
        if auto[k]:
            integral += kp * e * h / ti
            out = kp * e + integral
            if out > 100.0:
                integral, out = 100.0 - kp * e, 100.0
            elif out < 0.0:
                integral, out = -kp * e, 0.0
        else:
            integral = out - kp * e
        op[k] = out
        stem[k] = _stem(int(kind), band, jump, out, state)
    return pv, op, stem


@dataclass(frozen=True)
class Trends:
    """The output of the plant, one value a scan, shape (n,) [% of span]."""

    sp: Floats
    pv: Floats
    op: Floats
    stem: Floats
    scan_s: float


def simulate(
    process: Process,
    controller: Controller,
    valve: Valve,
    sp: Floats,
    load_in: Floats,
    load_out: Floats,
    noise: Floats,
    auto: NDArray[np.bool_] | None = None,
    rest: float = 50.0,
) -> Trends:
    """The loop under loads before [% OP] and after [% PV] the process; all of shape (n,), one value a scan."""
    p, c = process, controller
    plant = (p.gain, p.lag_s, p.second_s, p.dead_s, p.lead_s, p.bend, c.kp, c.ti_s, c.pv_filter_s)
    loop = np.array([*plant, float(valve.kind), valve.band, valve.jump, rest])
    on = np.ones(sp.size, dtype=bool) if auto is None else auto
    return Trends(sp, *_run(sp, load_in, load_out, noise, on, loop, c.scan_s), c.scan_s)


def sensitivity(process: Process, controller: Controller) -> tuple[float, float]:
    """Largest |1/(1 + GC)| over frequency, and its period [s]; inf where the loop is unstable by the Nyquist
    criterion, counted on its phase crossover."""
    p, c = process, controller
    w = np.geomspace(1e-6, math.pi / c.scan_s, 6000)
    s = 1j * w
    g = p.gain * np.exp(-s * (p.dead_s + c.scan_s)) * (1 + p.lead_s * s) / (1 + p.second_s * s)
    g = g / (1 + p.lag_s * s) if p.lag_s > 0 else g / s
    z = np.exp(-s * c.scan_s)
    law = c.kp * (1 + c.scan_s / (c.ti_s * (1 - z))) / (1 + c.pv_filter_s * s)
    loop = g * law
    phase = np.unwrap(np.angle(loop))
    phase -= 2 * math.pi * round((phase[0] + math.pi * (1.0 if p.lag_s <= 0 else 0.5)) / (2 * math.pi))
    crossed = np.flatnonzero((phase[:-1] > -math.pi) & (phase[1:] <= -math.pi))
    found = 1 / np.abs(1 + loop)
    k = int(np.argmax(found))
    if crossed.size and np.abs(loop[crossed[-1]]) >= 1.0:
        return math.inf, 2 * math.pi / w[k]
    return float(found[k]), 2 * math.pi / w[k]
