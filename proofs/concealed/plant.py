"""The loop that produces the recordings: imperfect PI, valve, pipe, vessel, transmitter, in fine steps."""

import math
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from proofs.concealed.stem import positioner, push_through_gap, second_valve, slew, stick_slip, trim
from proofs.concealed.vessel import STATES, advance, leaves_pipe, level_of, reading

STEPS = 10  # fine steps a scan


class Plant(NamedTuple):
    """Physics of one loop; the defaults are those of the baseline loop. Percent of span and seconds."""

    K: float = 1.0
    T: float = 20.0
    L: float = 3.0
    v0: float = 50.0  # OP at rest
    y0: float = 50.0  # PV at rest
    gap: float = 0.0  # full width of backlash
    static: float = 0.0  # friction at rest
    sliding: float = 0.0  # friction in motion
    rate: float = math.inf  # slew [%/s]
    stop: float = 1000.0  # highest position
    bend: float = 0.0  # trim curve
    pos_w: float = 0.0  # positioner [rad/s], 0: none
    pos_z: float = 0.5
    pos_dead: float = 0.0
    split_at: float = math.inf
    split_dead: float = 0.0
    split_ratio: float = 1.0
    split_s: float = 0.0
    hurry: float = 0.0  # gain that increases with the rate of the move
    T2: float = 0.0
    T3: float = 0.0
    slow: float = 0.0  # share of the slow part
    slow_s: float = 1.0
    oppose: float = 0.0  # gain of the opposing part
    oppose_s: float = 1.0
    asym: float = 0.0  # ln of (T down over T up)
    slope: float = 0.0  # relative gain change over 50 % of PV
    root: float = 0.0  # y0 over the head that drives the outflow
    cap: float = math.inf  # weir, above y0
    weir: float = 25.0
    spill: float = 0.0
    spill_s: float = 1.0
    leak: float = 1.0  # 0: integrator
    pipe: float = 0.0  # share of the pipe's flow that depends on the valve
    drift: float = 0.0  # relative gain change over the record
    echo: float = 0.0
    echo_s: float = 0.0
    helper: float = 0.0  # strength of a hidden second controller
    recall: float = 0.0  # relative gain change per 10 % of the average past PV
    recall_s: float = 1.0
    grip: float = 0.0  # the sensor changes its value only when PV differs by this much [%]
    switch: float = 0.0  # load [% OP] that acts while PV is high
    switch_at: float = 0.0  # above y0 [%], with half a hysteresis band on either side
    switch_band: float = 1.0
    regime: float = 0.0  # relative gain change in a second flow regime
    regime_at: float = 0.0  # flow above v0 [%] at which it begins, with half a hysteresis band on either side
    regime_band: float = 1.0
    detour: float = 0.0  # additional delay [s] of the flow above v0
    tired: float = 0.0  # relative gain lost through 10 % of travel
    tired_s: float = 1.0  # and recovered in this time
    relay: float = 0.0  # load [% OP] that a relay switches on for a set time
    relay_at: float = 0.0  # when PV exceeds y0 by this much [%]
    relay_s: float = 1.0
    hold_s: float = 0.0  # interval at which the actuator takes a new position
    purge: float = 0.0  # share of the time in which the sensor is purged and its value is constant
    purge_s: float = 1.0  # interval of the purges
    foam: float = 0.0  # addition to the reading from a moving surface
    mount: float = 0.0  # share of an oscillating mount
    mount_w: float = 1.0
    mount_z: float = 0.1
    lag: float = 0.0  # filter of the transmitter
    clip_lo: float = -1000.0
    clip_hi: float = 1000.0
    grid: float = 0.0


class Pi(NamedTuple):
    """The real controller: gain, integral time [s], PV filter [s], limits, gap, OP resolution [%]."""

    kp: float = 1.0
    ti: float = 20.0
    filt: float = 0.0
    lo: float = 0.0
    hi: float = 100.0
    gap: float = 0.0
    res: float = 0.0
    hold_windup: float = 0.0  # 1: integral is constant while at a limit; 0: back-calculated


@dataclass(frozen=True)
class Drive:
    """The inputs of the loop, one value a scan, each shape (n,)."""

    sp: np.ndarray
    load: np.ndarray  # at the vessel's inlet [% OP]
    supply: np.ndarray  # head over nominal head
    pre: np.ndarray  # before the transmitter [% PV]
    post: np.ndarray  # noise of the transmitter [% PV]
    late: np.ndarray  # delay of the scan in fine steps
    force: np.ndarray  # NaN: automatic; inf: OP is constant; else OP is tracked
    op_hi: np.ndarray  # limit in force [%]
    helper: np.ndarray  # 1: the hidden controller acts
    act: np.ndarray  # load that belongs to an effect [% OP]

    def table(self) -> np.ndarray:
        """All rows, shape (10, n)."""
        return np.array([getattr(self, f.name) for f in fields(self)], dtype=float)


@njit(cache=True)
def decide(sp: float, pv: float, s: np.ndarray, force: float, hi: float, h: float, c: Any) -> float:
    """OP [%] from SP and PV [%]; `s` holds filtered PV, last error, integral and OP."""
    s[0] += (pv - s[0]) * (1.0 - math.exp(-h / c.filt) if c.filt > 0.0 else 1.0)
    e, last = sp - s[0], s[1]
    s[1] = e
    if not math.isnan(force):
        s[3] = s[3] if math.isinf(force) else force
        s[2] = s[3] - c.kp * e
        return s[3]
    if abs(e) < c.gap:
        s[2] = s[3] - c.kp * last
        s[1] = last
        return s[3]
    s[2] += c.kp * h / c.ti * e
    free = s[2] + c.kp * e
    s[3] = min(max(free, c.lo), min(hi, c.hi))
    if free != s[3]:
        s[2] = s[2] - c.kp * h / c.ti * e if c.hold_windup > 0.0 else s[3] - c.kp * e
    return s[3]


@njit(cache=True)
def stroke(u: float, s: np.ndarray, dt: float, tau: float, p: Any) -> float:
    """Flow [%] through the valve after one step; `s` holds the stages' positions, shape (8,)."""
    s[0] = slew(s[0], u, p.rate, dt)
    ask = s[0]
    if p.pos_w > 0.0:
        s[1], s[2] = positioner(s[1], s[2], ask, p.pos_w, p.pos_z, p.pos_dead, dt)
        ask = s[1]
    if p.static > 0.0:
        s[3], s[4] = stick_slip(s[3], s[4], ask, p.static, p.sliding, tau, dt)
    else:
        s[3] = push_through_gap(s[3], ask, p.gap) if p.gap > 0.0 else ask
    z = min(s[3], p.stop)
    extra = second_valve(z, p.split_at, p.split_dead, p.split_ratio)
    s[6] += (extra - s[6]) * (min(dt / p.split_s, 1.0) if p.split_s > 0.0 else 1.0)
    s[5] += (z - s[5]) * 2.0 * dt / p.T
    return trim(z, p.v0, p.bend) + s[6] + p.hurry * abs(z - s[5]) * (z - s[5]) / 10.0


@njit(cache=True)
def aid(now: float, y: float, on: float, dt: float, p: Any) -> float:
    """Flow [%] of the hidden controller after one step: integral action when it acts, decay when not."""
    if on > 0.0:
        return now - p.helper * (y - p.y0) / (p.K * p.T) * dt
    return now * (1.0 - dt / p.T)


@njit(cache=True)
def gripped(shown: float, seen: float, grip: float) -> float:
    """The value of a sensor that changes only when the true value differs by `grip` [%], and then at once."""
    return seen if abs(seen - shown) >= grip else shown


@njit(cache=True)
def switched(on: float, x: float, at: float, band: float) -> float:
    """Whether (1, 0) a load that PV switches is on; it switches at a deviation [%] with a hysteresis band."""
    if x > at + 0.5 * band:
        return 1.0
    return 0.0 if x < at - 0.5 * band else on


@njit(cache=True)
def parted(q: float, flow: np.ndarray, far: int, v0: float) -> float:
    """Flow [%] over two paths: up to `v0` over the short one, above it over one with a delay of `far` steps."""
    late = flow[far] if far > 0 else v0
    return min(q, v0) + max(late, v0) - v0


@njit(cache=True)
def timed(left: float, armed: float, x: float, dt: float, p: Any) -> tuple[float, float]:
    """Remaining time [s] of a relay, and whether it is armed (1, 0), after one step."""
    left = max(left - dt, 0.0)
    if x > p.relay_at and armed > 0.0:
        return p.relay_s, 0.0
    return left, 1.0 if x < p.relay_at and left <= 0.0 else armed


@njit(cache=True)
def settle(p: Any, c: Any, sp: float) -> tuple[np.ndarray, np.ndarray]:
    """Valve stages and controller states of a loop at rest."""
    valve = np.zeros(8)
    valve[0] = valve[1] = valve[3] = valve[5] = p.v0
    memory = np.array([p.y0, sp - p.y0, p.v0 - c.kp * (sp - p.y0), p.v0])
    return valve, memory


@njit(cache=True)
def run(p: Any, c: Any, rows: np.ndarray, given: np.ndarray, closed: bool, h: float, m: int) -> np.ndarray:
    """The loop over all scans; returns PV at the transmitter and OP of the controller, shape (2, n)."""
    n, dt = rows.shape[1], h / m
    total = n * m + m + 1
    flow, passed, past = np.full(total, p.v0), np.zeros(total), np.zeros(total)
    x, work, out = np.zeros(STATES), np.zeros((5, STATES)), np.zeros((2, n))
    valve, memory = settle(p, c, rows[0, 0])
    now, back, aided = 0, 0, 0.0
    felt, on, shown = 0.0, 0.0, p.y0
    lane, weary, left, armed, kept, calm = 0.0, 0.0, 0.0, 1.0, p.v0, 0.0
    for k in range(n):
        seen = reading(x, rows[3, k], rows[4, k], p) + p.foam * abs(x[0] - calm)
        blown = p.purge > 0.0 and (k * h) % p.purge_s < p.purge * p.purge_s
        shown = shown if blown else gripped(shown, seen, p.grip)
        out[0, k] = shown
        u = given[k]
        if closed:
            u = decide(rows[0, k], out[0, k], memory, rows[6, k], rows[7, k], h, c)
        out[1, k] = u
        u = c.res * np.round(u / c.res) if closed and c.res > 0.0 else u
        if p.hold_s > 0.0:
            kept = u if (k * h) % p.hold_s < h else kept
            u = kept
        gain = 1.0 + p.drift * (k / n - 0.5)
        until = (k + 1) * m + (int(rows[5, k + 1]) if k + 1 < n else 0)
        while now < until:
            flow[now + 1] = stroke(u, valve, dt, 0.25 * h, p)
            passed[now + 1] = passed[now] + dt * max(1.0 + p.pipe * (flow[now] / p.v0 - 1.0), 0.1)
            now += 1
            q, back = leaves_pipe(flow, passed, now, back, p.L)
            if p.detour > 0.0:
                q = parted(q, flow, now - int((p.L + p.detour) / dt), p.v0)
            lane = switched(lane, q - p.v0, p.regime_at, p.regime_band)
            weary += abs(flow[now] - flow[now - 1]) / 10.0 - weary * dt / p.tired_s
            left, armed = timed(left, armed, x[0], dt, p)
            calm += (x[0] - calm) * dt / (0.3 * p.T)
            bent = (1.0 + p.regime * lane) * max(1.0 - p.tired * weary, 0.1)
            old = now - int(p.echo_s / dt)
            again = p.echo * past[old] / p.K if old > 0 else 0.0
            aided = aid(aided, p.y0 + x[0], rows[8, k], dt, p)
            felt += (x[0] - felt) * dt / p.recall_s
            on = switched(on, x[0], p.switch_at, p.switch_band)
            act = rows[1, k] + rows[9, k] + again + aided + p.switch * on + p.relay * (left > 0.0)
            feed = (
                p.K * gain * max(1.0 + p.recall * felt / 10.0, 0.1) * ((q - p.v0) * rows[2, k] * bent + act)
            )
            advance(x, work, feed, rows[3, k], dt, p)
            past[now] = level_of(x, p) - p.y0
    return out


def close_loop(p: Plant, c: Pi, drive: Drive, scan: float) -> np.ndarray:
    """PV and OP [%] of the loop in automatic, shape (2, n); `scan` in seconds."""
    rows = drive.table()
    return run(p, c, rows, np.zeros(rows.shape[1]), True, scan, STEPS)


def open_loop(p: Plant, op: np.ndarray, drive: Drive, scan: float) -> np.ndarray:
    """PV [%], shape (n,), for a recorded OP, shape (n,)."""
    return run(p, Pi(), drive.table(), np.asarray(op, float), False, scan, STEPS)[0]


def idle(n: int, p: Plant) -> Drive:
    """A drive without any input for `n` scans."""
    zero, one = np.zeros(n), np.ones(n)
    return Drive(zero + p.y0, zero, one, zero, zero, zero, zero + np.nan, 100.0 * one, zero, zero)
